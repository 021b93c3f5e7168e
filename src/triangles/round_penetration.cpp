#include <algorithm>
#include <cmath>

#include "triangles/convex_distance.h"
#include "triangles/shape_surface.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

double level(const Vector& x) { return std::sqrt(x[0] * x[0] + x[1] * x[1]); }

/// The directions at right angles to an edge along which a disk at the height `half`, or its
/// reflection at -half, is the shortest way from getting past the edge. Let c and s be the level
/// part and the height of the edge, in its length; u level and at right angles to it; w at right
/// angles to both, w_z = c > 0. The way along cos(t) u + sin(t) w is
///   half c |sin t| + radius sqrt(1 - c^2 sin^2 t) + cos(t) u v + sin(t) w v.
struct RimAndEdge {
  double radius, half;

  /// The edge begins at v. Upright edges have no such u: the directions of their corners serve.
  template <typename Way>
  void tryDirections(const Vector& v, const Vector& edge, Way& way) const {
    constexpr double kUpright = 0x1p-40;
    const double length = edge.norm(), across = level(edge);
    if (!(across > kUpright * length)) return;
    const Vector u = Vector(-edge[1], edge[0], 0) / across, w = (edge / length).cross(u);
    way.tryBoth(u);
    way.tryBoth(w);
    const double along_u = u.dot(v), along_w = w.dot(v);
    const double c = across / length, s = edge[2] / length;
    const Vector from = along_u > 0 ? Vector(-u) : u;
    for (const double side : {-1., 1.}) {
      const double tangent = leastTangent(half * c + side * along_w, std::abs(along_u), c, s);
      if (tangent > 0) way.tryDirection(from + (side * tangent) * w);
    }
  }

 private:
  /// The tangent x > 0 of the angle where the way is least: where its derivative, over the cosine,
  /// g(x) = d + a x - radius c^2 x / sqrt(1 + s^2 x^2), s^2 + c^2 = 1, changes from less than 0 to
  /// more. 0 where there is none. g is convex: Newton's method comes down to the root from the
  /// right without passing it.
  double leastTangent(double d, double a, double c, double s) const {
    constexpr int kMostSteps = 60;
    const double k = radius * c * c, s2 = s * s;
    double x = (k / std::abs(s) - d) / a;  // right of the root: x / sqrt(1 + s2 x^2) < 1 / |s|
    if (a > k) x = std::min(x, -d / (a - k));
    if (!(x > 0) || !std::isfinite(x)) return 0;
    for (int i = 0; i < kMostSteps; ++i) {
      const double square = 1 + s2 * x * x, root = std::sqrt(square);
      const double slope = a - k / (square * root);
      if (!(slope > 0)) return 0;
      const double next = x - (d + a * x - k * x / root) / slope;
      if (!(next > 0)) return 0;
      if (!(next < x * (1 - 0x1p-50))) break;
      x = next;
    }
    return x;
  }
};

/// The directions of a cone's side, whose slope is radius / height.
struct Slant {
  double radius, height;

  /// The one along which it is the shortest way from getting past a point.
  Vector towards(const Vector& v) const {
    const double length = level(v);
    if (!(length > 0)) return {height, 0, -radius};
    return {-v[0] / length * height, -v[1] / length * height, -radius};
  }
  /// Those at right angles to an edge.
  template <typename Way>
  void tryAcross(const Vector& edge, Way& way) const {
    const double across = level(edge), cosine = edge[2] * radius / (height * across);
    if (!(std::abs(cosine) <= 1)) return;
    const double sine = std::sqrt((1 - cosine) * (1 + cosine)), x = edge[0] / across,
                 y = edge[1] / across;
    for (const double s : {-sine, sine})
      way.tryDirection({height * (cosine * x - s * y), height * (cosine * y + s * x), -radius});
  }
};

}  // namespace

Penetration cylinderPenetration(const TrianglePoints<double>& triangle, double radius,
                                double half) {
  ShortestWay way(triangle,
                  [=](const Vector& m) { return half * std::abs(m[2]) + radius * level(m); });
  way.tryBoth(Vector::UnitZ());
  way.tryFaceNormal();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& v = triangle[k];
    way.tryDirection({-v[0], -v[1], 0});
    RimAndEdge{radius, half}.tryDirections(v, triangle[(k + 1) % 3] - v, way);
  }
  way.tryDirection(Vector::UnitX());  // where all of the triangle is on the axis
  return way.penetration();
}

