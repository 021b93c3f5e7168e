#pragma once

#include <algorithm>

#include "base/frame_change.h"
#include "boxes/wide_tree.h"
#include "query/nearest/supports.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {

/// Lower bounds of the distances between nodes of two trees, by the gaps along a line and across
/// it. Each body is measured from its front, a plane across the line with the whole body
/// behind it. The distance of the fronts is known in double precision. So single precision is as
/// good for bodies far apart as for near ones: docs/bounds.md, 13.
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
    fcl::Matrix3d axes;  // as rows
    axes.row(0) = first.axes().transpose() * along;
    axes.row(1) = axes.row(0).transpose().unitOrthogonal();
    axes.row(2) = axes.row(0).cross(axes.row(1));
    const fcl::Matrix3d turn2 = axes * trees.frame().m();
    const fcl::Vector3d between =
        axes * (first.to_body * (trees.toFirst()(to) - from));  // `from` to `to`
    fcl::Vector3d t1 = -(axes * first(from)), t2 = between - turn2 * second(to);
    front1_ = extent1 * scale_;
    front2_ = extent2 * scale_;
    gap_ = between[0] - front1_ - front2_;
    t2[0] -= between[0];
    const double ratio = first.scale / second.scale, in_double = trees.frame().preciseError();
    change1_ = FrameChange(axes, t1, margin(1, t1) + in_double);
    change2_ = FrameChange(turn2, t2, margin(ratio, t2) + in_double);
    number1_ = number2_ = -1;
    base_ = std::max(gap_, 0.);
    unit_ = 1 / (1 + 2 * base_);
  }
  /// A lower bound of the distance of the two meshes.
  double gap() const { return gap_ / scale_; }
  /// Sets the distance with which bounds are compared. Its square stays in range.
  void setLimit(double distance) { limit_ = std::min(distance * scale_, 1e150); }
  /// Nodes nearer than the limit have smaller keys.
  float limitOfKeys() const {
    const double key = (limit_ - base_) * (limit_ + base_) * unit_;
    return static_cast<float>(std::clamp(key * (1 + 0x1p-20), -1e38, 1e38));
  }

  /// Returns which boxes of two nodes may hold triangles nearer than the limit: bit 4 j + i for box
  /// i of the first and j of the second. `keys`: lower bounds of their squared distances minus the
  /// squared distance of the fronts, in a unit of their own. `supports`: along the same line, or
  /// null.
  ADAPTIVE_BVH_INLINE unsigned near(int first, int second, const LineSeparation* supports,
                                    Gaps4x4& keys) {
    using float4::widenedXy;
    using float4::widenedZw;
    using D = Pack<double>;
    if (number1_ != first) turned1_ = change1_(nodes1_[first].boxes);
    if (number2_ != second) turned2_ = change2_(nodes2_[second].boxes);
    number1_ = first;
    number2_ = second;
    D behind1[2];
    double behind2[4];
    const D zero = packs::all(0.), front1 = packs::all(front1_), scale = packs::all(scale_);
    if (supports) {
      const double* const h1 = supports->extents1(first).of;
      const double* const h2 = supports->extents2(second).of;
      for (int i = 0; i < 2; ++i)
        behind1[i] = packs::upper(front1 - scale * packs::load(h1 + 2 * i), zero);
      for (int j = 0; j < 4; ++j) behind2[j] = std::max(front2_ - scale_ * h2[j], 0.);
    } else {
      behind1[0] = packs::upper(front1 - widenedXy(turned1_.high[0]), zero);
      behind1[1] = packs::upper(front1 - widenedZw(turned1_.high[0]), zero);
      for (int j = 0; j < 4; ++j) behind2[j] = std::max(front2_ + double(turned2_.low[0][j]), 0.);
    }
    const Gaps4x4 across = {
        {squaredAcross<0>(), squaredAcross<1>(), squaredAcross<2>(), squaredAcross<3>()}};
    const D base = packs::all(base_), limit = packs::all(limit_), rest = packs::all(limit_ - base_),
            overlap = packs::all(std::min(gap_, 0.)), less = packs::all(1 - 0x1p-20),
            unit = packs::all(unit_);
    unsigned bits = 0;
    for (int j = 0; j < 4; ++j) {
      const D other = overlap + packs::all(behind2[j]);
      D key[2];
      for (int i = 0; i < 2; ++i) {
        const D behind = packs::upper(behind1[i] + other, zero);  // beyond `base`
        const D square = less * (i == 0 ? widenedXy(across.row[j]) : widenedZw(across.row[j]));
        const D missing = rest - behind;
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

  /// Bound of the error of a turned box.
  static double margin(double ratio, const fcl::Vector3d& t) {
    return kUnit * (160 * ratio + 32 * t.template lpNorm<1>());
  }
  template <int kLane>
  ADAPTIVE_BVH_INLINE Float4 squaredAcross() const {
    using float4::broadcast;
    using float4::upper;
    Float4 sum = float4::all(0);
    for (int k = 1; k < 3; ++k) {
      const Float4 gap =
          upper<Float4>(upper<Float4>(turned1_.low[k] - broadcast<kLane>(turned2_.high[k]),
                                      broadcast<kLane>(turned2_.low[k]) - turned1_.high[k]),
                        float4::all(0));
      sum += gap * gap;
    }
    return sum;
  }

  const WideNode *nodes1_ = nullptr, *nodes2_ = nullptr;
  FrameChange change1_, change2_;
  double scale_ = 1, front1_ = 0, front2_ = 0, gap_ = 0, base_ = 0, unit_ = 1;
  double limit_ = 0;
  int number1_ = -1, number2_ = -1;  ///< nodes of turned1_ and turned2_
  Boxes4 turned1_, turned2_;
};

}  // namespace adaptive_bvh
