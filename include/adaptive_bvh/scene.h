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
#include "adaptive_bvh/motion_clearance.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"

namespace adaptive_bvh {

/// \file
/// Many bodies: deforming meshes, FCL's shapes and octrees. One tree of boxes over the bodies finds
/// the pairs that may be near. Pairs with a mesh are answered by the queries of pairs (query.h,
/// proximity.h, penetration.h), others by this library as well.
///
///     adaptive_bvh::Scene scene;
///     const auto hose = scene.add(hose_mesh);            // a DeformableMesh, by reference
///     const auto part = scene.add(box, tf);              // shared pointers are kept
///     hose_mesh.update(positions);
///     scene.update();                                    // each step, after all changes
///     adaptive_bvh::SceneDistance nearest = scene.nearest(hose);
///
/// **Currency.** `update` computes the boxes of all bodies in their present state. A query throws
/// std::logic_error if bodies, transforms or meshes have changed since then. Shapes and octrees
/// that change in place (the radius of a sphere) count from the next `update` on; a query between
/// the change and the update does not notice it, and its result is undefined.
///
/// **Shapes and octrees.** Shapes are filled. An octree is the set of its occupied cells, filled
/// boxes. Distances and contacts follow the conventions of query.h for a mesh and a shape: 0 where
/// bodies touch; one contact for each pair of shapes or cells; its position is a common point; the
/// second body moved by the depth along the normal is apart from the shape or cell of the first.
/// Planes and half-spaces are without end: two of them are apart only where they are parallel (to
/// 16 epsilon), and the depth is infinite where no motion separates them. Static shapes that
/// overlap are pairs as any other: `ignore` and groups leave them out.
///
/// Distances of two shapes or cells are those of the shapes' formulas if one is a sphere, capsule,
/// plane or half-space. All others lie between bounds certified by a plane and two points: in all
/// tests at most 4e-11 of the extent of both apart, and off by less than 1e-12. (Two of boxes,
/// cells, cylinders, cones, ellipsoids and convexes count as touching below 2^-46.) The depth of a
/// contact always separates the two. In all tests it was the least one up to 1e-9 of the extent;
/// proven lower bounds are less by up to 4e-8, and for two of cylinders and cones by up to 1e-2.
///
/// **Order.** Results are sorted by body, the smaller id of a pair first, and do not depend on the
/// number of threads.
///
/// **Units and frames.** Transforms place bodies in the world; results are in the world.
///
/// **Errors.** std::invalid_argument on ids that are not in the scene, on transforms that are not
/// rigid motions, on distances that are negative or NaN. A refused call changes nothing. Nor does
/// one that throws std::bad_alloc, and it can be repeated; but after such an `update` queries throw
/// std::logic_error until an update succeeds.
///
/// **Threads.** Any number of threads may call const members at once. Members that are not const
/// need the scene for themselves, and so does a change of a mesh. `setThreads` lets a query work on
/// several pairs at once, on the threads of the caller's oneTBB arena.

/// Number of a body, returned by Scene::add and never used again.
using BodyId = std::uint32_t;

/// Two bodies of a scene; the first has the smaller id unless stated otherwise.
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

/// Properties of a body besides its geometry and its transform.
struct BodyOptions {
  std::uint32_t group = 1;   ///< bits: the groups of the body
  std::uint32_t mask = ~0u;  ///< bits: the groups it may pair with; both bodies must allow the pair
  /// Whether `collide`, `pairsWithin` and `featurePairsWithin` include the body with itself,
  /// without triangles that share a vertex. Meshes only.
  bool self_collision = false;
  /// Whether a mesh is filled: then `collide` and `isNearer` also count meshes and shapes inside
  /// of it that do not touch its surface (adaptive_bvh::collide describes their contacts). It must
  /// be closed. Shapes are always filled. An octree inside of a mesh is not found.
  bool solid = false;
  std::uintptr_t user = 0;  ///< a value of the caller's
};

/// Request of Scene::collide.
struct SceneCollisionRequest {
  /// Largest number of contacts of each pair; 0 lists the pairs only.
  std::size_t contacts_per_pair = std::numeric_limits<std::size_t>::max();
  bool enable_contact = true;  ///< positions, normals and depths of the contacts
  bool first_only = false;     ///< stops at the smallest pair that touches
};

/// Bodies that touch, and their contacts.
struct SceneCollisions {
  std::vector<BodyPair> pairs;  ///< pairs that touch
  /// Pair i has the contacts from begins[i] up to begins[i + 1], which is excluded; one number
  /// more than there are pairs.
  std::vector<std::size_t> begins;
  /// Contacts as in adaptive_bvh::collide and selfCollide, except that o1, b1 and o2, b2 belong to
  /// the first and to the second body of the pair, and normals point from the first to the second.
  std::vector<fcl::Contactd> contacts;
};

/// Pairs of triangles, by pairs of bodies.
struct SceneTrianglePairs {
  std::vector<BodyPair> pairs;      ///< pairs of bodies with at least one pair of triangles
  std::vector<std::size_t> begins;  ///< pair i has found[begins[i]] up to found[begins[i + 1]]
  TrianglePairs found;              ///< of all pairs of bodies, one after the other
};

/// Pairs of features, by pairs of bodies.
struct SceneFeaturePairs {
  std::vector<BodyPair> pairs;  ///< pairs of bodies with at least one pair of features
  /// For pair i the ranges of FeaturePairs::vertex_face, face_vertex and edge_edge: from begins[i]
  /// up to begins[i + 1], which is excluded.
  std::vector<std::array<std::size_t, 3>> begins;
  FeaturePairs found;  ///< of all pairs of bodies, one after the other
};

/// Contacts of vertices, by pairs of bodies.
struct SceneVertexContacts {
  /// The mesh of the vertices and the other body. So a pair of meshes occurs up to twice.
  std::vector<BodyPair> pairs;
  std::vector<std::size_t> begins;  ///< pair i has the contacts from begins[i] to begins[i + 1]
  VertexContacts found;             ///< of all pairs of bodies, one after the other
};

/// A pair of bodies and its distance.
struct SceneDistance {
  BodyPair bodies = {0, 0};  ///< in Scene::nearest the body of the call comes first
  double distance = std::numeric_limits<double>::infinity();  ///< infinite if there is no pair
  /// Nearest points on the first body and on the second.
  std::array<fcl::Vector3d, 2> points = {
      fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()),
      fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};
  std::array<int, 2> elements = {-1, -1};  ///< triangle or cell of each body; -1 for a shape

