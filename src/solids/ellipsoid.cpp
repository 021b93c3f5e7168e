#include "solids/ellipsoid.h"

#include <algorithm>
#include <cmath>

#include "solids/patches.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// A point and an axis-aligned ellipsoid in scaled numbers that stay accurate for all sizes and
/// ratios of the radii. z and r are those of Eberly's text (ellipsoid.h).
struct ScaledEllipsoid {
  int shortest;     ///< index of the shortest axis
  fcl::Vector3d z;  ///< absolute coordinates of the point, each divided by its axis's radius
  fcl::Vector3d r, excess;  ///< squared radii, divided by the shortest one's; the same minus 1

  ScaledEllipsoid(const fcl::Vector3d& x, const fcl::Vector3d& radii) {
    const double least = radii.minCoeff(&shortest);
    z = x.cwiseAbs().cwiseQuotient(radii);
    for (int k = 0; k < 3; ++k) {
      r[k] = (radii[k] / least) * (radii[k] / least);
      excess[k] = (radii[k] - least) / least * ((radii[k] + least) / least);
    }
  }
};

/// The root u > 0 of G(u) = sum (r_i z_i / (u + r_i - 1))^2 = 1; 0 if there is none. Newton's
/// method on 1 / sqrt(G), which is concave, approaches the root from below without passing it (J.
/// J. More, D. C. Sorensen, "Computing a Trust Region Step", 1983).
double ellipsoidRoot(const ScaledEllipsoid& scaled) {
  constexpr int kMostSteps = 200;
  const auto& [shortest, z, r, excess] = scaled;
  double u = 0;
  for (int k = 0; k < 3; ++k) u = std::max(u, r[k] * z[k] - excess[k]);
  for (int i = 0; i < kMostSteps; ++i) {
    double sum = 0, slope = 0;
    for (int k = 0; k < 3; ++k) {
      if (!(z[k] > 0)) continue;
      const double part = r[k] * z[k] / (u + excess[k]);
      sum += part * part;
      slope += part * part / (u + excess[k]);
    }
    const double next = u + sum * (std::sqrt(sum) - 1) / slope;
    if (!(next > u)) break;
    u = next;
  }
  return u;
}

/// The second local minimum of the distance from x to an ellipsoid: the point that is nearest to x
/// among the points on the other side of the plane perpendicular to the shortest axis. Returns the
/// outward direction there; zero if that side has no local minimum. There is at most one (J. M.
/// Martinez, "Local Minimizers of Quadratic Functions on Euclidean Balls and Spheres", 1994): at
/// the smallest root w of
///   sum (r_k z_k / (e_k - w))^2 = 1 in (0, least e_k beside that of the shortest axis),
/// with z, r and e (the excess) of ScaledEllipsoid.
class OtherSide {
 public:
  OtherSide(const Vector& x, const Vector& radii) : x_(x), radii_(radii), scaled_(x, radii) {}

  Vector outward() const {
    const auto& [shortest, z, r, excess] = scaled_;
    const double least_excess = std::min(excess[(shortest + 1) % 3], excess[(shortest + 2) % 3]);
    if (z[shortest] == 0) {  // x is in the plane: both sides are symmetric
      Vector mirrored = EllipsoidSolid(radii_).surface(x_).outward;
      mirrored[shortest] = -mirrored[shortest];
      return mirrored;
    }
    // The sum is convex. It exceeds 1 for w below z of the shortest axis, and decreases up to its
    // minimum, `bottom`. The root is before that.
    const double bottom = bisect(0, least_excess, [&](double w) { return sum(w, 1) < 0; });
    if (!(sum(bottom, 0) <= 1)) return Vector::Zero();
    const double root =
        bisect(std::min(z[shortest], bottom), bottom, [&](double w) { return sum(w, 0) > 1; });
    Vector outward;
    for (int k = 0; k < 3; ++k)
      outward[k] = (x_[k] < 0 ? -1 : 1) * r[k] * z[k] / ((excess[k] - root) * radii_[k]);
    return outward;
  }

 private:
  /// The sum at w, or half of its derivative there if `derivatives` is 1.
  double sum(double w, int derivatives) const {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      if (scaled_.z[k] == 0) continue;
      const double below = scaled_.excess[k] - w, part = scaled_.r[k] * scaled_.z[k] / below;
      sum += derivatives == 0 ? part * part : part * part / below;
    }
    return sum;
  }
  /// Bisects [low, high] for the number up to which `holds` is true.
  template <typename Holds>
  static double bisect(double low, double high, const Holds& holds) {
    for (;;) {
      const double middle = low + (high - low) / 2;
      if (!(middle > low && middle < high)) return high;
      (holds(middle) ? low : high) = middle;
    }
  }

  const Vector &x_, &radii_;
  const ScaledEllipsoid scaled_;
};

