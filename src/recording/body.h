#pragma once

#include <memory>
#include <vector>

#include <fcl/geometry/collision_geometry.h>

#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/recording.h"
#include "page.h"

namespace adaptive_bvh {

/// What a page says about a bounding volume: all points within `radius` of a rectangle, or a box
/// that is `radius` thick on both sides of a rectangle.
struct VolumeRecord {
  float corner[3];   ///< of the rectangle, less PointBlock::low of the body's positions
  float axis[2][3];  ///< of length 1, along its sides
  float side[2];
  float radius;
  /// Radius less that of the last refit, as a share of the volume's size
  /// (InflationReference::NodeSize).
  float inflation;
  float depth;     ///< in the tree; 0 is the root. Of deeper refits: VolumeChoice::depth + 1
  float leaf;      ///< 1 for a leaf
  float refitted;  ///< 1 where the last update recomputed it
};

/// Which volumes of a tree are recorded.
struct VolumeChoice {
  int depth;          ///< all down to this one
  bool refits;        ///< those of the last update are marked
  int deeper_refits;  ///< at most so many of the refitted ones below that depth
};

/// What a frame reads of a body: a mesh or a model (body.cpp).
class BodySource {
 public:
  virtual ~BodySource() = default;

  virtual int vertexCount() const = 0;
  virtual int triangleCount() const = 0;
  virtual std::vector<std::uint32_t> corners() const = 0;  ///< three a triangle
  virtual PointBlock appendPositions(Blob& blob) const = 0;

  /// "none", "swept rectangle" or "box".
  virtual const char* volumeKind() const = 0;
  /// Parents first, then the deeper refits.
  virtual std::vector<VolumeRecord> volumes(const VolumeChoice& choice,
                                            const fcl::Vector3d& low) const = 0;
  /// Of a DeformableMesh: only its displacement and how long it took.
  virtual UpdateReport lastUpdate() const = 0;
  virtual bool isUnbounded() const = 0;  ///< a plane: the page chooses the size of its square
  virtual bool isFixed() const = 0;      ///< its positions never change
};

/// Whether `shape` is a plane or a half-space.
template <typename S>
bool isUnbounded(const fcl::CollisionGeometry<S>& shape) {
  return shape.getNodeType() == fcl::GEOM_PLANE || shape.getNodeType() == fcl::GEOM_HALFSPACE;
}

/// A DeformableMesh by reference; a shape or octree as a copy of its surface.
template <typename S>
std::unique_ptr<BodySource> sourceOf(const fcl::CollisionGeometry<S>& geometry);

}  // namespace adaptive_bvh
