#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/self_collision.h"

namespace adaptive_bvh {

/// \file
/// Nearness of two meshes, or of one with itself, within a distance d (point_query.h has points and
/// rays). Every answer is the one that a test of all pairs of triangles would give for the present
/// positions, in double precision for meshes of either precision.
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
/// transform is not a rigid motion, or if a list of pairs to leave out is not as IgnoredPairs says.
/// The result is then unchanged. After std::bad_alloc it is valid, with unspecified contents.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query of pairs runs on several threads
/// if DeformableMesh::setQueryThreads allows it; its result does not depend on their number.

/// Whether the distance of two meshes is at most `distance`. Much cheaper than computing the
/// distance: it stops at the first pair of triangles that is near enough, and visits no nodes that
/// are farther apart. With `solid`, meshes are filled: the result is also true if a component of
/// one is inside of the other, however far from its surface. Then both meshes must be closed;
/// otherwise throws std::invalid_argument, which names an open edge.
template <typename S>
bool isNearer(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
              const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
              NonDeduced<S> distance, bool solid = false);

/// Whether a shape of FCL's is at most `distance` away from a mesh, or touches it: a sphere,
/// capsule, box, cylinder, cone, ellipsoid, convex, plane or half-space. std::invalid_argument on
/// other geometry. A mesh inside of a shape touches it. With `solid`, so does a shape inside of the
/// mesh, which must be closed.
template <typename S>
bool isNearer(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
              NonDeduced<S> distance, bool solid = false);

/// `isNearer` for one pair of meshes, called step after step. Keeps a lower bound of their
/// distance. There is no search while this bound, less the motion since, exceeds d. While the
/// bodies stay near, it mostly suffices to test the triangles around the last near pair. Any number
/// of updates may come between two calls. One object serves one thread at a time; several may share
/// a mesh. A call that throws std::bad_alloc can be repeated.
template <typename S>
class CoherentProximity {
 public:
  /// Keeps references: the meshes must outlive this object.
  CoherentProximity(const DeformableMesh<S>& first, const DeformableMesh<S>& second);
  ~CoherentProximity();
  /// The moved-from object can only be destroyed.
  CoherentProximity(CoherentProximity&&) noexcept;
  CoherentProximity(const CoherentProximity&) = delete;
  CoherentProximity& operator=(const CoherentProximity&) = delete;

  /// Whether the distance of the meshes is at most `distance`, which may differ from call to call.
  bool isNearer(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2, S distance);

  /// The number of calls so far that had to search.
  std::size_t searches() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Request of pairsWithin.
template <typename S>
struct ProximityRequest {
  S distance = 0;                      ///< largest distance of a pair
  bool enable_distances = false;       ///< also their distances
  bool enable_nearest_points = false;  ///< also their nearest points
  IgnoredPairs ignored = {};           ///< pairs of triangles to leave out
};

/// Pairs of triangles, in parallel arrays. A reused result allocates nothing once it has grown
/// large enough.
template <typename S>
struct TrianglePairs {
  /// Triangle of the first mesh, and of the second; within one mesh the smaller index first.
  std::vector<FeaturePair> triangles;
  /// Distance of each pair, 0 if the triangles touch. Empty without `enable_distances`.
  std::vector<S> distances;
  /// For each pair a nearest point on the first and on the second triangle, in the world. If they
  /// touch, both are a common point, up to rounding. Empty without `enable_nearest_points`.
  std::vector<std::array<fcl::Vector3<S>, 2>> nearest_points;

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
template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                        const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                        const ProximityRequest<S>& request, TrianglePairs<S>& result);

/// The pairs of one mesh with itself, in its own frame: each pair once, without the neighbours that
/// `filter` leaves out.
template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& mesh, const ProximityRequest<S>& request,
                        TrianglePairs<S>& result,
                        NeighbourFilter filter = NeighbourFilter::SharedVertex);

/// Request of featurePairsWithin.
template <typename S>
struct FeatureProximityRequest {
  S distance = 0;  ///< largest distance of a pair
  /// Pairs of each kind to leave out. Of one mesh with itself, `face_vertex` is not read.
  IgnoredPairs vertex_face = {};
  IgnoredPairs face_vertex = {};  ///< likewise
  IgnoredPairs edge_edge = {};    ///< likewise
};

/// All pairs of a vertex and a face, and of two edges, whose distance is at most
/// `request.distance`, each once: the input of a contact solver. feature_pairs.h defines the
/// numbers of edges. `result` is overwritten. Returns the number of pairs.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               const FeatureProximityRequest<S>& request, FeaturePairs& result);
/// With nothing to leave out.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               NonDeduced<S> distance, FeaturePairs& result);

/// The pairs of one mesh with itself, without features that have a vertex in common.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh,
                               const FeatureProximityRequest<S>& request, FeaturePairs& result);
/// With nothing to leave out.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh, NonDeduced<S> distance,
                               FeaturePairs& result);

/// Computes distance, nearest points, their coordinates and the normal of each of the given pairs
/// of features, which need not come from featurePairsWithin. `result` is overwritten; a reused
/// result allocates nothing on one thread. Also throws std::invalid_argument if a pair names a
/// vertex, triangle or edge that a mesh does not have.
template <typename S>
void featurePairDetails(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                        const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                        const FeaturePairs& pairs, FeaturePairDetails<S>& result);

/// The details of pairs of one mesh with itself, in its own frame.
template <typename S>
void featurePairDetails(const DeformableMesh<S>& mesh, const FeaturePairs& pairs,
                        FeaturePairDetails<S>& result);

/// Computes the distance of every vertex of `mesh` to the surface of `other`, at most `limit`:
/// result[v] is exact if it is less than `limit`. Suitable for per-vertex colouring. `result` is
/// overwritten with mesh.vertices().size() numbers.
template <typename S>
void clearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
               const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf,
               NonDeduced<S> limit, std::vector<S>& result);

/// Computes `clearance` with a negative sign for vertices inside of `other`, down to -`limit`. A
/// vertex is inside if the winding number of the surface around it, counted along a ray, is not 0.
/// Also throws std::invalid_argument if `other` is not closed: the triangles that share an edge
/// must traverse it equally often in both directions. Vertices are compared by index; the message
/// names an edge.
template <typename S>
void signedClearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                     const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf,
                     NonDeduced<S> limit, std::vector<S>& result);

/// In single precision.
using CoherentProximityf = CoherentProximity<float>;
/// In double precision.
using CoherentProximityd = CoherentProximity<double>;

/// Deduces S from the meshes.
template <typename S>
CoherentProximity(const DeformableMesh<S>&, const DeformableMesh<S>&) -> CoherentProximity<S>;

extern template class CoherentProximity<float>;
extern template class CoherentProximity<double>;

}  // namespace adaptive_bvh
