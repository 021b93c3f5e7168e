#include "solids/cone.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "solids/around_axis.h"
#include "solids/patches.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// Points nearer than this share of the coordinates count as on the surface.
constexpr double kOnSurface = 1e-8;

/// Directions of translations of a cone, of any length: the inward normals of its lateral surface.
struct Slant {
  double radius, height;

  /// The normal on the side of v: the direction of the shortest translation past v.
  Vector towards(const Vector& v) const {
    const double length = axisDistance(v);
    if (!(length > 0)) return {height, 0, -radius};
    return {-v[0] / length * height, -v[1] / length * height, -radius};
  }
  /// Tries the two directions that are perpendicular to an edge, if there are any.
  template <typename Search>
  void tryAcross(const Vector& edge, Search& shortest) const {
    const double across = axisDistance(edge), cosine = edge[2] * radius / (height * across);
    if (!(std::abs(cosine) <= 1)) return;
    const double sine = std::sqrt((1 - cosine) * (1 + cosine)), x = edge[0] / across,
                 y = edge[1] / across;
    for (const double s : {-sine, sine})
      shortest.tryDirection(
          {height * (cosine * x - s * y), height * (cosine * y + s * x), -radius});
  }
};

}  // namespace

Vector ConeSolid::support(const Vector& direction) const {
  const Vector apex(0, 0, half_), on_base = onCircle(direction, radius_, -half_);
  return direction.dot(apex) > direction.dot(on_base) ? apex : on_base;
}

Penetration ConeSolid::penetration(const Triangle& triangle) const {
  ShortestTranslation shortest(triangle, [=](const Vector& m) {
    return std::max(-half_ * m[2], half_ * m[2] + radius_ * axisDistance(m));
  });
  const Slant side{radius_, 2 * half_};
  shortest.tryBoth(Vector::UnitZ());
  shortest.tryFaceNormal();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector &v = triangle[k], edge = triangle[(k + 1) % 3] - v;
    shortest.tryDirection(side.towards(v));
    side.tryAcross(edge, shortest);
    shortest.tryDirection({-v[0], -v[1], 0});  // past a vertical edge, by the base
    RimAndEdge{radius_, 0}.tryDirections(v + half_ * Vector::UnitZ(), edge, shortest);
  }
  shortest.tryDirection(Vector::UnitX());  // for a triangle on the axis
  return shortest.penetration();
}

ShapeSurface ConeSolid::surface(const Vector& x) const {
  const AroundAxis around(x);
  const Profile &p = around.profile(), rim(radius_, -half_);
  const Profile to_tip(-radius_, 2 * half_), side = Profile(2 * half_, radius_).normalized();
  // The nearest points of the lateral surface, which runs from the rim to the tip, and of the base.
  const double share = std::clamp((p - rim).dot(to_tip) / to_tip.squaredNorm(), 0., 1.);
  const Profile on_side = rim + share * to_tip, on_base(std::min(p[0], radius_), -half_);
  const double to_side = (p - on_side).norm(), to_base = (p - on_base).norm();
  const bool is_inside = p[1] >= -half_ && side.dot(p - rim) <= 0, is_side = to_side < to_base;
  const Profile& nearest = is_side ? on_side : on_base;
  const double distance = std::min(to_side, to_base);
  // The exact normals of the lateral surface and the base, because x - nearest is inaccurate near
  // them.
  Profile outward = is_side ? side : Profile(0, -1);
  const bool is_tip = is_side && share == 1;
  if (is_tip || nearest == rim) {
    if (distance > kOnSurface * std::max(p.cwiseAbs().maxCoeff(), distance))
      outward = (is_inside ? Profile(nearest - p) : Profile(p - nearest)) / distance;
    else
      outward = is_tip ? Profile(0, 1) : Profile((side + Profile(0, -1)).normalized());
  }
  return {is_inside ? -distance : distance, around(nearest), around(outward)};
}

/// A point is inside if it is between base and tip and its distance from the axis is at most slope
/// (half_ - z). On the line, the squares give the inequality a t^2 + 2 b t + c <= 0. Its solutions
/// also include the mirrored cone beyond the tip, which is excluded.
LineInterval ConeSolid::lineInside(const Line& given) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double slope = radius_ / (2 * half_);
  return fromNearest(given, [&](const Line& line) -> LineInterval {
    const LineInterval slab = lineInSlab(line, 2, half_);
    if (slab.isEmpty()) return {};
    const Eigen::Vector2d x = line.origin.head<2>(), d = line.direction.head<2>();
    // The cone's radius at the height of the point t of the line is s + t ds.
    const double s = slope * (half_ - line.origin[2]), ds = -slope * line.direction[2];
    const double a = d.squaredNorm() - ds * ds, b = x.dot(d) - s * ds, c = x.squaredNorm() - s * s;
    if (a == 0) return slab & LineInterval::whereNotPositive(c, 2 * b);
    // The discriminant is b b - a c, computed without the cancellation of large products.
    const double cross = x[0] * d[1] - x[1] * d[0];
    const double discriminant = (x * ds - d * s).squaredNorm() - cross * cross;
    if (discriminant < 0) return a > 0 ? LineInterval() : slab;
    const double sum = -(b + std::copysign(std::sqrt(discriminant), b));
    double first = sum / a, second = sum == 0 ? first : c / sum;
    if (first > second) std::swap(first, second);
    if (a > 0) return slab & LineInterval{first, second};
    // Inside before the first root or after the second one, where the cone's radius is positive.
    return slab & (ds < 0 ? LineInterval{-kInfinity, first} : LineInterval{second, kInfinity});
  });
}

void ConeSolid::addPatches(std::vector<SurfacePatch>& to) const {
  const PatchList patches(to);
  patches.addDisk(radius_, -half_);
  patches.addTurned(0, half_, radius_, -half_);
}

}  // namespace adaptive_bvh