  /// Whether there is a pair.
  bool exists() const { return distance < std::numeric_limits<double>::infinity(); }
};

/// The point of the bodies' surfaces that is nearest to a point.
struct ScenePoint {
  BodyId body = 0;                                            ///< the body with that point
  double distance = std::numeric_limits<double>::infinity();  ///< infinite if there is no body
  fcl::Vector3d point =
      fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< nearest
  int element = -1;  ///< triangle or cell with that point; -1 for a shape

  /// Whether there is a point.
  bool exists() const { return distance < std::numeric_limits<double>::infinity(); }
};

/// First hit of a ray with a scene.
struct SceneRayHit {
  BodyId body = 0;  ///< the body that is hit; without meaning if there is no hit
  double t = std::numeric_limits<double>::infinity();  ///< as RayHit::t
  int element = -1;  ///< triangle or cell that is hit; -1 for a shape
  double u = 0;      ///< as RayHit::u; 0 for a shape or cell
  double v = 0;      ///< as RayHit::v; 0 for a shape or cell

  /// Whether there is a hit: t is finite.
  bool exists() const { return t < std::numeric_limits<double>::infinity(); }
};

/// The first two bodies that come together in a step, and when.
struct SceneImpact {
  /// Number in Impact::pair of a shape, which has no features.
  static constexpr unsigned kNoFeature = ~0u;

  BodyPair bodies = {0, 0};  ///< the same body twice for a self-collision
  /// Of two meshes with the features of the first and of the second. If one of both is a shape or
  /// an octree, `kind` has no meaning, and `pair` has triangles and cells instead of features.
  Impact impact;

  /// Whether anything comes together.
  bool exists() const { return impact.exists(); }
};

namespace detail {
struct SceneAccess;
}

/// Two bodies and their least distance over the step.
struct SceneClearance {
  BodyPair bodies = {0, 0};  ///< the body of the call comes first
  /// Triangles and points in the order of the bodies; of an octree the number of the cell.
  MotionClearance clearance;

  /// Whether there is a pair.
  bool exists() const { return clearance.exists(); }
};

/// The times at which pairs of bodies are nearer than a distance.
struct SceneIntervals {
  std::vector<BodyPair> pairs;        ///< pairs with at least one interval
  std::vector<std::size_t> begins;    ///< pair i has intervals[begins[i]] to [begins[i + 1]]
  std::vector<MotionInterval> found;  ///< of all pairs of bodies, one after the other
};

/// Bodies and their queries; \ref scene.h describes currency, order, frames, errors and threads.
class Scene {
 public:
  using Geometry = fcl::CollisionGeometryd;  ///< a DeformableMesh, a shape or an octree
  using Transform = fcl::Transform3d;        ///< from a body's frame to the world
  /// Whether a pair counts.
  using Filter = std::function<bool(BodyId, BodyId)>;

  Scene();
  ~Scene();
  Scene(Scene&&) noexcept;             ///< the source can then only be destroyed or assigned to
  Scene& operator=(Scene&&) noexcept;  ///< the source can then only be destroyed or assigned to

