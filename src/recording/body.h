#pragma once

#include <memory>
#include <string>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh.h"
#include "blob.h"

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

enum class VolumeKind { None, SweptRectangle, Box };

/// What a frame reads of a body.
class BodySource {
 public:
  virtual ~BodySource() = default;

  virtual int vertices() const = 0;
  virtual std::vector<std::uint32_t> triangles() const = 0;  ///< three indices each
  virtual int triangleCount() const = 0;
  virtual VolumeKind volumeKind() const = 0;

  virtual PointBlock appendPositions(Blob& blob) const = 0;
  /// Parents first, then the deeper refits.
  virtual void readVolumes(const VolumeChoice& choice, const fcl::Vector3d& low,
                           std::vector<VolumeRecord>& out) const = 0;
  /// Of a DeformableMesh without nodes: only its displacement and how long it took.
  virtual UpdateReport lastUpdate() const = 0;
};

/// Reads a model, which is kept by reference.
template <typename BV>
std::unique_ptr<BodySource> sourceOf(const AdaptiveBVHModel<BV>& model);

/// Reads a mesh, which is kept by reference.
template <typename S>
std::unique_ptr<BodySource> sourceOf(const DeformableMesh<S>& mesh);

/// A copy of the mesh.
std::unique_ptr<BodySource> sourceOf(const TriangleMesh<double>& mesh);

}  // namespace adaptive_bvh
