#pragma once

#include <array>
#include <vector>

#include "support/integer_triangles.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {

namespace integer {
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
}  // namespace integer

/// Whether the convex hulls of two sets of points have no common point: whether a plane across one
/// of some directions has one hull strictly on each side. The line between the nearest points of
/// two hulls is one of them, whatever their dimensions. Exact for whole numbers below 2^17
/// (integer::Point); in quadruple precision (quad::Point) `margin` is what a gap must exceed,
/// relative to the direction's size.
template <typename Point>
class HullPair {
 public:
  using Points = std::vector<Point>;

  HullPair(Points a, Points b) : a_(std::move(a)), b_(std::move(b)) {}

  bool areApart() const {
    return byFaces(a_) || byFaces(b_) || byEdges() || byPoints() || byEdgesAndPoints(a_, b_) ||
           byEdgesAndPoints(b_, a_);
  }

 private:
  static double marginOf(const integer::Point&) { return 0; }
  static quad::Real marginOf(const quad::Point& direction) {
    return quad::size(direction) * quad::Real(1e-30);
  }

  bool isAcross(const Point& direction) const {
    using Number = decltype(dot(direction, direction));
    Number low[2], high[2];
    const Points* const sets[2] = {&a_, &b_};
    for (int s = 0; s < 2; ++s) {
      low[s] = high[s] = dot(direction, sets[s]->front() - a_.front());
      for (const Point& x : *sets[s]) {
        const Number height = dot(direction, x - a_.front());
        low[s] = std::min(low[s], height);
        high[s] = std::max(high[s], height);
      }
    }
    const auto margin = Number(marginOf(direction));
    return high[0] + margin < low[1] || high[1] + margin < low[0];
  }
  bool byFaces(const Points& points) const {
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < j; ++k)
          if (isAcross(cross(points[j] - points[i], points[k] - points[i]))) return true;
    return false;
  }
  bool byEdges() const {
    for (std::size_t i = 0; i < a_.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < b_.size(); ++k)
          for (std::size_t l = 0; l < k; ++l)
            if (isAcross(cross(a_[j] - a_[i], b_[l] - b_[k]))) return true;
    return false;
  }
  bool byPoints() const {
    for (const Point& p : a_)
      for (const Point& q : b_)
        if (isAcross(p - q)) return true;
    return false;
  }
  /// By what is perpendicular to an edge of one, towards a point of the other.
  bool byEdgesAndPoints(const Points& edges, const Points& points) const {
    for (std::size_t i = 0; i < edges.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (const Point& x : points) {
          const Point edge = edges[j] - edges[i];
          if (isAcross(cross(edge, cross(x - edges[i], edge)))) return true;
        }
    return false;
  }

  const Points a_, b_;
};

/// Four corners of a vertex and a face, or of two edges, at the start and at the end of their ways:
/// whether all places that the first feature may come to are apart from those of the second,
/// whichever corner moves first.
template <typename Point>
bool areApartAllTheWay(int firsts, const std::array<Point, 4>& start,
                       const std::array<Point, 4>& end) {
  std::vector<Point> sides[2];
  for (std::size_t i = 0; i < 4; ++i) {
    sides[int(i) >= firsts].push_back(start[i]);
    sides[int(i) >= firsts].push_back(end[i]);
  }
  return HullPair<Point>(sides[0], sides[1]).areApart();
}

}  // namespace adaptive_bvh_test
