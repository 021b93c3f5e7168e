#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/frame_change.h"
#include "deformable/mesh_state.h"
#include "query/nearest/supports.h"

namespace adaptive_bvh {

/// Lower bounds of the distances from a mesh's nodes to a core beside the mesh: a query point, or a
/// box inside a shape. They combine gaps along a line and across it. Gaps along the line come from
/// supports in double precision, measured from the front: the plane across the line beyond which no
/// vertex lies. Gaps across it come from the nodes' boxes. The bounds cost a pass over the
/// vertices. They then separate nodes that boxes in single precision along the tree's axes do not:
/// parts of a face that is perpendicular to the line, and bodies far away. The coordinates of the
/// view are the tree's, rotated so that axis 0 is the line. docs/bounds.md, 16.
class LineToCore {
 public:
  /// A box in the mesh's frame: its centre, and half its edge vectors as columns, 0 for a point.
  struct Core {
    fcl::Vector3d middle;
    fcl::Matrix3d sides = fcl::Matrix3d::Zero();
  };

  /// Prepares bounds for the nodes that `near` reports. `along`: the direction of the line from the
  /// mesh to the core, of length 1, in the mesh's frame.
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
      low_[k] = float4::all(roundedOutward(middle[k] - half[k] - rounded, -1));
      high_[k] = float4::all(roundedOutward(middle[k] + half[k] + rounded, 1));
    }
  }

  /// Returns the keys of a node's boxes: lower bounds of their squared distances from the core,
  /// minus base_^2, times unit_. Keys have digits for the differences of nodes at any distance.
  ADAPTIVE_BVH_INLINE Float4 keys(const WideNode& node) const {
    const double* const extent = supports_[static_cast<int>(&node - nodes_)].lane;
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
  /// Returns a limit of keys, given the nearest point of the mesh so far: boxes that are not
  /// farther have keys up to it. For a core that is a point on a line from the tree's origin.
  float limitOf(const fcl::Vector3d& point) const {
    const fcl::Vector3d x = axes_ * (to_body_ * (point - origin_));
    const double behind = scale_ * front_ - x[0], square = x[1] * x[1] + x[2] * x[2];
    const double key = behind * (2 * base_ + scale_ * front_ - x[0]) + square;
    const double rounded = kPointError * (1 + scale_ * origin_.lpNorm<1>()) + kTies * base_;
    return roundedUp(std::max(key * unit_, 0.) + rounded);
  }
  /// Returns a limit of keys, given a distance in the mesh's unit: nearer boxes have smaller keys.
  float limitOf(double distance) const {
    const double limit = std::min(distance * scale_, 1e150);  // its square stays finite
    return roundedUp((limit - base_) * (limit + base_) * unit_);
  }

 private:
  /// Returns the key ((base + behind)^2 + square - base^2) unit for contents that are `behind` the
  /// front and have the squared gap `square` across the line. D: a number or pack of double.
  template <typename D>
  ADAPTIVE_BVH_INLINE D keyOf(const D& behind, const D& square) const {
    return (behind * (packs::all(2 * base_) + behind) + square * packs::all(1 - 0x1p-20)) *
           packs::all(unit_);
  }
  static float roundedUp(double key) {
    return static_cast<float>(std::clamp(key * (1 + 0x1p-20), -1e38, 1e38));
  }
  /// Rounds a coordinate up (`sign` 1) or down (-1), and clamps it far outside of the body.
  static float roundedOutward(double x, double sign) {
    constexpr double kMost = 1e18;
    return static_cast<float>(std::clamp(x + sign * 0x1p-22 * std::abs(x), -kMost, kMost));
  }

  static constexpr double kMargin = 160. / (1 << 24);  // error of a box that is rotated to the view
  static constexpr double kRounding = 0x1p-50;         // of the core's coordinates, relative
  static constexpr double kPointError = 0x1p-46;       // of two points of the mesh, along the line
  static constexpr double kTies = 0x1p-78;             // more than PreciseSquare treats as a tie

  const WideNode* nodes_ = nullptr;
  fcl::Matrix3d to_body_, axes_;  ///< WideTree::toBody; the view's axes as rows, in the tree
  fcl::Vector3d origin_;
  double scale_ = 1;
  double front_ = 0;  ///< position of the front along the line, in the mesh's unit
  double base_ = 0;   ///< distance of the core from the front, in the tree's unit; at least 0
  double unit_ = 1;   ///< factor of keys: makes them about as large as the body
  Supports supports_;
  FrameChange change_;       ///< rotates boxes of the tree to the view
  Float4 low_[3], high_[3];  ///< the core's bounding box in the view
};

}  // namespace adaptive_bvh
