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
/// What is near: two meshes, or one and itself, within a distance d (see point_query.h for points
/// and rays). Every answer is that of a test of all pairs of triangles on the present positions, in
/// double precision, for meshes of either precision.
///
/// **Rounding.** Distances are off by less than 2^-44 (6e-14) of the largest coordinate of the
/// meshes, seen from the first. A pair whose distance is so near to d may be in or out. The
/// distance is 0 of triangles that have a common point, and only of those: that is decided without
/// any error for the second's corners as they are placed in the frame of the first.
///
/// **Frames and units.** `tf1` and `tf2` place the meshes in the world; lengths are in the meshes'
/// unit. A deforming mesh is asked in its present state, nothing is rebuilt.
///
/// **Errors.** std::invalid_argument when a distance is negative or NaN (infinity is fine), when a
/// transform is not a rigid motion, when a list of pairs to leave out is not sorted. A result is
/// then as it was.
///
/// **Threads.** Thread-safe on shared meshes, as query.h; a query of pairs takes several threads
/// itself where DeformableMesh::setQueryThreads says so, and its result is the same whatever
/// their number.

/// Whether the distance of two meshes is at most `distance`. Much cheaper than the distance: stops
/// at the first pair of triangles that is near enough, and looks at nothing that is farther away.
/// With `solid`, meshes are filled: also true where a component of one is inside of the other,
/// however far from its surface. Then both meshes must be closed; std::invalid_argument names an
/// edge that is open.
template <typename S>
bool isNearer(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
              const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2, S distance,
              bool solid = false);

/// Whether a shape of FCL's is at most `distance` away from a mesh, or touches it: a sphere,
/// capsule, box, cylinder, cone, ellipsoid, convex, plane or half-space. std::invalid_argument on
/// other geometry. A mesh inside of a shape touches it. With `solid`, so does a shape inside of the
/// mesh, which must be closed.
template <typename S>
bool isNearer(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2, S distance,
              bool solid = false);

/// `isNearer` for one pair of meshes, asked step after step. Keeps a lower bound of their distance:
/// while deformation and changed transforms cannot have used up what it exceeds d by, there is no
/// search at all. While bodies stay as near, the triangles around the last near pair are mostly
/// enough. Any number of updates may come between two calls. One object serves one thread at a
/// time; several may share a mesh.
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

  /// As the function above. `distance` may differ from call to call.
  bool isNearer(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2, S distance);

  /// How many calls had to search, so far.
  std::size_t searches() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// What a query of pairs is asked for.
template <typename S>
struct ProximityRequest {
  S distance = 0;                      ///< pairs at most so far apart
  bool enable_distances = false;       ///< also their distances
  bool enable_nearest_points = false;  ///< also their nearest points
  IgnoredPairs ignored = {};           ///< pairs of triangles to leave out
};

/// Pairs of triangles, in arrays side by side. A result that is used again allocates nothing once
/// it has grown large enough.
template <typename S>
struct TrianglePairs {
  /// Triangle of the first mesh, and of the second; within one mesh the smaller index first.
  std::vector<FeaturePair> triangles;
  /// Of each pair; empty unless asked for. 0 where they touch.
  std::vector<S> distances;
  /// Of each pair: a nearest point on the first and on the second, in the world; empty unless asked
  /// for. Where they touch both are a common point, up to rounding.
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

/// As above, of one mesh with itself, in its own frame: each pair once, without the neighbours
/// that `filter` leaves out.
template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& mesh, const ProximityRequest<S>& request,
                        TrianglePairs<S>& result,
                        NeighbourFilter filter = NeighbourFilter::SharedVertex);

/// What a query of features is asked for.
template <typename S>
struct FeatureProximityRequest {
  S distance = 0;  ///< pairs at most so far apart
  /// Pairs of each kind to leave out. Of one mesh with itself, `face_vertex` is not read.
  IgnoredPairs vertex_face = {};
  IgnoredPairs face_vertex = {};  ///< likewise
  IgnoredPairs edge_edge = {};    ///< likewise
};

/// What contact solvers work on: all pairs of a vertex and a face, and of two edges, whose distance
/// is at most `request.distance`, each once (feature_pairs.h says how edges are numbered). `result`
/// is overwritten. Returns the number of pairs.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               const FeatureProximityRequest<S>& request, FeaturePairs& result);
/// With nothing to leave out.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               S distance, FeaturePairs& result);

/// As above, of one mesh with itself, without features that have a vertex in common.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh,
                               const FeatureProximityRequest<S>& request, FeaturePairs& result);
/// With nothing to leave out.
template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh, S distance, FeaturePairs& result);

/// Distance, nearest points, where these lie, and normal of each of some pairs of features, as
/// featurePairsWithin finds them or others. `result` is overwritten; one that is used again
/// allocates nothing on one thread. Throws std::invalid_argument also when a pair names a vertex,
/// triangle or edge that a mesh does not have.
template <typename S>
void featurePairDetails(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                        const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                        const FeaturePairs& pairs, FeaturePairDetails<S>& result);

/// As above, of one mesh with itself, in its own frame.
template <typename S>
void featurePairDetails(const DeformableMesh<S>& mesh, const FeaturePairs& pairs,
                        FeaturePairDetails<S>& result);

/// For every vertex of `mesh` its distance to the surface of `other`: result[v] is exact where it
/// is less than `limit`, and `limit` elsewhere. What one paints on a mesh. `result` is overwritten
/// with mesh.vertices().size() numbers.
template <typename S>
void clearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
               const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf, S limit,
               std::vector<S>& result);

/// As above, with a negative sign for a vertex inside of `other`: where its surface winds around
/// the vertex (the winding number is not 0), as counted along a ray. -`limit` is deep inside.
/// Throws std::invalid_argument also when `other` is not closed: every edge must be run through as
/// often in one direction as in the other by the triangles that share it. Vertices are compared by
/// index; the message names an edge.
template <typename S>
void signedClearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                     const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf, S limit,
                     std::vector<S>& result);

/// In single precision.
using CoherentProximityf = CoherentProximity<float>;
/// In double precision.
using CoherentProximityd = CoherentProximity<double>;

/// The meshes say which numbers.
template <typename S>
CoherentProximity(const DeformableMesh<S>&, const DeformableMesh<S>&) -> CoherentProximity<S>;

extern template class CoherentProximity<float>;
extern template class CoherentProximity<double>;

}  // namespace adaptive_bvh
