#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/frame_change.h"
#include "deformable/mesh_state.h"
#include "query/nearest/supports.h"

namespace adaptive_bvh {

/// Lower bounds of the distances from a mesh's nodes to a point or box beside the mesh, the core.
/// They combine the gaps along a line and across it. Gaps along the line come from supports in
/// double precision, measured from the front, the plane beyond which no vertex lies. Gaps across it
/// come from the nodes' boxes. The bounds cost a pass over the vertices. They then separate nodes
/// that boxes in single precision along the tree's axes do not: the parts of a face across the
/// line, and bodies far away. docs/bounds.md, 16.
class LineToCore {
 public:
  /// A box: its centre, and half its edges as columns, in the mesh's frame.
  struct Core {
    fcl::Vector3d middle;
    fcl::Matrix3d sides = fcl::Matrix3d::Zero();
  };

  /// Prepares bounds for the part of the tree that `near` reports. `along`: direction of the line
  /// from the mesh to the core, of length 1, in the mesh's frame.
  void look(const MeshState& mesh, const NearLanes& near, const Core& core,
            const fcl::Vector3d& along) {
    const WideTree& tree = mesh.tree;
    nodes_ = tree.nodes();
    to_body_ = tree.toBody();
    origin_ = tree.origin();
    scale_ = tree.scale();
    supports_.setPart(tree, near);
    supports_.compute(tree, mesh.vertices.data(), origin_, along);
    axes_.row(0) = (to_body_ * along / scale_).transpose();
    axes_.row(1) = axes_.row(0).transpose().unitOrthogonal();
    axes_.row(2) = axes_.row(0).cross(axes_.row(1));
    change_ = FrameChange(axes_, fcl::Vector3d::Zero(), kMargin);
    front_ = supports_.largest();
    const fcl::Vector3d middle = axes_ * (to_body_ * (core.middle - origin_)),
                        half = (axes_ * to_body_ * core.sides).cwiseAbs().rowwise().sum();
    const double rounded = kRounding * (middle.lpNorm<1>() + half.lpNorm<1>());
    base_ = std::max(middle[0] - half[0] - scale_ * front_ - rounded, 0.);
    unit_ = 1 / (1 + 2 * base_);
    for (int k = 0; k < 3; ++k) {
      low_[k] = float4::all(ended(middle[k] - half[k] - rounded, -1));
      high_[k] = float4::all(ended(middle[k] + half[k] + rounded, 1));
    }
  }

  /// Returns keys of a node's boxes: lower bounds of their squared distances minus the squared
  /// distance of the front, in a unit of their own.
  ADAPTIVE_BVH_INLINE Float4 keys(const WideNode& node) const {
    const double* const extent = supports_[static_cast<int>(&node - nodes_)].of;
    const Boxes4 turned = change_(node.boxes);
    Float4 across = float4::all(0);
    for (int k = 1; k < 3; ++k) {
      using float4::upper;
      const Float4 gap = upper<Float4>(
          upper<Float4>(turned.low[k] - high_[k], low_[k] - turned.high[k]), float4::all(0));
      across += gap * gap;
    }
    const Pack<double> squares[] = {float4::widenedXy(across), float4::widenedZw(across)};
    Pack<double> key[2];
    for (int i = 0; i < 2; ++i)
      key[i] = keyOf(packs::all(scale_) * (packs::all(front_) - packs::load(extent + 2 * i)),
                     squares[i]);
    return float4::narrowed(key[0], key[1]);
  }
  /// Limit by a point of the mesh, for a core without sides: boxes at most as far away as the point
  /// have keys up to this limit.
  float limitOf(const fcl::Vector3d& point) const {
    const fcl::Vector3d seen = axes_ * (to_body_ * (point - origin_));
    const double square = seen[1] * seen[1] + seen[2] * seen[2];
    const double key =
        (scale_ * front_ - seen[0]) * (2 * base_ + scale_ * front_ - seen[0]) + square;
    const double rounded = kSeen * (1 + scale_ * origin_.lpNorm<1>()) + kTies * base_;
    return roundedUp(std::max(key * unit_, 0.) + rounded);
  }
  /// Limit by a distance: boxes nearer than that have smaller keys.
  float limitOf(double distance) const {
    const double limit = std::min(distance * scale_, 1e150);
    return roundedUp((limit - base_) * (limit + base_) * unit_);
  }

 private:
  template <typename D>
  ADAPTIVE_BVH_INLINE D keyOf(const D& behind, const D& square) const {
    return (behind * (packs::all(2 * base_) + behind) + square * packs::all(1 - 0x1p-20)) *
           packs::all(unit_);
  }
  static float roundedUp(double key) {
    return static_cast<float>(std::clamp(key * (1 + 0x1p-20), -1e38, 1e38));
  }
  /// Rounds a coordinate outward. Far beyond the body, a clamped value is as good as infinity.
  static float ended(double x, double outward) {
    constexpr double kMost = 1e18;
    return static_cast<float>(std::clamp(x + outward * 0x1p-22 * std::abs(x), -kMost, kMost));
  }

  static constexpr double kMargin = 160. / (1 << 24);  // margin of a turned box
  static constexpr double kRounding = 0x1p-50;
  static constexpr double kSeen = 0x1p-46;  // error of two points, along the line
  static constexpr double kTies = 0x1p-78;  // more than PreciseSquare treats as a tie

  const WideNode* nodes_ = nullptr;
  fcl::Matrix3d to_body_, axes_;
  fcl::Vector3d origin_;
  double scale_ = 1, front_ = 0, base_ = 0, unit_ = 1;
  Supports supports_;
  FrameChange change_;
  Float4 low_[3], high_[3];  ///< of the core
};

}  // namespace adaptive_bvh
