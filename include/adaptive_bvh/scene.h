#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include <fcl/geometry/collision_geometry.h>
#include <fcl/narrowphase/contact.h>

#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"

namespace adaptive_bvh {

/// \file
/// Many bodies: meshes that deform, FCL's shapes and octrees. One tree of boxes over the bodies
/// finds the pairs that may be near; the queries of pairs (query.h, proximity.h, penetration.h)
/// answer for each.
///
///     adaptive_bvh::Scene<double> scene;
///     const auto hose = scene.add(hose_mesh);            // a DeformableMesh, by reference
///     const auto part = scene.add(box, tf);              // shared pointers are kept
///     hose_mesh.update(positions);
///     scene.update();                                    // each step, after all changes
///     adaptive_bvh::SceneDistance<double> nearest = scene.nearest(hose);
///
/// **Currency.** `update` computes the boxes of all bodies. A query throws std::logic_error when
/// bodies, transforms or meshes have changed since.
///
/// **Order.** Results are sorted by body, the smaller id of a pair first, and do not depend on the
/// number of threads.
///
/// **Units and frames.** Transforms place bodies in the world; results are in the world.
///
/// **Errors.** std::invalid_argument on ids that are not in the scene, on transforms that are not
/// rigid motions, on distances that are negative or NaN. A refused call changes nothing.
///
/// **Threads.** Any number of threads may call const members at once. Members that are not const
/// need the scene for themselves, and so does a change of a mesh. `setThreads` lets a query work on
/// several pairs at once, on the threads of the caller's oneTBB arena.
///
/// S is float or double.

/// Number of a body: given by Scene::add, never given again.
using BodyId = std::uint32_t;

/// Two bodies of a scene; the first has the smaller id, if nothing else is said.
struct BodyPair {
  BodyId first;   ///< a body
  BodyId second;  ///< another one, or the same for a self-collision

  /// Whether both bodies are the same.
  friend bool operator==(const BodyPair& a, const BodyPair& b) {
    return a.first == b.first && a.second == b.second;
  }
  /// Whether a body differs.
  friend bool operator!=(const BodyPair& a, const BodyPair& b) { return !(a == b); }
  /// By the first id, then by the second.
  friend bool operator<(const BodyPair& a, const BodyPair& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  }
};

/// What a scene knows of a body beside its geometry and its transform.
struct BodyOptions {
  std::uint32_t group = 1;   ///< bits; the groups that the body belongs to
  std::uint32_t mask = ~0u;  ///< bits; the groups that it meets. Both bodies of a pair must agree.
  /// Whether `collisions`, `pairsWithin` and `featurePairsWithin` include the body with itself,
  /// without triangles that share a vertex. Meshes only.
  bool self_collision = false;
  /// Whether a mesh is filled: then meshes and shapes inside of it, which do not touch its surface,
  /// touch it for `collisions` and `isNearer` (adaptive_bvh::collide says which contacts they
  /// have). It must be closed. Shapes are always filled. An octree inside of a mesh is not found.
  bool solid = false;
  std::uintptr_t user = 0;  ///< a value of the caller's
};

/// What `collisions` looks for.
struct SceneCollisionRequest {
  /// Contacts of each pair, at most; 0 lists the pairs only.
  std::size_t contacts_per_pair = std::numeric_limits<std::size_t>::max();
  bool enable_contact = true;  ///< positions, normals and depths of the contacts
  bool first_only = false;     ///< stops at the smallest pair that touches
};

/// Bodies that touch, and their contacts.
template <typename S>
struct SceneCollisions {
  std::vector<BodyPair> pairs;  ///< that touch
  /// The contacts of pair i are those from offsets[i] to offsets[i + 1]; one number more than
  /// pairs.
  std::vector<std::size_t> offsets;
  /// As those of adaptive_bvh::collide and selfCollide, but o1, b1 and o2, b2 belong to the first
  /// and to the second body of the pair, and normals point from the first to the second.
  std::vector<fcl::Contact<S>> contacts;
};

/// Pairs of triangles, by pairs of bodies.
template <typename S>
struct SceneTrianglePairs {
  std::vector<BodyPair> pairs;       ///< that have some
  std::vector<std::size_t> offsets;  ///< of pair i: from offsets[i] to offsets[i + 1]
  TrianglePairs<S> found;            ///< of all pairs, one after the other
};

/// Pairs of features, by pairs of bodies.
struct SceneFeaturePairs {
  std::vector<BodyPair> pairs;  ///< that have some
  /// Of pair i: FeaturePairs::vertex_face, face_vertex and edge_edge from offsets[i] to
  /// offsets[i + 1].
  std::vector<std::array<std::size_t, 3>> offsets;
  FeaturePairs found;  ///< of all pairs, one after the other
};

/// Contacts of vertices, by pairs of bodies.
template <typename S>
struct SceneVertexContacts {
  /// The mesh that has the vertices, and the other body: so each pair comes up to twice.
  std::vector<BodyPair> pairs;
  std::vector<std::size_t> offsets;  ///< of pair i: from offsets[i] to offsets[i + 1]
  VertexContacts<S> found;           ///< of all pairs, one after the other
};

/// A pair of bodies, and how far apart they are.
template <typename S>
struct SceneDistance {
  BodyPair bodies = {0, 0};  ///< of Scene::nearest: the body that was asked for comes first
  S distance = std::numeric_limits<S>::infinity();  ///< infinite where there is no pair
  /// On the first body and on the second.
  std::array<fcl::Vector3<S>, 2> points = {
      fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()),
      fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN())};
  std::array<int, 2> elements = {-1, -1};  ///< triangles or cells; -1 of a shape

  /// Whether there is a pair.
  bool exists() const { return distance < std::numeric_limits<S>::infinity(); }
};