/// Tries all locally shortest translations of an ellipsoid that take a point v out of it.
template <typename Try>
void visitTranslationsOut(const Vector& v, const Vector& radii, const Try& tryDirection) {
  const Vector x = -v;
  tryDirection(EllipsoidSolid(radii).surface(x).outward);
  tryDirection(OtherSide(x, radii).outward());
}

/// Tries the locally shortest translations perpendicular to an edge that begins at v: in the plane
/// perpendicular to the edge, the ellipsoid's shadow is an ellipse, and the edge is a point.
template <typename Try>
void visitTranslationsAcross(const Vector& v, const Vector& edge, const Vector& radii,
                             const Try& tryDirection) {
  const double length = edge.norm();
  if (!(length > 0)) return;
  const Vector u = (edge / length).unitOrthogonal(), w = (edge / length).cross(u);
  // The principal axes of the ellipse, from its squared support function.
  const Vector along_u = radii.cwiseProduct(u), along_w = radii.cwiseProduct(w);
  const double angle =
      std::atan2(2 * along_u.dot(along_w), along_u.squaredNorm() - along_w.squaredNorm()) / 2;
  const Vector major = std::cos(angle) * u + std::sin(angle) * w,
               minor = std::cos(angle) * w - std::sin(angle) * u;
  const double longer = radii.cwiseProduct(major).norm(),
               shorter = radii.cwiseProduct(minor).norm();
  // As an ellipsoid with any third radius; the point is in the plane of the other two.
  visitTranslationsOut({major.dot(v), minor.dot(v), 0}, {longer, shorter, longer},
                       [&](const Vector& m) { tryDirection(m[0] * major + m[1] * minor); });
}

}  // namespace

Vector EllipsoidSolid::support(const Vector& direction) const {
  const Vector scaled = radii_.cwiseProduct(direction / direction.lpNorm<Eigen::Infinity>());
  const double length = scaled.norm();
  return length > 0 ? Vector(radii_.cwiseProduct(scaled / length)) : radii_;
}

ShapeSurface EllipsoidSolid::surface(const Vector& x) const {
  const Vector& radii = radii_;
  const ScaledEllipsoid scaled(x, radii);
  const auto& [shortest, z, r, excess] = scaled;
  const double u = ellipsoidRoot(scaled);
  Vector on_ball = Vector::Zero();  // the nearest point, divided by the radii
  for (int k = 0; k < 3; ++k)
    if (z[k] > 0) on_ball[k] = r[k] * z[k] / (u + excess[k]);
  if (u == 0) {  // so deep inside that the nearest point is outside the plane that contains x
    on_ball[shortest] = 0;
    on_ball[shortest] = std::sqrt(std::max(0., 1 - on_ball.squaredNorm()));
  }
  on_ball.normalize();
  const auto signs = x.unaryExpr([](double c) { return c < 0 ? -1. : 1.; });
  const Vector nearest = on_ball.cwiseProduct(radii).cwiseProduct(signs);
  const Vector outward =
      nearest.cwiseQuotient(radii).cwiseQuotient(radii / radii[shortest]).normalized();
  const double distance = (x - nearest).norm();
  return {z.squaredNorm() < 1 ? -distance : distance, nearest, outward};
}

Penetration EllipsoidSolid::penetration(const Triangle& triangle) const {
  ShortestTranslation shortest(triangle,
                               [&](const Vector& m) { return radii_.cwiseProduct(m).norm(); });
  const auto tryDirection = [&](const Vector& m) { shortest.tryDirection(m); };
  shortest.tryFaceNormal();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& v = triangle[k];
    visitTranslationsOut(v, radii_, tryDirection);
    visitTranslationsAcross(v, triangle[(k + 1) % 3] - v, radii_, tryDirection);
  }
  return shortest.penetration();
}

LineInterval EllipsoidSolid::lineInside(const Line& line) const {
  return lineInBall<Vector>(line.origin.cwiseQuotient(radii_), line.direction.cwiseQuotient(radii_),
                            1);
}

void EllipsoidSolid::addPatches(std::vector<SurfacePatch>& patches) const {
  for (const double sign : {1., -1.}) PatchList(patches).addHalf(Vector::Zero(), radii_, sign);
}

}  // namespace adaptive_bvh
