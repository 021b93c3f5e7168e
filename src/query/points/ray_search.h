#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include "adaptive_bvh/point_query.h"
#include "base/float4.h"
#include "base/scratch.h"
#include "boxes/wide_tree.h"
#include "query/placed_mesh.h"
#include "triangles/ray_triangle.h"

namespace adaptive_bvh {

/// Throws std::invalid_argument if a ray is not finite or its direction is zero.
inline void requireRay(const fcl::Vector3d& origin, const fcl::Vector3d& direction) {
  if (!origin.allFinite() || !direction.allFinite())
    throw std::invalid_argument("adaptive_bvh: a ray's origin or direction is not finite");
  if (direction.isZero(0)) throw std::invalid_argument("adaptive_bvh: a ray's direction is zero");
}

/// Throws std::invalid_argument if a range is NaN, begins below 0 or ends before it begins.
inline void requireRange(const RayRange& range) {
  if (std::isnan(range.begin) || std::isnan(range.end))
    throw std::invalid_argument("adaptive_bvh: the range of a ray is NaN");
  if (range.begin < 0)
    throw std::invalid_argument("adaptive_bvh: the range of a ray begins below t = 0");
  if (range.begin > range.end)
    throw std::invalid_argument("adaptive_bvh: the range of a ray ends before it begins");
}

/// A ray in the coordinates of a four-wide tree, in single precision, and its slab test against
/// four boxes. Lengths along the ray are measured from a start near the body, so that all
/// coordinates are below 8. Boxes and lengths have margins for rounding: docs/bounds.md, 16.
class RayInTree {
 public:
  /// Sets the direction. A very long or short one is scaled before it is normalized.
  void setDirection(const WideTree& tree, const fcl::Vector3d& direction) {
    const double longest = direction.lpNorm<Eigen::Infinity>();
    constexpr double kShort = 1. / (1 << 20), kLong = 1 << 20;
    exponent_ = longest < kShort || longest > kLong ? std::ilogb(longest) : 0;
    fcl::Vector3d scaled = direction;
    if (exponent_ != 0)
      for (double& x : scaled) x = std::ldexp(x, -exponent_);
    per_t_ = scaled.norm() * tree.scale();
    along_ = tree.toBody() * (scaled * (1 / per_t_));
  }
  /// Sets the origin, after the direction. Returns false if the ray certainly misses the body.
  /// `error`: of the origin, in the mesh's units.
  bool setOrigin(const WideTree& tree, const fcl::Vector3d& origin, double error = 0) {
    const fcl::Vector3d in_tree = tree.toBody() * (origin - tree.origin());
    rounding_ = in_tree.lpNorm<Eigen::Infinity>() * kDoubleRounding + error * tree.scale();
    tests_boxes_ = rounding_ <= 1;
    if (!tests_boxes_) return meetEveryBox();
    constexpr double kExtent = 2.5;              // all coordinates of the body are below 2
    const double middle = -in_tree.dot(along_);  // where the ray is nearest to the centre
    constexpr double kRadius = 3.6;              // > sqrt(3) 2: of a ball around the body
    const double radius = kRadius + rounding_;
    if (!((in_tree + middle * along_).squaredNorm() <= radius * radius)) return false;
    if (middle < -(kExtent + radius)) return false;
    start_ = std::max(0., middle - radius);
    setSlabs(in_tree + start_ * along_, static_cast<float>(kSingleRounding + 4 * rounding_));
    return true;
  }

  /// Lengths along the ray, measured from start_: after(t) is certainly beyond the point at t,
  /// before(t) certainly before it.
  float after(double t) const { return tests_boxes_ ? clamped(lengthTo(t) + slack()) : kFar; }
  float before(double t) const { return tests_boxes_ ? clamped(lengthTo(t) - slack()) : -kFar; }