Penetration conePenetration(const TrianglePoints<double>& triangle, double radius, double half) {
  ShortestWay way(triangle, [=](const Vector& m) {
    return std::max(-half * m[2], half * m[2] + radius * level(m));
  });
  const Slant side{radius, 2 * half};
  way.tryBoth(Vector::UnitZ());
  way.tryFaceNormal();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector &v = triangle[k], edge = triangle[(k + 1) % 3] - v;
    way.tryDirection(side.towards(v));
    side.tryAcross(edge, way);
    way.tryDirection({-v[0], -v[1], 0});  // past an upright edge, by the base
    RimAndEdge{radius, 0}.tryDirections(v + half * Vector::UnitZ(), edge, way);
  }
  way.tryDirection(Vector::UnitX());  // where all of the triangle is on the axis
  return way.penetration();
}

namespace {

/// The point of an ellipsoid that is nearest to x among those beyond the plane across its shortest
/// axis, seen from x: the outward direction there. Zero where no such point is nearer than all
/// around it. There is one at most (J. M. Martinez, "Local Minimizers of Quadratic Functions on
/// Euclidean Balls and Spheres", 1994): at the smallest root w of
///   sum (r_k z_k / (e_k - w))^2 = 1 in (0, least e_k beside that of the shortest axis),
/// with z, r and e (the excess) of ScaledEllipsoid.
class OtherSide {
 public:
  OtherSide(const Vector& x, const Vector& radii) : x_(x), radii_(radii), scaled_(x, radii) {}

  Vector outward() const {
    const auto& [shortest, z, r, excess] = scaled_;
    const double least_excess = std::min(excess[(shortest + 1) % 3], excess[(shortest + 2) % 3]);
    if (z[shortest] == 0) {  // x is in the plane: both sides are the same
      Vector mirrored = surfaceOfEllipsoid(x_, radii_).outward;
      mirrored[shortest] = -mirrored[shortest];
      return mirrored;
    }
    // The sum is convex. It is more than 1 below z, and falls up to the root.
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
  /// The sum at w, or half of its derivative there.
  double sum(double w, int derivatives) const {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      if (scaled_.z[k] == 0) continue;
      const double below = scaled_.excess[k] - w, part = scaled_.r[k] * scaled_.z[k] / below;
      sum += derivatives == 0 ? part * part : part * part / below;
    }
    return sum;
  }
  /// The last number between low and high for which something holds that holds up to some number.
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

/// The directions along which a point v is the shortest way, among all near them, from getting out
/// of an ellipsoid.
template <typename Try>
void visitWaysOut(const Vector& v, const Vector& radii, const Try& tryDirection) {
  const Vector x = -v;
  tryDirection(surfaceOfEllipsoid(x, radii).outward);
  tryDirection(OtherSide(x, radii).outward());
}

/// The same at right angles to an edge: in the plane across it, the ellipsoid is an ellipse.
template <typename Try>
void visitWaysAcross(const Vector& v, const Vector& edge, const Vector& radii,
                     const Try& tryDirection) {
  const double length = edge.norm();
  if (!(length > 0)) return;
  const Vector u = (edge / length).unitOrthogonal(), w = (edge / length).cross(u);
  // The axes of the ellipse: those of the squares of its reach.
  const Vector along_u = radii.cwiseProduct(u), along_w = radii.cwiseProduct(w);
  const double angle =
      std::atan2(2 * along_u.dot(along_w), along_u.squaredNorm() - along_w.squaredNorm()) / 2;
  const Vector major = std::cos(angle) * u + std::sin(angle) * w,
               minor = std::cos(angle) * w - std::sin(angle) * u;
  const double longer = radii.cwiseProduct(major).norm(),
               shorter = radii.cwiseProduct(minor).norm();
  visitWaysOut({major.dot(v), minor.dot(v), 0}, {longer, shorter, longer},
               [&](const Vector& m) { tryDirection(m[0] * major + m[1] * minor); });
}

}  // namespace

Penetration ellipsoidPenetration(const TrianglePoints<double>& triangle, const Vector& radii) {
  ShortestWay way(triangle, [&](const Vector& m) { return radii.cwiseProduct(m).norm(); });
  const auto tryDirection = [&](const Vector& m) { way.tryDirection(m); };
  way.tryFaceNormal();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& v = triangle[k];
    visitWaysOut(v, radii, tryDirection);
    visitWaysAcross(v, triangle[(k + 1) % 3] - v, radii, tryDirection);
  }
  return way.penetration();
}

}  // namespace adaptive_bvh