  // ---- Bodies

  /// Adds a body. Several bodies may share a geometry. Throws std::invalid_argument if the geometry
  /// is not a DeformableMesh, a shape or an octree.
  BodyId add(std::shared_ptr<const Geometry> geometry, const Transform& tf = Transform::Identity(),
             const BodyOptions& options = {});
  /// Keeps a reference: the geometry must outlive the body.
  BodyId add(const Geometry& geometry, const Transform& tf = Transform::Identity(),
             const BodyOptions& options = {});
  BodyId add(Geometry&&, const Transform& = Transform::Identity(),
             const BodyOptions& = {}) = delete;
  /// Removes a body. Its id is not used again.
  void remove(BodyId body);
  /// Moves a body. Throws std::invalid_argument on a transform that is not rigid.
  void setTransform(BodyId body, const Transform& tf);
  /// Replaces the options of a body.
  void setOptions(BodyId body, const BodyOptions& options);

  /// Whether the scene has a body with this id.
  bool contains(BodyId body) const;
  std::size_t size() const;                       ///< number of bodies
  std::vector<BodyId> bodies() const;             ///< by increasing id
  const Geometry& geometry(BodyId body) const;    ///< the argument of `add`
  const Transform& transform(BodyId body) const;  ///< from the body's frame to the world
  const BodyOptions& options(BodyId body) const;  ///< the present options

  // ---- Which pairs count

  /// Leaves a pair out. Has no effect if it is left out already.
  void ignore(BodyId first, BodyId second);
  /// Lets a pair count again that `ignore` or `ignoreNeighbours` left out.
  void unignore(BodyId first, BodyId second);
  /// Leaves out bodies that follow each other in a kinematic chain.
  void ignoreNeighbours(const std::vector<BodyId>& chain);
  /// Sets a function that is called for each pair whose boxes are near and that is not left out
  /// otherwise. It must be thread-safe. It may run any query that is const, also of this scene, and
  /// on one thread the others; it must not change the scene or its bodies. If it throws, the query
  /// ends with that exception, and its result is valid but unspecified. An empty function admits
  /// all pairs.
  void setFilter(const Filter& filter);

  // ---- Steps

  /// Stores the transforms of all bodies as the start of the next step, for earliestImpact. A body
  /// that is added later starts at its first transform.
  void beginStep();
  /// Sets the number of threads of queries and of `update`, 1 by default. Throws
  /// std::invalid_argument below 1.
  void setThreads(int threads);
  /// Computes the boxes of all bodies in their present state. Call it after all changes of a step
  /// and before its first query. On one thread it allocates nothing in a steady step.
  void update();

  /// Returns a scene in the state of the last update, with the same ids. Other threads may query it
  /// while this scene and its meshes change. It has copies of the meshes, which share the
  /// topologies: one copy for bodies that share a mesh. Shapes and octrees are not copied: they
  /// must outlive it and stay as they are. Throws std::logic_error if the scene has changed since
  /// its last update.
  Scene snapshot() const;

  // ---- Queries of all pairs

  /// Finds the pairs of bodies that touch. Returns their number; `result` is overwritten.
  std::size_t collide(const SceneCollisionRequest& request, SceneCollisions& result) const;
  /// Finds the pairs of triangles of two meshes that are at most `request.distance` apart. Returns
  /// their number; `result` is overwritten.
  std::size_t pairsWithin(const ProximityRequest& request, SceneTrianglePairs& result) const;
  /// Finds the pairs of features of two meshes that are at most `distance` apart. Returns their
  /// number; `result` is overwritten.
  std::size_t featurePairsWithin(double distance, SceneFeaturePairs& result) const;
  /// Finds the vertices of meshes that are at most `distance` from another body, or inside of it.
  /// The other body is a shape or a closed mesh; meshes that are not closed have no inside and are
  /// left out. Returns the number of contacts; `result` is overwritten.
  std::size_t vertexContacts(double distance, SceneVertexContacts& result) const;
  /// Whether any two bodies are at most `distance` apart.
  bool isNearer(double distance) const;

  // ---- Nearest

  /// Returns the nearest pair. Keeps it as the start of the next call.
  SceneDistance distance();
  /// Of a const scene, such as a snapshot that threads share: starts from the pair that was kept
  /// last, here or in the scene of the snapshot, and keeps none.
  SceneDistance distance() const;
  /// Returns the body nearest to `body`. Keeps it as the start of the next call.
  SceneDistance nearest(BodyId body);
  /// Of a const scene: keeps nothing.
  SceneDistance nearest(BodyId body) const;
  /// Finds the k bodies nearest to `body`, by increasing distance, then id; fewer if there are
  /// fewer.
  void nearest(BodyId body, std::size_t k, std::vector<SceneDistance>& result) const;
  /// Returns the nearest point of the bodies' surfaces: also for a point inside of a shape or of an
  /// octree's cell.
  ScenePoint nearestPoint(const fcl::Vector3d& point) const;

