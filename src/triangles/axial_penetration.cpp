#include <algorithm>
#include <cmath>

#include "triangles/shortest_way.h"

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

}  // namespace adaptive_bvh
