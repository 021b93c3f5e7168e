// Triangulates polygons by ear clipping with exact predicates, and checks the result.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "planar.h"
#include "planar_tree.h"
#include "scene.h"

namespace adaptive_bvh {
namespace {

/// Three corners of a polygon, as indices.
using Ear = std::array<std::size_t, 3>;

/// Triangulates a polygon by cutting off corners (ears) until nothing is left. Every cut is a
/// counter-clockwise triangle that no part of the outline enters, so an ear remains an ear until it
/// is cut. A corner is tested again after a neighbour was cut.
class EarClipping {
 public:
  explicit EarClipping(WorkLimit& work) : work_(work), exact_(work) {}

  /// Sets `ears` to the triangles. Returns false if there is no such triangulation, or if the work
  /// limit is exceeded. `rotated` are the points in the PlanarFrame of the boxes.
  bool run(const std::vector<PlanarPoint>& points, const std::vector<PlanarPoint>& rotated,
           std::vector<Ear>& ears) {
    points_ = &points;
    rotated_ = &rotated;
    start();
    removeAll([this](std::size_t v) { return isSuperfluous(v); });
    edges_.build(points.size(), [this](std::size_t v) { return boxOfEdge(v); });
    ears.clear();
    removeAll([&](std::size_t v) {
      if (isSuperfluous(v)) return true;
      if (!isEar(v)) return false;
      ears.push_back({previous_[v], v, next_[v]});
      std::rotate(ears.back().begin(), std::min_element(ears.back().begin(), ears.back().end()),
                  ears.back().end());
      return true;
    });
    return remaining_ <= 2;
  }

 private:
  void start() {
    edges_ = {};
    remaining_ = points_->size();
    next_.resize(remaining_);
    previous_.resize(remaining_);
    for (std::size_t v = 0; v < remaining_; ++v) {
      next_[v] = (v + 1) % remaining_;
      previous_[next_[v]] = v;
    }
  }

  /// Removes corners that satisfy `isRemovable`, in rounds: a corner whose neighbour was removed is
  /// tested in the next round. Every other corner is tested first, which keeps triangles wide.
  template <typename Predicate>
  void removeAll(const Predicate& isRemovable) {
    this_round_.clear();
    next_round_.clear();
    is_in_next_round_.assign(points_->size(), false);
    for (const std::size_t first : {1, 0})
      for (std::size_t v = first; v < points_->size(); v += 2) this_round_.push_back(v);
    for (; !this_round_.empty(); endRound())
      for (const std::size_t v : this_round_) {
        if (remaining_ <= 2 || work_.isSpent()) return;
        if (!remains(v) || is_in_next_round_[v] || !isRemovable(v)) continue;
        for (const std::size_t neighbour : {previous_[v], next_[v]}) {
          if (!is_in_next_round_[neighbour]) next_round_.push_back(neighbour);
          is_in_next_round_[neighbour] = true;
        }
        remove(v);
      }
  }

  void endRound() {
    this_round_.swap(next_round_);
    next_round_.clear();
    for (const std::size_t v : this_round_) is_in_next_round_[v] = false;
  }

  /// Whether a corner has not been removed.
  bool remains(std::size_t v) const { return next_[v] != v; }
  void remove(std::size_t v) {
    next_[previous_[v]] = next_[v];
    previous_[next_[v]] = previous_[v];
    next_[v] = v;
    --remaining_;
    for (const std::size_t changed : {previous_[v], v})
      edges_.update(changed, [this](std::size_t a) { return boxOfEdge(a); });
  }

  /// The box of the edge from a corner to the next one, empty if the corner was removed.
  PlanarBox boxOfEdge(std::size_t v) const {
    PlanarBox box;
    if (!remains(v)) return box;
    box.add((*rotated_)[v]);
    box.add((*rotated_)[next_[v]]);
    return box;
  }

  const PlanarPoint& point(std::size_t v) const { return (*points_)[v]; }

  /// Whether the outline repeats a point, or turns straight back, at this corner.
  bool isSuperfluous(std::size_t v) const {
    const PlanarPoint &u = point(previous_[v]), &p = point(v), &w = point(next_[v]);
    if (u == p || u == w) return true;
    if (exact_.orientation(u, p, w) != 0) return false;
    // On one line: whether both neighbours are on the same side of the corner.
    return u.x != p.x ? (u.x < p.x) == (w.x < p.x) && w.x != p.x
                      : (u.y < p.y) == (w.y < p.y) && w.y != p.y;
  }

  /// Whether the triangle of a corner and its neighbours is counter-clockwise, and no part of the
  /// outline enters it. The new edge (from the first to the third corner) must not touch a corner.
  bool isEar(std::size_t v) const {
    const std::size_t u = previous_[v], w = next_[v];
    const PlanarTriangle triangle = {point(u), point(v), point(w)};
    if (exact_.orientation(triangle[0], triangle[1], triangle[2]) <= 0) return false;
    PlanarBox box;
    for (const std::size_t corner : {u, v, w}) box.add((*rotated_)[corner]);
    return !edges_.any(box, work_, [&](std::size_t a) {
      return remains(a) && (exact_.isWithinSegment(triangle[0], triangle[2], point(a)) ||
                            exact_.enters(point(a), point(next_[a]), triangle));
    });
  }

  WorkLimit& work_;
  PlanarPredicates exact_;
  const std::vector<PlanarPoint>*points_ = nullptr, *rotated_ = nullptr;  ///< arguments of `run`
  PlanarTree edges_;                          ///< edges of the outline of the remaining corners
  std::size_t remaining_ = 0;                 ///< number of corners not yet removed
  std::vector<std::size_t> next_, previous_;  ///< by corner: its remaining neighbours
  std::vector<std::size_t> this_round_, next_round_;  ///< corners to test: see removeAll
  std::vector<bool> is_in_next_round_;                ///< by corner
};

/// Triangulates polygons in sequence, reusing its memory.
class Triangulation {
 public:
  explicit Triangulation(WorkLimit& work) : work_(work), exact_(work), clipping_(work) {}