  /// Sets `enter` to the lengths at which the ray enters four boxes enlarged by the error, at least
  /// `begin`. Returns the mask of the boxes that it meets between the lengths `begin` and `end`.
  ADAPTIVE_BVH_INLINE Int4 meets(const Boxes4& boxes, float begin, float end, Float4& enter) const {
    using float4::lower;
    using float4::upper;
    static_assert(sizeof(Boxes4) == 6 * sizeof(Float4), "three low sides and three high");
    const auto side = [&](std::size_t offset) -> const Float4& {
      return *reinterpret_cast<const Float4*>(reinterpret_cast<const char*>(&boxes) + offset);
    };
    const auto atNear = [&](int k) -> Float4 {
      return side(near_side_[k]) * inverse_[k] - near_shift_[k];
    };
    const auto atFar = [&](int k) -> Float4 {
      return side(far_side_[k]) * inverse_[k] - far_shift_[k];
    };
    // `begin` is the second operand: it replaces a NaN, and of two zeros it is the result.
    enter = upper<Float4>(upper<Float4>(upper<Float4>(atNear(0), atNear(1)), atNear(2)),
                          float4::all(begin));
    return enter <= lower<Float4>(lower<Float4>(lower<Float4>(atFar(0), atFar(1)), atFar(2)),
                                  float4::all(end));
  }

 private:
  static constexpr double kDoubleRounding = 1. / (1ull << 48), kSingleRounding = 96. / (1 << 24);
  static constexpr float kFar = 1e30f;

  /// Sets the slab test for a ray from `start` and boxes enlarged by `margin`.
  void setSlabs(const fcl::Vector3d& start, float margin) {
    using packs::absolute;
    constexpr float kLeast = 1e-30f;  // replaces smaller components; its inverse is finite
    const Float4 slope = float4::narrowed(Pack<double>{along_[0], along_[1]},
                                          Pack<double>{along_[2], 1}),
                 from =
                     float4::narrowed(Pack<double>{start[0], start[1]}, Pack<double>{start[2], 0});
    const Float4 least = float4::all(kLeast), margins = float4::all(margin), zero = float4::all(0);
    const Float4 inverse = float4::all(1) / (absolute<Float4>(slope) > least ? slope : least);
    const auto is_backward = inverse < zero;
    const Float4 toward = is_backward ? -margins : margins;
    const Float4 near_shift = (from + toward) * inverse, far_shift = (from - toward) * inverse;
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      near_side_[k] = sizeof(Float4) * (axis + (is_backward[k] != 0 ? 3 : 0));
      far_side_[k] = sizeof(Float4) * (2 * axis + 3) - near_side_[k];
      inverse_[k] = float4::all(inverse[k]);
      near_shift_[k] = float4::all(near_shift[k]);
      far_shift_[k] = float4::all(far_shift[k]);
    }
  }
  /// Makes the slab test pass for every box but empty ones, whose sides are at 1e30: for an origin
  /// so far away that the body is smaller than the rounding error. Returns true.
  bool meetEveryBox() {
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      near_side_[k] = sizeof(Float4) * axis;
      far_side_[k] = sizeof(Float4) * (axis + 3);
      inverse_[k] = float4::all(1e-30f);
      near_shift_[k] = float4::all(0.5f);
      far_shift_[k] = float4::all(-0.5f);
    }
    return true;
  }

  /// The length from start_ to the point at t.
  double lengthTo(double t) const {
    return (exponent_ == 0 ? t : std::ldexp(t, exponent_)) * per_t_ - start_;
  }
  /// Error of lengths in the tree and of the t that RayTriangle computes.
  double slack() const { return (start_ + 16) * (1. / (1 << 16)) + 4 * rounding_ + 1e-4; }
  static float clamped(double length) {
    return length < double(kFar) ? static_cast<float>(std::max(length, -double(kFar))) : kFar;
  }

  fcl::Vector3d along_ = fcl::Vector3d::Zero();  ///< the direction, of length 1
  /// The ray reaches a box's near side on axis k at the length near side * inverse - near_shift.
  Float4 inverse_[3], near_shift_[3], far_shift_[3];
  std::size_t near_side_[3], far_side_[3];  ///< their offsets in Boxes4, in bytes
  bool tests_boxes_ = true;                 ///< false: meetEveryBox
  int exponent_ = 0;                        ///< a length from the origin is t per_t_ 2^exponent_
  double per_t_ = 1;
  double start_ = 0;     ///< length from the origin to where the ray comes near the body
  double rounding_ = 0;  ///< error of the origin in the tree's coordinates
};

