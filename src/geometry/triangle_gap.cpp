#include "geometry/triangle_gap.h"

namespace adaptive_bvh {
namespace {

using Face = feature_distance::Face<double>;

/// The nearest pair of points so far, one of each triangle.
class NearestOfFeatures {
 public:
  NearestOfFeatures(const TrianglePoints<double>& a, const TrianglePoints<double>& b)
      : a_(a), b_(b) {
    for (std::size_t k = 0; k < 3; ++k) {
      considerVertex(a[k], b_, pair_.first, pair_.second);
      considerVertex(b[k], a_, pair_.second, pair_.first);
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) considerEdges(i, j);
  }

  const PointPair<double>& pair() const { return pair_; }
  double squaredDistance() const { return least_; }

 private:
  void considerVertex(const fcl::Vector3d& vertex, const Face& face, fcl::Vector3d& at_vertex,
                      fcl::Vector3d& at_face) {
    fcl::Vector3d on_face;
    const double square = face.nearest(vertex, on_face);
    if (!(square < least_)) return;
    least_ = square;
    at_vertex = vertex;
    at_face = on_face;
  }
  /// Their ends are vertices.
  void considerEdges(std::size_t i, std::size_t j) {
    const auto &u = a_.edge(i), &v = b_.edge(j);
    const fcl::Vector3d &from = a_.corners()[i], &to = b_.corners()[j], between = to - from;
    double s, t;
    if (!feature_distance::nearestInside<double>(u, v, between, s, t)) return;
    const double square = (between + t * v.along - s * u.along).squaredNorm();
    if (!(square < least_)) return;
    least_ = square;
    pair_ = {from + s * u.along, to + t * v.along};
  }

  const Face a_, b_;
  PointPair<double> pair_;
  double least_ = std::numeric_limits<double>::infinity();
};

/// The sides of the face's plane on which the three points are, by orientation.
std::array<double, 3> sidesOf(const TrianglePoints<double>& face,
                              const TrianglePoints<double>& points) {
  std::array<double, 3> sides;
  for (std::size_t k = 0; k < 3; ++k) sides[k] = orientation(face[0], face[1], face[2], points[k]);
  return sides;
}

bool areOnOneSide(const std::array<double, 3>& sides) {
  return (sides[0] > 0 && sides[1] > 0 && sides[2] > 0) ||
         (sides[0] < 0 && sides[1] < 0 && sides[2] < 0);
}

/// Whether the line from p to q meets the face or its sides, where it does not lie in the face's
/// plane.
bool passesThrough(const fcl::Vector3d& p, const fcl::Vector3d& q,
                   const TrianglePoints<double>& face) {
  bool is_left = false, is_right = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const double side = orientation(p, q, face[k], face[(k + 1) % 3]);
    is_left = is_left || side > 0;
    is_right = is_right || side < 0;
  }
  return is_left != is_right;
}

/// How far from p to q, on either side of the face's plane, that plane is. Without cancellation:
/// the sides of needles have hardly a digit in double precision.
double shareUpTo(const TrianglePoints<double>& face, const fcl::Vector3d& p,
                 const fcl::Vector3d& q) {
  ExactSum above, whole;
  addOrientation(above, face[0], face[1], face[2], p);
  addOrientation(whole, face[0], face[1], face[2], p);
  addOrientation(whole, face[1], face[0], face[2], q);  // minus that of q
  return above.value() / whole.value();
}

/// Whether an edge of `edges` crosses or touches the face, without lying in its plane, and where.
/// `sides`: of the corners of `edges`.
bool findCrossing(const TrianglePoints<double>& edges, const TrianglePoints<double>& face,
                  const std::array<double, 3>& sides, fcl::Vector3d& crossing) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const double above = sides[k], below = sides[next];
    const bool is_across = (above > 0) != (below > 0) || (above < 0) != (below < 0);
    if (!is_across || !passesThrough(edges[k], edges[next], face)) continue;
    crossing = edges[k] + shareUpTo(face, edges[k], edges[next]) * (edges[next] - edges[k]);
    return true;
  }
  return false;
}

/// Whether an edge of one triangle crosses or touches the other; then a common point, as each has
/// it.
bool findCommonPoint(const TrianglePoints<double>& a, const TrianglePoints<double>& b,
                     PointPair<double>& points) {
  const auto sides_of_b = sidesOf(a, b);
  if (areOnOneSide(sides_of_b)) return false;
  const auto sides_of_a = sidesOf(b, a);
  if (areOnOneSide(sides_of_a)) return false;
  if (findCrossing(a, b, sides_of_a, points.first)) {
    points.second = nearestPoint(b, points.first);
    return true;
  }
  if (findCrossing(b, a, sides_of_b, points.second)) {
    points.first = nearestPoint(a, points.second);
    return true;
  }
  return false;
}

}  // namespace

TriangleGap gapOf(const TrianglePoints<double>& a, const TrianglePoints<double>& b) {
  TriangleGap gap;
  if (findCommonPoint(a, b, gap.points)) {
    gap.distance = 0;
    return gap;
  }
  const NearestOfFeatures nearest(a, b);
  fcl::Vector3d low = a[0], high = a[0];
  for (const TrianglePoints<double>* t : {&a, &b})
    for (const fcl::Vector3d& x : *t) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  const double extent = (high - low).maxCoeff();
  constexpr double kNothing = 16 * std::numeric_limits<double>::epsilon();
  const double distance = std::sqrt(nearest.squaredDistance());
  return {nearest.pair(), distance <= kNothing * extent ? 0 : distance};
}

}  // namespace adaptive_bvh
