#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

/// \file
/// Nearness of two meshes, or of one with itself, within a distance d (point_query.h has points and
/// rays). Every answer is the one that a test of all pairs of triangles would give for the present
/// positions.
///
/// **Rounding.** Whether a pair of meshes, triangles or features is at most d apart is decided
/// without any error, for d and for the second's corners as rounded in the frame of the first:
/// pairs exactly at d are included. Distances are off by less than 2^-44 (6e-14) of the largest
/// coordinate of the meshes, in the frame of the first; `pairsWithin` reports none above d. The
/// distance is 0 if and only if the triangles have a common point.
///
/// **Frames and units.** `tf1` and `tf2` place the meshes in the world; lengths are in the meshes'
/// unit. Queries read the present state of a deforming mesh; nothing is rebuilt.
///
/// **Errors.** std::invalid_argument if a distance is negative or NaN (infinity is allowed), if a
/// transform is not a rigid motion, or if the pairs to leave out are not as Ignored says.
/// The result is then unchanged. After std::bad_alloc it is valid, with unspecified contents.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query of pairs runs on several threads
/// if DeformableMesh::setThreads allows it; its result does not depend on their number.

/// Whether the distance of two meshes is at most `distance`. Much cheaper than computing the
/// distance: it stops at the first pair of triangles that is near enough, and visits no nodes that
/// are farther apart. With `solid`, meshes are filled: the result is also true if a component of
/// one is inside of the other, however far from its surface. Then both meshes must be closed;
/// otherwise throws std::invalid_argument, which names an open edge.
bool isNearer(const DeformableMesh& first, const fcl::Transform3d& tf1,
              const DeformableMesh& second, const fcl::Transform3d& tf2, double distance,
              bool solid = false);

/// Whether a shape of FCL's is at most `distance` away from a mesh, or touches it: a sphere,
/// capsule, box, cylinder, cone, ellipsoid, convex, plane or half-space. std::invalid_argument on
/// other geometry. A mesh inside of a shape touches it. With `solid`, so does a shape inside of the
/// mesh, which must be closed.
bool isNearer(const DeformableMesh& mesh, const fcl::Transform3d& tf1,
              const fcl::CollisionGeometryd& shape, const fcl::Transform3d& tf2, double distance,
              bool solid = false);

/// `isNearer` for one pair of meshes, called step after step. Keeps a lower bound of their
/// distance. There is no search while this bound, less the motion since, exceeds d. While the
/// bodies stay near, it mostly suffices to test the triangles around the last near pair. Any number
/// of updates may come between two calls. One object serves one thread at a time; several may share
/// a mesh. A call that throws std::bad_alloc can be repeated.
class CoherentProximity {
 public:
  /// Keeps references: the meshes must outlive this object.
  CoherentProximity(const DeformableMesh& first, const DeformableMesh& second);
  ~CoherentProximity();
  /// The moved-from object can only be destroyed.
  CoherentProximity(CoherentProximity&&) noexcept;
  CoherentProximity(const CoherentProximity&) = delete;
  CoherentProximity& operator=(const CoherentProximity&) = delete;

  /// Whether the distance of the meshes is at most `distance`, which may differ from call to call.
  bool isNearer(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2, double distance);

  /// The number of calls so far that had to search.
  std::size_t searches() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Request of pairsWithin.
struct ProximityRequest {
  double distance = 0;                 ///< largest distance of a pair
  bool enable_distances = false;       ///< also their distances
  bool enable_nearest_points = false;  ///< also their nearest points
  Ignored ignored = {};                ///< pairs to leave out
};

/// Pairs of triangles, in parallel arrays. A reused result allocates nothing once it has grown
/// large enough.
struct TrianglePairs {
  /// Triangle of the first mesh, and of the second; within one mesh the smaller index first.
  std::vector<FeaturePair> triangles;
  /// Distance of each pair, 0 if the triangles touch. Empty without `enable_distances`.
  std::vector<double> distances;
  /// For each pair a nearest point on the first and on the second triangle, in the world. If they
  /// touch, both are a common point, up to rounding. Empty without `enable_nearest_points`.
  std::vector<std::array<fcl::Vector3d, 2>> nearest_points;

