#include "triangles/triangle_gap.h"

#include "triangles/orientation.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {
namespace {

using Face = feature_distance::Face;

/// The nearest pair of points of two triangles, by all pairs of features.
class NearestOfFeatures {
 public:
  NearestOfFeatures(const TrianglePoints& a, const TrianglePoints& b) : a_(a), b_(b) {
    for (std::size_t k = 0; k < 3; ++k) {
      considerVertex(a[k], b_, pair_.first, pair_.second);
      considerVertex(b[k], a_, pair_.second, pair_.first);
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) considerEdges(i, j);
  }

  const PointPair& pair() const { return pair_; }
  double distance() const { return std::sqrt(least_); }

 private:
  /// Considers a vertex of one triangle and the face of the other. If they are nearer, sets
  /// `of_vertex` and `of_face`, the points of pair_ that belong to these triangles.
  void considerVertex(const fcl::Vector3d& vertex, const Face& face, fcl::Vector3d& of_vertex,
                      fcl::Vector3d& of_face) {
    fcl::Vector3d on_face;
    const double square = face.squaredDistance(vertex, on_face);
    if (!(square < least_)) return;
    least_ = square;
    of_vertex = vertex;
    of_face = on_face;
  }
  /// Considers interior points of two edges; their ends are considered as vertices.
  void considerEdges(std::size_t i, std::size_t j) {
    const auto &u = a_.edge(i), &v = b_.edge(j);
    const fcl::Vector3d &from = a_.corners()[i], &to = b_.corners()[j], between = to - from;
    double s, t;
    if (!feature_distance::nearestInside(u, v, between, s, t)) return;
    const double square = (between + t * v.along - s * u.along).squaredNorm();
    if (!(square < least_)) return;
    least_ = square;
    pair_ = {from + s * u.along, to + t * v.along};
  }

  const Face a_, b_;
  PointPair pair_;
  double least_ = std::numeric_limits<double>::infinity();  ///< squared distance of the pair
};

/// Finds nearest points together with a proof: the triangles lie on different sides of the slab
/// between the two planes through the points, perpendicular to the line between them, up to a
/// tolerance. Then the points are right, however they were found. Tries the nearest points of all
/// edges, and of corners and faces, at a fifth of the cost of NearestOfFeatures. May fail for
/// needle-shaped faces, and fails for triangles that touch.
class SeparatedPoints {
 public:
  /// `extent` is that of both triangles together.
  SeparatedPoints(const TrianglePoints& a, const TrianglePoints& b, double extent)
      : a_(a), b_(b), tolerance_(kTolerance * extent), least_(kLeast * extent * kLeast * extent) {}

  /// Returns whether nearest points were found.
  bool find() {
    fcl::Vector3d u[3], v[3];  // the edges of a and b
    double uu[3], vv[3], inverse_uu[3], inverse_vv[3];
    for (std::size_t k = 0; k < 3; ++k) {
      u[k] = a_[(k + 1) % 3] - a_[k];
      v[k] = b_[(k + 1) % 3] - b_[k];
      uu[k] = u[k].squaredNorm();
      vv[k] = v[k].squaredNorm();
      if (!(uu[k] > kUnderflow && vv[k] > kUnderflow)) return false;
      inverse_uu[k] = 1 / uu[k];
      inverse_vv[k] = 1 / vv[k];
    }
    const auto clamped = [](double x) { return std::min(std::max(x, 0.), 1.); };
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        // The parameters s and t of the nearest points of edge i of a and edge j of b.
        const fcl::Vector3d w = b_[j] - a_[i];
        const double uv = u[i].dot(v[j]), uw = u[i].dot(w), vw = v[j].dot(w),
                     across = uu[i] * vv[j] - uv * uv;
        double s = across > 0 ? clamped((uw * vv[j] - uv * vw) / across) : 0;
        double t = (uv * s - vw) * inverse_vv[j];
        if (t < 0 || t > 1) {
          t = clamped(t);
          s = clamped((uw + t * uv) * inverse_uu[i]);
        }
        const fcl::Vector3d between = w + t * v[j] - s * u[i];
        const double square = between.squaredNorm();
        if (!(square < best)) continue;
        best = square;
        const fcl::Vector3d on_a = s * u[i], on_b = t * v[j];
        // Tests only the corners that are not on the two edges; they reject nearly all candidates.
        if (u[(i + 2) % 3].dot(between) + on_a.dot(between) < -tolerance_ * between.lpNorm<1>() ||
            v[(j + 2) % 3].dot(between) + on_b.dot(between) > tolerance_ * between.lpNorm<1>())
          continue;
        if (accept(a_[i] + on_a, b_[j] + on_b, between)) return true;
      }
    return findAbove(a_, u, b_, 1) || findAbove(b_, v, a_, -1);
  }