  // ---- The step as a motion (continuous_collision.h)

  /// Returns the first two bodies that come together, or a mesh with itself with self_collision,
  /// during the motion from the last beginStep to the present state. Transforms go from those of
  /// beginStep to the present ones, vertices from DeformableMesh::previousVertices to the present
  /// ones (they stand still if there are no previous ones). As in continuous_collision.h, each
  /// point of a mesh, shape or cell moves on a straight line, so a body that turns shrinks a little
  /// in between. The normal and the offset of a plane or half-space change evenly. Pairs of two of
  /// these are left out, here and in the functions below.
  ///
  /// For two meshes, the time is that of adaptive_bvh::earliestImpact. For others it is never late,
  /// despite rounding, and early by the time in which the two approach by 1e-10 of their
  /// coordinates in the world; where they touch at a grazing angle, by more. Bodies that touch at
  /// the start have the time 0, and so has a triangle that is inside of a shape. Throws like
  /// adaptive_bvh::earliestImpact.
  SceneImpact earliestImpact(double distance = 0) const;
  /// The time up to which nothing comes together: from 0 to 1, the whole step.
  double largestSafeStep(double distance = 0) const {
    const double time = earliestImpact(distance).impact.time;
    return time < 1 ? time : 1;
  }

  // ---- The clearance over the step (motion_clearance.h)

  /// Returns the body that comes nearest to `body` during the step, which is the motion of
  /// earliestImpact, and their least distance. The bounds differ by at most `tolerance`, and all
  /// other bodies stay at least `upper` - `tolerance` away. With FramePath::Screw, bodies go from
  /// one transform to the other on screws. Throws like adaptive_bvh::leastDistance. Starts from the
  /// pair that `nearest` or this call has kept, and keeps its own.
  SceneClearance leastDistance(BodyId body, double tolerance, FramePath path = FramePath::Straight);
  /// Of a const scene: keeps nothing.
  SceneClearance leastDistance(BodyId body, double tolerance,
                               FramePath path = FramePath::Straight) const;
  /// Finds the k bodies that come nearest to `body`, by increasing upper bound, then id; fewer if
  /// there are fewer. All others stay at least the last upper bound less `tolerance` away.
  void leastDistances(BodyId body, std::size_t k, double tolerance, FramePath path,
                      std::vector<SceneClearance>& result) const;
  /// On straight paths.
  void leastDistances(BodyId body, std::size_t k, double tolerance,
                      std::vector<SceneClearance>& result) const {
    leastDistances(body, k, tolerance, FramePath::Straight, result);
  }
  /// Finds all pairs of bodies that come nearer than `distance`, and when: as
  /// adaptive_bvh::intervalsBelow does for each pair. Returns the number of pairs; `result` is
  /// overwritten. Bodies with themselves are left out.
  std::size_t intervalsBelow(double distance, double tolerance, FramePath path,
                             SceneIntervals& result) const;
  /// On straight paths.
  std::size_t intervalsBelow(double distance, double tolerance, SceneIntervals& result) const {
    return intervalsBelow(distance, tolerance, FramePath::Straight, result);
  }

  // ---- Rays

  /// Finds the first hit of each of many rays, in the order of the rays, with one range for all. A
  /// ray hits the surface of a shape or a cell where it enters, or if that is before the range
  /// where it leaves; a plane that it lies in is not hit. Hits of shapes and cells are computed by
  /// formula, up to rounding. Throws like adaptive_bvh::firstHits.
  void firstHits(const fcl::Vector3d* origins, const fcl::Vector3d* directions, std::size_t count,
                 const RayRange& range, std::vector<SceneRayHit>& result) const;
  /// On the whole rays.
  void firstHits(const fcl::Vector3d* origins, const fcl::Vector3d* directions, std::size_t count,
                 std::vector<SceneRayHit>& result) const {
    firstHits(origins, directions, count, RayRange(), result);
  }
  /// From vectors or matrices, one direction for each origin.
  void firstHits(const PointArray& origins, const PointArray& directions, const RayRange& range,
                 std::vector<SceneRayHit>& result) const {
    firstHits(origins.data(), directions.data(),
              detail::commonSize(origins.size(), directions.size()), range, result);
  }
  /// On the whole rays.
  void firstHits(const PointArray& origins, const PointArray& directions,
                 std::vector<SceneRayHit>& result) const {
    firstHits(origins, directions, RayRange(), result);
  }

 private:
  friend struct detail::SceneAccess;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace adaptive_bvh