  /// How many pairs.
  std::size_t size() const { return triangles.size(); }
  /// Keeps the memory.
  void clear() {
    triangles.clear();
    distances.clear();
    nearest_points.clear();
  }
};

/// All pairs of a triangle of the first mesh and one of the second whose distance is at most
/// `request.distance`. `result` is overwritten. The order is that of the trees: two pairs keep
/// their order from step to step. Returns the number of pairs.
std::size_t pairsWithin(const DeformableMesh& first, const fcl::Transform3d& tf1,
                        const DeformableMesh& second, const fcl::Transform3d& tf2,
                        const ProximityRequest& request, TrianglePairs& result);

/// The pairs of one mesh with itself, in its own frame: each pair once. Neighbours are ignored as
/// `request.ignored` says, which must not be NeighbourFilter::BeyondShared.
std::size_t selfPairsWithin(const DeformableMesh& mesh, const ProximityRequest& request,
                            TrianglePairs& result);

/// Request of featurePairsWithin.
struct FeatureProximityRequest {
  double distance = 0;   ///< largest distance of a pair
  Ignored ignored = {};  ///< pairs to leave out
};

/// All pairs of a vertex and a face, and of two edges, whose distance is at most
/// `request.distance`, each once: the input of a contact solver. feature_pairs.h defines the
/// numbers of edges. `result` is overwritten. Returns the number of pairs.
std::size_t featurePairsWithin(const DeformableMesh& first, const fcl::Transform3d& tf1,
                               const DeformableMesh& second, const fcl::Transform3d& tf2,
                               const FeatureProximityRequest& request, FeaturePairs& result);
/// With nothing to leave out.
std::size_t featurePairsWithin(const DeformableMesh& first, const fcl::Transform3d& tf1,
                               const DeformableMesh& second, const fcl::Transform3d& tf2,
                               double distance, FeaturePairs& result);

/// The pairs of one mesh with itself, without features that have a vertex in common.
std::size_t selfFeaturePairsWithin(const DeformableMesh& mesh,
                                   const FeatureProximityRequest& request, FeaturePairs& result);
/// With nothing to leave out.
std::size_t selfFeaturePairsWithin(const DeformableMesh& mesh, double distance,
                                   FeaturePairs& result);

/// Computes distance, nearest points, their coordinates and the normal of each of the given pairs
/// of features, which need not come from featurePairsWithin. `result` is overwritten; a reused
/// result allocates nothing on one thread. Also throws std::invalid_argument if a pair names a
/// vertex, triangle or edge that a mesh does not have.
void featurePairDetails(const DeformableMesh& first, const fcl::Transform3d& tf1,
                        const DeformableMesh& second, const fcl::Transform3d& tf2,
                        const FeaturePairs& pairs, FeaturePairDetails& result);

/// The details of pairs of one mesh with itself, in its own frame.
void selfFeaturePairDetails(const DeformableMesh& mesh, const FeaturePairs& pairs,
                            FeaturePairDetails& result);

/// Computes the distance of every vertex of `first` to the surface of `second`, at most `limit`:
/// result[v] is exact if it is less than `limit`. Suitable for per-vertex colouring. `result` is
/// overwritten with mesh.vertices().size() numbers.
void vertexDistances(const DeformableMesh& first, const fcl::Transform3d& tf1,
                     const DeformableMesh& second, const fcl::Transform3d& tf2, double limit,
                     std::vector<double>& result);

/// Computes `vertexDistances` with a negative sign for vertices inside of `second`, down to
/// -`limit`. A vertex is inside if the winding number of the surface around it, counted along a
/// ray, is not 0. Also throws std::invalid_argument if `second` is not closed: the triangles that
/// share an edge must traverse it equally often in both directions. Vertices are compared by index;
/// the message names an edge.
void signedVertexDistances(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2, double limit,
                           std::vector<double>& result);

}  // namespace adaptive_bvh