/// The walk of a ray through a mesh's four-wide tree, one node a step: RayBatch steps several rays
/// in turn, which hides the latency of memory. Boxes are tested in single precision, triangles
/// exactly (RayTriangle). Rays are in the mesh's frame.
class RayWalk {
 public:
  explicit RayWalk(const MeshState& mesh)
      : mesh_(mesh),
        nodes_(mesh.tree.nodes()),
        open_(static_cast<std::size_t>(3 * mesh.tree.depth() + 4)) {}

  /// Starts a ray. Hits from t = `begin` to `end` are found; others may be found, too. Returns
  /// false if the ray misses the body. Consecutive rays with one direction share its preparation.
  bool start(const fcl::Vector3d& origin, const fcl::Vector3d& direction, double begin, double end,
             double error = 0) {
    if (direction != direction_) {
      direction_ = direction;
      ray_.setDirection(mesh_.tree, direction);
      test_.reset();
    }
    if (!ray_.setOrigin(mesh_.tree, origin, error)) return false;
    origin_ = origin;
    if (test_) test_->setOrigin(origin);
    begin_ = begin > 0 ? std::max(ray_.before(begin), 0.f) : 0.f;
    setEnd(end);
    top_ = open_.data();
    node_ = 0;
    return end_ >= begin_;
  }

  /// Visits a node. Calls found(triangle, hit) for each hit, in any order; `found` returns the t up
  /// to which hits are of interest; a negative t ends the walk. Returns false at its end.
  template <typename Found>
  ADAPTIVE_BVH_INLINE bool step(Found&& found) {
    const WideNode& node = nodes_[node_];
    Float4 enter;
    const auto meets = ray_.meets(node.boxes, begin_, end_, enter);
    const unsigned lanes = float4::bits(meets);
    if (lanes != 0 && !node.isLeaf()) {
      descend(node, lanes, enter);
    } else {
      if (lanes != 0) testLeaf(node, lanes, enter, found);
      do
        if (top_ == open_.data()) return false;
      while (!((--top_)->enter <= end_));
      node_ = top_->node;
    }
    __builtin_prefetch(&nodes_[node_]);
    __builtin_prefetch(nodes_[node_].below);
    return true;
  }

  /// Calls found(triangle, hit), as `step` does, for a whole walk.
  template <typename Found>
  void search(const fcl::Vector3d& origin, const fcl::Vector3d& direction, double begin, double end,
              Found&& found) {
    if (!start(origin, direction, begin, end)) return;
    while (step(found)) {
    }
  }
  /// Calls each(triangle) for all triangles whose boxes a ray may meet. `error`: of its origin.
  template <typename Each>
  void forEachNear(const fcl::Vector3d& origin, const fcl::Vector3d& direction, double error,
                   Each&& each) {
    if (!start(origin, direction, 0, std::numeric_limits<double>::infinity(), error)) return;
    while (step(each)) {
    }
  }

 private:
  /// A node to be visited, and where the ray enters its box.
  struct Open {
    std::int32_t node;
    float enter;
  };

  void setEnd(double t) { end_ = t < 0 ? -1.f : ray_.after(t); }

