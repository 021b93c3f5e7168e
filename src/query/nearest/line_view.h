#pragma once

#include <algorithm>

#include "base/frame_change.h"
#include "boxes/wide_tree.h"
#include "query/nearest/supports.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {

/// Lower bounds of the distances between nodes of two trees, by gaps along a line and across it.
/// Each body is measured from its front: a plane across the line with the whole body behind it. The
/// distance of the fronts is known in double precision, so single precision suffices for the boxes
/// of bodies far apart. The view's coordinates have axis 0 along the line, where each body has its
/// own origin, `from` or `to`, and the first tree's unit. docs/bounds.md, 18.
class LineView {
 public:
  /// `along`: direction from the first mesh to the second, of length 1, in the first mesh's frame.
  /// `from`, `to`: a point of each mesh in its own frame. `extent1`, `extent2`: upper bounds of how
  /// far the meshes extend from these points toward each other. Requires RelativeFrame::isInRange.
  void set(const TreePair& trees, const fcl::Vector3d& along, const fcl::Vector3d& from,
           const fcl::Vector3d& to, double extent1, double extent2) {
    const BodyCoordinates &first = trees.first().coordinates(),
                          &second = trees.second().coordinates();
    nodes1_ = trees.first().nodes();
    nodes2_ = trees.second().nodes();
    scale_ = first.scale;
    fcl::Matrix3d axes;  // those of the view as rows, in the first tree's coordinates
    axes.row(0) = first.axes().transpose() * along;
    axes.row(1) = axes.row(0).transpose().unitOrthogonal();
    axes.row(2) = axes.row(0).cross(axes.row(1));
    const fcl::Matrix3d turn2 = axes * trees.frame().m();
    const fcl::Vector3d between =
        axes * (first.to_body * (trees.toFirst()(to) - from));  // from `from` to `to`
    fcl::Vector3d t1 = -(axes * first(from)), t2 = between - turn2 * second(to);
    front1_ = extent1 * scale_;
    front2_ = extent2 * scale_;
    gap_ = between[0] - front1_ - front2_;
    t2[0] -= between[0];  // along the line, the second body's origin is `to`; across it, `from`
    const double ratio = first.scale / second.scale, in_double = trees.frame().preciseError();
    change1_ = FrameChange(axes, t1, margin(1, t1) + in_double);
    change2_ = FrameChange(turn2, t2, margin(ratio, t2) + in_double);
    node1_ = node2_ = -1;
    base_ = std::max(gap_, 0.);
    unit_ = 1 / (1 + 2 * base_);
  }
  /// A lower bound of the distance of the two meshes, in their unit; may be negative.
  double gap() const { return gap_ / scale_; }
  /// Sets the limit, in the meshes' unit.
  void setLimit(double distance) { limit_ = std::min(distance * scale_, 1e150); }  // finite square
  /// Returns the limit for keys: boxes nearer than the limit have smaller keys.
  float limitOfKeys() const {
    const double key = (limit_ - base_) * (limit_ + base_) * unit_;
    return static_cast<float>(std::clamp(key * (1 + 0x1p-20), -1e38, 1e38));
  }