  /// Triangulates one polygon; `ears` returns the triangles. Returns false if there is no
  /// triangulation, or if the work limit is exceeded.
  bool run(const std::vector<fcl::Vector3d>& corners) {
    const int axis = axisOf(corners);
    for (int k = axis; k < axis + 3; ++k) {
      const int x = (k + 1) % 3, y = (k + 2) % 3;
      if (!runIn(corners, x, y) && !runIn(corners, y, x)) return false;  // either orientation
      if (!ears_.empty()) return true;
    }
    return true;  // the polygon has no area in any projection
  }
  const std::vector<Ear>& ears() const { return ears_; }

 private:
  /// The axis along which the normal is largest. Coordinates are relative to the first corner, so
  /// that little accuracy is lost far from the origin.
  static int axisOf(const std::vector<fcl::Vector3d>& corners) {
    fcl::Vector3d normal = fcl::Vector3d::Zero();
    double size = 0;
    for (const fcl::Vector3d& p : corners)
      size = std::max(size, (p - corners[0]).lpNorm<Eigen::Infinity>());
    for (std::size_t k = 1; k + 1 < corners.size() && size > 0; ++k)
      normal += ((corners[k] - corners[0]) / size).cross((corners[k + 1] - corners[0]) / size);
    int axis;
    normal.cwiseAbs().maxCoeff(&axis);
    return axis;
  }

  /// Triangulates the projection to the coordinates x and y, scaled by a power of two to at most 1.
  bool runIn(const std::vector<fcl::Vector3d>& corners, int x, int y) {
    double size = 0;
    for (const fcl::Vector3d& p : corners)
      size = std::max({size, std::fabs(p[x]), std::fabs(p[y])});
    int exponent;
    std::frexp(size, &exponent);
    points_.clear();
    for (const fcl::Vector3d& p : corners)
      points_.push_back({std::ldexp(p[x], -exponent), std::ldexp(p[y], -exponent)});
    const PlanarFrame frame(points_);
    rotated_.clear();
    for (const PlanarPoint& p : points_) rotated_.push_back(frame(p));
    return clipping_.run(points_, rotated_, ears_) && isWithoutOverlap();
  }

  PlanarTriangle triangleOf(std::size_t ear) const {
    return {points_[ears_[ear][0]], points_[ears_[ear][1]], points_[ears_[ear][2]]};
  }
  PlanarBox boxOf(std::size_t ear) const {
    PlanarBox box;
    for (const std::size_t corner : ears_[ear]) box.add(rotated_[corner]);
    return box;
  }

  /// Whether no two triangles overlap. The triangles add up to the outline: each point is in as
  /// many triangles as the outline's winding number there. If that is more than one, two triangles
  /// overlap.
  bool isWithoutOverlap() {
    tree_.build(ears_.size(), [this](std::size_t ear) { return boxOf(ear); });
    for (std::size_t one = 0; one < ears_.size() && !work_.isSpent(); ++one)
      if (tree_.any(boxOf(one), work_, [&](std::size_t two) {
            return two > one && exact_.overlap(triangleOf(one), triangleOf(two));
          }))
        return false;
    return !work_.isSpent();
  }

  WorkLimit& work_;
  PlanarPredicates exact_;
  EarClipping clipping_;
  std::vector<PlanarPoint> points_, rotated_;  ///< the projection; and in the frame of boxes
  std::vector<Ear> ears_;
  PlanarTree tree_;  ///< over the ears
};

[[noreturn]] void refuseFace(std::size_t face, const std::string& reason) {
  throw std::runtime_error("face " + std::to_string(face + 1) + ' ' + reason);
}

}  // namespace

TriangleMesh triangulate(PolygonMesh mesh, WorkLimit& work) {
  TriangleMesh result;
  result.vertices = std::move(mesh.vertices);
  Triangulation triangulation(work);
  std::vector<fcl::Vector3d> points;
  std::size_t most_triangles = 0;
  for (const std::size_t size : mesh.sizes) most_triangles += size < 3 ? 0 : size - 2;
  result.triangles.reserve(most_triangles);
  const std::size_t* corner = mesh.corners.data();
  for (std::size_t face = 0; face < mesh.sizes.size(); corner += mesh.sizes[face++]) {
    const std::size_t size = mesh.sizes[face];
    for (std::size_t k = 0; k < size; ++k)
      if (corner[k] >= result.vertices.size())
        refuseFace(face, "names vertex " + std::to_string(corner[k]) + " of " +
                             std::to_string(result.vertices.size()));
    if (size == 3) result.triangles.emplace_back(corner[0], corner[1], corner[2]);
    if (size <= 3) continue;
    if (size > kMostCorners)
      refuseFace(face, "has more than " + std::to_string(kMostCorners) + " corners");
    points.clear();
    for (std::size_t k = 0; k < size; ++k) points.push_back(result.vertices[corner[k]]);
    if (!std::all_of(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); }))
      refuseFace(face, "has a corner that is not finite");
    const bool is_done = triangulation.run(points);
    if (work.isSpent())
      refuseFace(face, "of " + std::to_string(size) + " corners takes too long to triangulate");
    if (!is_done)
      refuseFace(face,
                 "of " + std::to_string(size) +
                     " corners crosses itself, or touches itself so that no triangles fill it");
    for (const Ear& ear : triangulation.ears())
      result.triangles.emplace_back(corner[ear[0]], corner[ear[1]], corner[ear[2]]);
  }
  return result;
}

}  // namespace adaptive_bvh
