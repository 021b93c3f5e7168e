#pragma once

#include <memory>
#include <vector>

#include <fcl/geometry/collision_geometry.h>

#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/recording.h"
#include "page.h"

// What a recording reads of a body in each frame (BodySource): positions and bounding volumes.
namespace adaptive_bvh {

/// A bounding volume as the page reads it: all points within `radius` of a rectangle, or a box that
/// extends by `radius` on both sides of a rectangle. In the body's frame.
struct VolumeRecord {
  float corner[3];   ///< first corner of the rectangle, minus PointBlock::low of the body's
                     ///< positions
  float axis[2][3];  ///< unit vectors along its sides
  float side[2];     ///< lengths of its sides
  float radius;
  /// The increase of the radius since the last refit, as a share of the volume's size
  /// (InflationReference::NodeSize).
  float inflation;
  float depth;     ///< depth in the tree, 0 for the root; VolumeChoice::depth + 1 if it is deeper
  float leaf;      ///< 1 for a leaf
  float refitted;  ///< 1 if the last update recomputed it
};

/// Which volumes of a tree are recorded.
struct VolumeChoice {
  int depth;          ///< all nodes down to this depth
  bool refits;        ///< whether to mark nodes that the last update refitted
  int deeper_refits;  ///< at most this number of refitted nodes below that depth
};

/// A body whose data are recorded: a mesh, a model, or the surface of other geometry.
class BodySource {
 public:
  virtual ~BodySource() = default;

  virtual int vertexCount() const = 0;
  virtual int triangleCount() const = 0;
  virtual std::vector<std::uint32_t> corners() const = 0;  ///< three vertices per triangle
  /// Appends the current positions of all vertices, in the body's frame.
  virtual PointBlock appendPositions(Blob& blob) const = 0;

  /// The kind of its volumes: "none", "swept rectangle" or "box".
  virtual const char* volumeKind() const = 0;
  /// The chosen volumes, parents first, then deeper refits. `low`: see PointBlock.
  virtual std::vector<VolumeRecord> volumes(const VolumeChoice& choice,
                                            const fcl::Vector3d& low) const = 0;
  /// The last update's report; for a DeformableMesh only its displacement and duration.
  virtual UpdateReport lastUpdate() const = 0;
  /// Whether it is a plane or half-space, of which the page draws a square of its own size.
  virtual bool isUnbounded() const = 0;
  virtual bool isFixed() const = 0;  ///< whether its positions never change
};

/// Whether `shape` is a plane or a half-space.
inline bool isUnbounded(const fcl::CollisionGeometryd& shape) {
  return shape.getNodeType() == fcl::GEOM_PLANE || shape.getNodeType() == fcl::GEOM_HALFSPACE;
}

/// Makes a source that keeps a reference to a DeformableMesh, or a copy of the surface of a shape
/// or octree.
std::unique_ptr<BodySource> sourceOf(const fcl::CollisionGeometryd& geometry);

}  // namespace adaptive_bvh
