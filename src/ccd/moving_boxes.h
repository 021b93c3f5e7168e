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
/// lines, and so do the sides.
struct MovingNode {
  Boxes4 at[2];
};

/// The boxes of a body's nodes at both ends of a part of its motion, along the axes of the world,
/// in single precision, relative to a point that moves with the body. A shape has one leaf with one
/// box. The boxes of a mesh are computed where they are read. docs/bounds.md, 22.
class MovingBoxes {
 public:
  /// `scale`: a power of two, by which coordinates are multiplied. Refers to the body.
  void assign(const MovingBody& body, double scale, double begin, double end);

  /// Links of the nodes; their boxes are not those of the motion.
  const WideNode* links() const { return links_; }
  const MovingNode& operator[](int node) {
    if (!isMade(node)) make(node);
    return nodes_[static_cast<std::size_t>(node)].boxes;
  }
  int depth() const { return depth_; }
  /// The point at the begin or the end, in the world.
  const fcl::Vector3d& origin(int end) const { return origins_[end]; }
  /// Upper bound of the coordinates of boxes.
  double size() const { return size_; }

 private:
  /// What was computed, and the epoch in which it was.
  struct Node {
    MovingNode boxes;
    std::uint32_t epoch = 0;
  };
  struct Vertex {
    Float4 at[2];  ///< positions at both ends
    std::uint32_t epoch = 0;
  };

  bool isMade(int node) const { return nodes_[static_cast<std::size_t>(node)].epoch == epoch_; }
  void make(int node);
  bool isCoarse(const WideNode& links) const;
  void makeBelow(int node);
  void makeLeaf(const WideNode& leaf, MovingNode& node);
  const Float4* positionsOf(int vertex);
  void assignMesh();
  void assignSolid();

  const MovingBody* body_ = nullptr;
  MovingBody::At ends_[2];
  double scale_ = 1;
  const WideNode* links_ = nullptr;
  std::vector<Node> nodes_;
  std::vector<Vertex> vertices_;
  std::uint32_t epoch_ = 0;
  FrameChange changes_[2];  ///< from the boxes of the mesh's tree
  float least_side_ = 0;    ///< smaller boxes of the mesh's tree are not taken
  Float4 margin_ = float4::all(0);
  fcl::Vector3d origins_[2];
  double size_ = 0;
  int depth_ = 1;
  WideNode single_;  ///< the links of a shape
};

}  // namespace adaptive_bvh