  const PointPair& points() const { return points_; }
  double distance() const { return distance_; }

 private:
  /// Relative to the extent: the tolerance of the proof, and the least distance that it can prove.
  static constexpr double kTolerance = 10 * 0x1p-53, kLeast = 16 * 0x1p-52;
  static constexpr double kUnderflow = 0x1p-900;  // products of smaller squares may underflow

  /// Tries the corner nearest to the plane of a face, if all corners are on one side of the plane.
  /// `sign` is 1 if the face belongs to a.
  bool findAbove(const TrianglePoints& face, const fcl::Vector3d (&edges)[3],
                 const TrianglePoints& corners, double sign) {
    const fcl::Vector3d normal = edges[0].cross(edges[1]);
    const double square = normal.squaredNorm();
    if (!(square > kUnderflow)) return false;
    std::size_t nearest = 0;
    std::array<double, 3> heights;  // times the normal's length
    for (std::size_t k = 0; k < 3; ++k) {
      heights[k] = normal.dot(corners[k] - face[0]);
      if (std::fabs(heights[k]) < std::fabs(heights[nearest])) nearest = k;
    }
    if (!areOnOneSide(heights)) return false;
    // The projection on the plane, in barycentric coordinates, so that it lies in the face.
    const fcl::Vector3d& corner = corners[nearest];
    double weights[3], sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      weights[k] = normal.dot(edges[k].cross(corner - face[k]));
      if (weights[k] < 0) return false;
      sum += weights[k];
    }
    const fcl::Vector3d foot =
        face[0] + (weights[2] / sum) * edges[0] - (weights[0] / sum) * edges[2];
    return sign > 0 ? accept(foot, corner, corner - foot) : accept(corner, foot, foot - corner);
  }

  /// Accepts two points, one of each triangle, if all corners lie beyond the two planes through
  /// them. `between` is on_b - on_a.
  bool accept(const fcl::Vector3d& on_a, const fcl::Vector3d& on_b, const fcl::Vector3d& between) {
    const double square = between.squaredNorm(), tolerance = tolerance_ * between.lpNorm<1>();
    if (!(square > least_)) return false;
    for (std::size_t k = 0; k < 3; ++k)
      if ((a_[k] - on_a).dot(between) > tolerance || (b_[k] - on_b).dot(between) < -tolerance)
        return false;
    points_ = {on_a, on_b};
    distance_ = std::sqrt(square);
    return true;
  }

  const TrianglePoints &a_, &b_;
  const double tolerance_, least_;  ///< length; squared length
  PointPair points_;
  double distance_ = 0;
};

/// The longest side of the box around both triangles.
double extentOf(const TrianglePoints& a, const TrianglePoints& b) {
  fcl::Vector3d low = a[0], high = a[0];
  for (const TrianglePoints* t : {&a, &b})
    for (const fcl::Vector3d& x : *t) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  return (high - low).maxCoeff();
}

/// The gap by all pairs of features, in coordinates enlarged by `unit` (rounding::enlargement).
TriangleGap gapOfFeatures(const TrianglePoints& a, const TrianglePoints& b, double unit) {
  const auto gap = [](const TrianglePoints& p, const TrianglePoints& q) {
    const NearestOfFeatures nearest(p, q);
    return TriangleGap{nearest.pair(), nearest.distance()};
  };
  if (unit == 1) return gap(a, b);
  const auto enlarged = [&](const TrianglePoints& t) -> TrianglePoints {
    return {unit * (t[0] - a[0]), unit * (t[1] - a[0]), unit * (t[2] - a[0])};
  };
  const TriangleGap found = gap(enlarged(a), enlarged(b));
  return {{a[0] + found.points.first / unit, a[0] + found.points.second / unit},
          found.distance / unit};
}

}  // namespace

TriangleGap gapOf(const TrianglePoints& a, const TrianglePoints& b) {
  const double extent = extentOf(a, b), unit = rounding::enlargement(extent);
  SeparatedPoints separated(a, b, extent);
  if (unit == 1 && separated.find()) return {separated.points(), separated.distance()};
  const TriangleIntersection common(a, b);
  if (common.isCrossing()) return {common.crossing(), 0};
  const TriangleGap nearest = gapOfFeatures(a, b, unit);
  if (common.exists()) return {nearest.points, 0};
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();  // 0 would mean contact
  return {nearest.points, std::max(nearest.distance, kLeast)};
}

}  // namespace adaptive_bvh