  /// Returns which boxes of two nodes may hold triangles nearer than the limit: bit 4 j + i for box
  /// i of the first and j of the second. Sets `keys` to lower bounds of their squared distances,
  /// minus base_^2, times unit_: so rounding hides little. `supports`: of this line, or null.
  ADAPTIVE_BVH_INLINE unsigned near(int first, int second, const LineSeparation* supports,
                                    Gaps4x4& keys) {
    using float4::widenedXy;
    using float4::widenedZw;
    using D = Pack<double>;
    if (node1_ != first) boxes1_ = change1_(nodes1_[first].boxes);
    if (node2_ != second) boxes2_ = change2_(nodes2_[second].boxes);
    node1_ = first;
    node2_ = second;
    D behind1[2];       // how far the boxes 0 and 1, and 2 and 3, are behind the first front
    double behind2[4];  // likewise, of the second node
    const D zero = packs::all(0.), front1 = packs::all(front1_), scale = packs::all(scale_);
    if (supports) {
      const double* const extent1 = supports->extents1(first).lane;
      const double* const extent2 = supports->extents2(second).lane;
      for (int i = 0; i < 2; ++i)
        behind1[i] = packs::upper(front1 - scale * packs::load(extent1 + 2 * i), zero);
      for (int j = 0; j < 4; ++j) behind2[j] = std::max(front2_ - scale_ * extent2[j], 0.);
    } else {
      behind1[0] = packs::upper(front1 - widenedXy(boxes1_.high[0]), zero);
      behind1[1] = packs::upper(front1 - widenedZw(boxes1_.high[0]), zero);
      for (int j = 0; j < 4; ++j) behind2[j] = std::max(front2_ + double(boxes2_.low[0][j]), 0.);
    }
    const Gaps4x4 across = {
        {squaredAcross<0>(), squaredAcross<1>(), squaredAcross<2>(), squaredAcross<3>()}};
    // The distance along the line is base + behind. Near are boxes with (base + behind)^2 + square
    // < limit^2, that is square < (limit - base - behind) (limit + base + behind).
    const D base = packs::all(base_), limit = packs::all(limit_), room = packs::all(limit_ - base_),
            overlap = packs::all(std::min(gap_, 0.)), less = packs::all(1 - 0x1p-20),
            unit = packs::all(unit_);
    unsigned bits = 0;
    for (int j = 0; j < 4; ++j) {
      const D other = overlap + packs::all(behind2[j]);
      D key[2];
      for (int i = 0; i < 2; ++i) {
        const D behind = packs::upper(behind1[i] + other, zero);
        const D square = less * (i == 0 ? widenedXy(across.row[j]) : widenedZw(across.row[j]));
        const D missing = room - behind;  // what the distance along the line lacks of the limit
        const auto is_near = (missing > zero) & (square < missing * (limit + limit - missing));
        bits |= unsigned(packs::bitsOf2(is_near)) << (4 * j + 2 * i);
        key[i] = (behind * (base + base + behind) + square) * unit;
      }
      keys.row[j] = float4::narrowed(key[0], key[1]);
    }
    return bits;
  }

 private:
  static constexpr double kUnit = 1. / (1 << 24);

  /// Bound of the error of a box that is mapped to the view. `ratio`: of scales; `t`: translation.
  static double margin(double ratio, const fcl::Vector3d& t) {
    return kUnit * (160 * ratio + 32 * t.lpNorm<1>());
  }
  /// The squared gaps across the line, of the first node's boxes and box kLane of the second.
  template <int kLane>
  ADAPTIVE_BVH_INLINE Float4 squaredAcross() const {
    using float4::broadcast;
    using float4::upper;
    Float4 sum = float4::all(0);
    for (int k = 1; k < 3; ++k) {
      const Float4 gap =
          upper<Float4>(upper<Float4>(boxes1_.low[k] - broadcast<kLane>(boxes2_.high[k]),
                                      broadcast<kLane>(boxes2_.low[k]) - boxes1_.high[k]),
                        float4::all(0));
      sum += gap * gap;
    }
    return sum;
  }

  const WideNode *nodes1_ = nullptr, *nodes2_ = nullptr;
  FrameChange change1_, change2_;  ///< map boxes of each tree to the view
  // Lengths are in the first tree's unit, which is the meshes' times scale_.
  double scale_ = 1;
  double front1_ = 0, front2_ = 0;  ///< distances of the fronts from the origins, toward each other
  double gap_ = 0, base_ = 0;       ///< signed distance of the fronts; the same, at least 0
  double unit_ = 1;                 ///< factor of keys: makes them about as large as the bodies
  double limit_ = 0;
  int node1_ = -1, node2_ = -1;  ///< the nodes of boxes1_ and boxes2_
  Boxes4 boxes1_, boxes2_;       ///< boxes of two nodes in the view
};

}  // namespace adaptive_bvh
