#pragma once

#include <algorithm>
#include <vector>

#include "base/box.h"
#include "boxes/feature_leaves.h"

namespace adaptive_bvh {

/// A mesh whose vertices move on straight lines in the world, as a query reads it. Owns nothing.
struct MovingMesh {
  const WideNode* nodes;  ///< links only; boxes are not read
  const Int4* vertices;   ///< vertices and index of each triangle, by leaf index
  const VertexSlots* slots;
  const FeatureOwners* owners;
  const FeatureLeaves* features;     ///< the features that the leaves' triangles own
  const fcl::Vector3d *start, *end;  ///< by vertex
  const fcl::Triangle* triangles;    ///< by index
  unsigned num_vertices, num_triangles;
  int num_nodes, depth;  ///< of the tree
  double error;          ///< bound of the error of a position
  double
      between_error;  ///< of one that the caller computes between start and end, but for rounding
};

/// The coordinates of swept boxes: y = scale (x - origin), along the axes of the world. The scale
/// is a power of two that brings the largest coordinate to between 1 and 2.
struct SweptFrame {
  fcl::Vector3d origin;
  double scale;

  /// A frame for the positions at the start and the end of one or two meshes.
  explicit SweptFrame(const MovingMesh& first, const MovingMesh& second);
  /// A frame for positions between two corners of a box.
  SweptFrame(const fcl::Vector3d& low, const fcl::Vector3d& high);

  ADAPTIVE_BVH_INLINE Float4 operator()(const fcl::Vector3d& x) const {
    const fcl::Vector3d y = scale * (x - origin);
    return Float4{static_cast<float>(y[0]), static_cast<float>(y[1]), static_cast<float>(y[2]), 0};
  }
  /// A length of the world in these coordinates, rounded up; at least 0.
  float lengthUp(double length) const {
    constexpr double kLargest = 1e20;  // boxes of this size overlap all others
    return static_cast<float>(std::min(scale * length, kLargest)) * (1 + 1.f / (1 << 20));
  }
};

/// A part of the motion, which lasts from 0 to 1.
struct TimeInterval {
  double begin = 0, end = 1;
};

/// A four-wide tree of swept volumes: boxes in single precision around the motion of triangles in
/// an interval. If boxes of two meshes do not overlap, their triangles stay farther apart than the
/// separation: docs/bounds.md, 15.
class SweptTree {
 public:
  /// Bound of the rounding error of a coordinate in the frame.
  static constexpr float kPositionError = 1.f / (1 << 22);

  /// Computes all boxes, padded by `padding`, in the unit of the world.
  void refit(const MovingMesh& mesh, const SweptFrame& frame, const TimeInterval& interval,
             double padding);
  /// Computes boxes around all points within min(radii[vertex], most) of the vertices' starts.
  void refitAroundStarts(const MovingMesh& mesh, const SweptFrame& frame, double padding,
                         const std::vector<double>& radii, double most);
  /// Computes boxes around the motion of each vertex over its share of its way, or over a length of
  /// `most` if that is less.
  void refitOverShares(const MovingMesh& mesh, const SweptFrame& frame, double padding,
                       const std::vector<double>& shares, double most);

  const WideNode* nodes() const { return nodes_.data(); }

  /// Swept boxes of a group's features (FeatureLeaves). Lanes without a feature are empty.
  const Boxes4& vertexBoxes(unsigned group) const { return vertex_boxes_[group]; }
  const Boxes4& edgeBoxes(unsigned group) const { return edge_boxes_[group]; }
  /// The features of a node that is a leaf.
  static const FeatureLeaves::Leaf& leaf(const MovingMesh& mesh, const WideNode& node) {
    return mesh.features->leaves()[static_cast<std::size_t>(node.leaf)];
  }

  /// Positions at the beginning and the end of the interval, by slot.
  const Float4* begins() const { return begins_.data(); }
  const Float4* ends() const { return ends_.data(); }
  /// Bound of the error of these coordinates.
  float positionError() const { return position_error_; }

 private:
  template <typename Set>
  void refit(const MovingMesh& mesh, const SweptFrame& frame, double padding, double error,
             const Set& set);
  void resize(const MovingMesh& mesh);
  void setSlot(std::size_t slot, const Float4& begin, const Float4& end, float radius = 0);
  void refitNodes(const MovingMesh& mesh);

  void refitFeatures(const MovingMesh& mesh, const FeatureLeaves::Leaf& leaf);

  std::vector<WideNode> nodes_;
  std::vector<Box> boxes_;                         ///< swept boxes of vertices, by slot
  std::vector<Boxes4> vertex_boxes_, edge_boxes_;  ///< by group (FeatureLeaves)
  std::vector<Float4> begins_, ends_;              ///< positions by slot
  Float4 margin_;                                  ///< by which boxes of vertices are enlarged
  float position_error_ = kPositionError;
};

}  // namespace adaptive_bvh