/// The point of the bodies' surfaces that is nearest to a point.
template <typename S>
struct ScenePoint {
  BodyId body = 0;                                  ///< a mesh
  S distance = std::numeric_limits<S>::infinity();  ///< infinite where there is no mesh
  fcl::Vector3<S> point =
      fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN());  ///< nearest
  int triangle = -1;                                                   ///< that has it
};

/// Where a ray meets a scene first.
template <typename S>
struct SceneRayHit {
  BodyId body = 0;  ///< a mesh; without meaning where hit.triangle is -1
  RayHit<S> hit;    ///< as firstHit gives it
};

/// The first two bodies that come together in a step, and when.
struct SceneImpact {
  BodyPair bodies = {0, 0};  ///< the same twice where a body meets itself
  Impact impact;             ///< its features are of the first body and of the second

  /// Whether anything comes together.
  bool happens() const { return impact.happens(); }
};

/// Bodies and their queries; see above.
template <typename S>
class Scene {
 public:
  using Geometry = fcl::CollisionGeometry<S>;  ///< a DeformableMesh, a shape or an octree
  using Transform = fcl::Transform3<S>;        ///< from a body's frame to the world
  /// Whether a pair counts.
  using Filter = std::function<bool(BodyId, BodyId)>;

  Scene();
  ~Scene();
  Scene(Scene&&) noexcept;             ///< the other can then only be destroyed or assigned to
  Scene& operator=(Scene&&) noexcept;  ///< the other can then only be destroyed or assigned to

  // ---- Bodies

  /// Adds a body. Several bodies may share a geometry. Throws std::invalid_argument on geometry
  /// that is none of the three.
  BodyId add(std::shared_ptr<const Geometry> geometry, const Transform& tf = Transform::Identity(),
             const BodyOptions& options = {});
  /// Keeps a reference: the geometry must outlive the body.
  BodyId add(const Geometry& geometry, const Transform& tf = Transform::Identity(),
             const BodyOptions& options = {});
  BodyId add(Geometry&&, const Transform& = Transform::Identity(),
             const BodyOptions& = {}) = delete;
  /// Removes a body. Its id is never given again.
  void remove(BodyId body);
  /// Moves a body. Throws std::invalid_argument on a transform that is not rigid.
  void setTransform(BodyId body, const Transform& tf);
  /// Replaces the options of a body.
  void setOptions(BodyId body, const BodyOptions& options);

  /// Whether the scene has a body with this id.
  bool contains(BodyId body) const;
  std::size_t size() const;                       ///< bodies
  std::vector<BodyId> bodies() const;             ///< by increasing id
  const Geometry& geometry(BodyId body) const;    ///< that `add` was given
  const Transform& transform(BodyId body) const;  ///< from the body's frame to the world
  const BodyOptions& options(BodyId body) const;  ///< that the body has now

