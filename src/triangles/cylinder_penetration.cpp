#include "triangles/convex_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

/// The shortest of the ways out along some directions.
class CylinderWay {
 public:
  CylinderWay(const TrianglePoints<double>& triangle, double radius, double half)
      : triangle_(triangle), radius_(radius), half_(half) {}

  void tryDirection(const Vector& direction) {
    const double length = direction.norm();
    if (!(length > 0)) return;
    const Vector m = direction / length;
    const double reach = half_ * std::abs(m[2]) + radius_ * std::sqrt(m[0] * m[0] + m[1] * m[1]);
    const double way =
        reach + std::max({m.dot(triangle_[0]), m.dot(triangle_[1]), m.dot(triangle_[2])});
    if (way < best_.depth) best_ = {m, way, 0};
  }
  void tryBoth(const Vector& direction) {
    tryDirection(direction);
    tryDirection(-direction);
  }

  /// The directions at right angles to an edge, from v on. Let u be level among them, and w at
  /// right angles to it, w_z = c > 0. The way along cos(t) u + sin(t) w is half c |sin t| + radius
  /// sqrt(1 - c^2 sin^2 t) + cos(t) u v + sin(t) w v.
  void tryEdge(const Vector& v, const Vector& edge) {
    const double length = edge.norm(), across = std::hypot(edge[0], edge[1]);
    if (!(across > kLevel * length)) return;  // upright: the directions of its corners serve
    const Vector u = Vector(-edge[1], edge[0], 0) / across, w = (edge / length).cross(u);
    tryBoth(u);
    tryBoth(w);
    const double c = w[2], along_u = u.dot(v), along_w = w.dot(v);
    const Vector from = along_u > 0 ? Vector(-u) : u;
    for (const double side : {-1., 1.}) {
      const double tangent = leastTangent(half_ * c + side * along_w, std::abs(along_u), c);
      if (tangent > 0) tryDirection(from + (side * tangent) * w);
    }
  }

  Penetration way() const { return {best_.normal, std::max(best_.depth, 0.), 0}; }

 private:
  static constexpr double kLevel = 0x1p-40;

  /// The tangent x > 0 of the angle where the way is least: where its derivative, over the cosine,
  /// g(x) = d + a x - radius c^2 x / sqrt(1 + s^2 x^2), s^2 = 1 - c^2, changes from less than 0 to
  /// more. 0 where there is none. g is convex: Newton's method comes down to the root from the
  /// right without passing it.
  double leastTangent(double d, double a, double c) const {
    constexpr int kMostSteps = 60;
    const double k = radius_ * c * c, s2 = std::max(1 - c * c, 0.);
    double x = (k / std::sqrt(s2) - d) / a;  // right of the root: x / sqrt(1 + s2 x^2) < 1 / s
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

  const TrianglePoints<double>& triangle_;
  const double radius_, half_;
  Penetration best_{Vector::UnitZ(), std::numeric_limits<double>::infinity(), 0};
};

}  // namespace

Penetration cylinderPenetration(const TrianglePoints<double>& triangle, double radius,
                                double half) {
  CylinderWay way(triangle, radius, half);
  way.tryBoth(Vector::UnitZ());
  if (!isThin(triangle)) way.tryBoth((triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]));
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& v = triangle[k];
    way.tryDirection(Vector(-v[0], -v[1], 0));
    way.tryEdge(v, triangle[(k + 1) % 3] - v);
  }
  // Where all of the triangle is on the axis, any level direction.
  way.tryDirection(Vector::UnitX());
  return way.way();
}

}  // namespace adaptive_bvh
