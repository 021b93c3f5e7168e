#pragma once

#include <cstdint>
#include <vector>

#include "base/frame_change.h"
#include "boxes/wide_tree.h"
#include "ccd/moving_body.h"

namespace adaptive_bvh {

/// The unit roundoff of single precision.
constexpr double kFloatUnit = 1. / (1 << 24);

/// The boxes of a node at both ends of a part of the motion. In between, its triangles are inside
/// of the boxes that are interpolated linearly, up to MovingBody::arc: vertices move on straight
/// lines, and so do the sides. Refers to MovingBoxes.
struct MovingNode {
  const Boxes4* at[2];
};

/// The boxes of all nodes of a body's tree at both ends of a part of its motion, along the axes of
/// the world, in single precision, relative to a point that moves with the body. A shape has one
/// leaf with one box. docs/bounds.md, 22.
class MovingBoxes {
 public:
  /// `scale`: a power of two, by which coordinates are multiplied. The boxes of a mesh that deforms
  /// are computed here; those of others where they are read: of inner nodes those of the mesh's
  /// tree, turned; of leaves from the vertices. Refers to the body.
  void assign(const MovingBody& body, double scale, double begin, double end);

  /// Links of the nodes; their boxes are not those of the motion.
  const WideNode* links() const { return links_; }
  MovingNode operator[](int node) {
    const auto i = static_cast<std::size_t>(node);
    if (is_lazy_ && made_[i] != epoch_) make(i);
    return {{&nodes_[0][i].boxes, &nodes_[1][i].boxes}};
  }
  int depth() const { return depth_; }
  /// The point at the begin or the end, in the world.
  const fcl::Vector3d& origin(int end) const { return origins_[end]; }
  /// Upper bound of the coordinates of boxes.
  double size() const { return size_; }

 private:
  void make(std::size_t node);
  void assignUndeformed();
  void assignDeformed();
  void assignSolid();
  Float4 positionOf(std::size_t vertex, std::size_t end) const;

  const MovingBody* body_ = nullptr;
  MovingBody::At ends_[2];
  double scale_ = 1;
  const WideNode* links_ = nullptr;
  std::vector<WideNode> nodes_[2];   ///< at both ends; links only of a mesh that deforms
  std::vector<std::uint32_t> made_;  ///< the epoch in which each node was made
  std::uint32_t epoch_ = 0;
  bool is_lazy_ = false;
  FrameChange changes_[2];         ///< from the mesh's tree
  std::vector<Float4> positions_;  ///< of a mesh that deforms, at one end, by vertex
  Float4 margin_ = float4::all(0);
  fcl::Vector3d origins_[2];
  double size_ = 0;
  int depth_ = 1;
  WideNode single_;  ///< the links of a shape
};

}  // namespace adaptive_bvh