  // ---- Which pairs count

  /// Leaves a pair out. Nothing when it is left out already.
  void ignore(BodyId first, BodyId second);
  /// Lets a pair count again that `ignore` or `ignoreNeighbours` left out.
  void unignore(BodyId first, BodyId second);
  /// Leaves out bodies that follow each other in a kinematic chain.
  void ignoreNeighbours(const std::vector<BodyId>& chain);
  /// Asked for each pair whose boxes are near and which nothing else leaves out; it must be
  /// thread-safe. An empty function admits all.
  void setFilter(const Filter& filter);

  // ---- Steps

  /// Remembers the transforms of all bodies: where the next step begins. A body that is added later
  /// begins where it is.
  void beginStep();
  /// Of queries, from 1.
  void setThreads(int threads);
  /// Computes the boxes of all bodies in their present state. To be called after all changes of a
  /// step, before its first query. Allocates nothing in a steady step.
  void update();

  /// A scene that stays as this one was in its last update, with the same ids, for other threads:
  /// they query it while this scene and its meshes change. It has copies of the meshes, which share
  /// the topologies: one copy for bodies that share a mesh. Referenced shapes must outlive it, too.
  /// Throws std::logic_error where the scene has changed since its last update.
  Scene snapshot() const;

  // ---- Queries of all pairs

  /// Pairs of bodies that touch. Returns their number; `result` is overwritten.
  std::size_t collisions(const SceneCollisionRequest& request, SceneCollisions<S>& result) const;
  /// Pairs of triangles of two meshes at most `request.distance` apart.
  std::size_t pairsWithin(const ProximityRequest<S>& request, SceneTrianglePairs<S>& result) const;
  /// Pairs of features of two meshes at most so far apart.
  std::size_t featurePairsWithin(S distance, SceneFeaturePairs& result) const;
  /// Vertices of meshes that are at most `margin` from another body, or inside of it. The other
  /// body is a shape or a closed mesh; meshes that are not closed have no inside and are left out.
  std::size_t vertexContacts(S margin, SceneVertexContacts<S>& result) const;
  /// Whether any two bodies are at most so far apart.
  bool isNearer(S distance) const;

  // ---- Nearest

  /// The nearest pair. Remembers it: the next call starts from it.
  SceneDistance<S> distance();
  /// The body nearest to one. Remembers it: the next call starts from it.
  SceneDistance<S> nearest(BodyId body);
  /// The k bodies nearest to one, by increasing distance, then id; fewer where there are fewer.
  void nearest(BodyId body, std::size_t k, std::vector<SceneDistance<S>>& result) const;
  /// The nearest point of the meshes' surfaces.
  ScenePoint<S> nearestPoint(const fcl::Vector3<S>& point) const;

  // ---- The step as a motion (continuous_collision.h)

  /// The first two features of two meshes that come together, or of one with self_collision, on the
  /// way from the last beginStep to the present state: transforms from those to these, vertices
  /// from DeformableMesh::previousVertices (or at rest where there are none) to the present ones.
  /// Shapes and octrees have no part. Throws as earliestImpact.
  SceneImpact earliestImpact(double separation = 0) const;
  /// The time up to which nothing comes together: from 0 to 1, the whole step.
  double largestSafeStep(double separation = 0) const {
    const double time = earliestImpact(separation).impact.time;
    return time < 1 ? time : 1;
  }

  // ---- Rays

  /// The first hit of each of many rays with the meshes, in their order, with one range for all.
  /// Shapes and octrees are not met. Throws as adaptive_bvh::firstHits.
  void firstHits(const fcl::Vector3<S>* origins, const fcl::Vector3<S>* directions,
                 std::size_t count, const RayRange<S>& range,
                 std::vector<SceneRayHit<S>>& result) const;
  /// On the whole rays.
  void firstHits(const fcl::Vector3<S>* origins, const fcl::Vector3<S>* directions,
                 std::size_t count, std::vector<SceneRayHit<S>>& result) const {
    firstHits(origins, directions, count, RayRange<S>(), result);
  }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

using Scenef = Scene<float>;   ///< in single precision
using Scened = Scene<double>;  ///< in double precision

extern template class Scene<float>;
extern template class Scene<double>;

}  // namespace adaptive_bvh