  /// Tests the triangles in `lanes`, unless `found` takes only a triangle (forEachNear).
  template <typename Found>
  [[gnu::noinline]] void testLeaf(const WideNode& leaf, unsigned lanes, const Float4& enter,
                                  Found&& found) {
    if constexpr (std::is_invocable<Found&, int>::value) {
      for (; lanes != 0; lanes &= lanes - 1)
        found(mesh_.tree.corners(static_cast<unsigned>(leaf.first + __builtin_ctz(lanes)))[3]);
      return;
    } else {
      testTriangles(leaf, lanes, enter, found);
    }
  }
  template <typename Found>
  void testTriangles(const WideNode& leaf, unsigned lanes, const Float4& enter, Found& found) {
    if (!test_) test_.emplace(origin_, direction_);  // here, as most rays without a hit need none
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto leaf_index = static_cast<unsigned>(leaf.first + __builtin_ctz(lanes));
      const Int4& v = mesh_.tree.corners(leaf_index);
      const fcl::Vector3d* const x = mesh_.vertices.data();
      RayTriangle::Hit hit;
      if (!test_->meets(x[v[0]], x[v[1]], x[v[2]], hit)) continue;
      setEnd(found(v[3], hit));
      // Drop boxes beyond the new end; the loop itself clears the lowest bit.
      lanes &= float4::bits(enter <= float4::all(end_)) | 1u << __builtin_ctz(lanes);
    }
  }

  /// Goes on to the nearest child and pushes the others onto the stack, in any order. Without a
  /// branch for the nearer of two children, as it would be mispredicted: nonnegative floats are
  /// ordered like their bits, and `swap` is lane ^ nearest if `lane` is nearer, else 0.
  ADAPTIVE_BVH_INLINE void descend(const WideNode& node, unsigned lanes, const Float4& enter) {
    alignas(16) std::int32_t key[4];
    __builtin_memcpy(key, &enter, sizeof(key));
    int nearest = __builtin_ctz(lanes);
    Open* top = top_;
    for (lanes &= lanes - 1; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const int swap = -static_cast<int>(key[lane] < key[nearest]) & (lane ^ nearest);
      nearest ^= swap;
      top->node = node.below[lane ^ swap];
      __builtin_memcpy(&top->enter, &key[lane ^ swap], sizeof(top->enter));
      ++top;
    }
    top_ = top;
    node_ = node.below[nearest];
  }

  const MeshState& mesh_;
  const WideNode* const nodes_;
  Scratch<Open> open_;
  Open* top_ = nullptr;
  std::int32_t node_ = 0;      ///< to be visited by the next step
  float begin_ = 0, end_ = 0;  ///< lengths along the ray (RayInTree)
  RayInTree ray_;
  fcl::Vector3d origin_, direction_ = fcl::Vector3d::Zero();
  std::optional<RayTriangle> test_;  ///< of the direction; created for the first triangle
};

/// Finds the triangles that many rays meet, by several walks in turn.
class RayBatch {
 public:
  explicit RayBatch(const MeshState& mesh) : slots_{mesh, mesh, mesh, mesh} {}

  /// Searches the rays [first, last). start(walk, i) starts ray i and returns the result of
  /// RayWalk::start; found(i, triangle, hit) is called as by RayWalk::step.
  template <typename Start, typename Found>
  void search(std::size_t first, std::size_t last, const Start& start, const Found& found) {
    const auto startNext = [&](Slot& slot) -> bool {
      while (first < last) {
        slot.ray = first++;
        if (start(slot.walk, slot.ray)) return true;
      }
      return false;
    };
    Slot* active[kAtOnce];
    int count = 0;
    for (Slot& slot : slots_)
      if (startNext(slot)) active[count++] = &slot;
    while (count > 0)
      for (int k = 0; k < count;) {
        Slot& slot = *active[k];
        const bool goes_on =
            slot.walk.step([&](int triangle, const RayTriangle::Hit& hit) -> double {
              return found(slot.ray, triangle, hit);
            });
        if (goes_on || startNext(slot))
          ++k;
        else
          active[k] = active[--count];
      }
  }

 private:
  static constexpr int kAtOnce = 4;

  /// A walk, and the number of its present ray.
  struct Slot {
    Slot(const MeshState& mesh) : walk(mesh) {}

    RayWalk walk;
    std::size_t ray = 0;
  };
  Slot slots_[kAtOnce];
};

}  // namespace adaptive_bvh
