#pragma once

#include <array>
#include <vector>

#include "scene/body_tree.h"

namespace adaptive_bvh {

/// A scene in double precision, whatever the numbers of its bodies are: what a Scene asks, with the
/// same names and contracts. Its contacts name no objects.
struct SceneState {
  using Filter = Scene<double>::Filter;
  using Distance = SceneDistance<double>;

  /// In single precision, transforms may be farther from rigid motions, and hits of rays and limits
  /// of distances are compared as they are rounded.
  explicit SceneState(bool is_single) : single(is_single) {}

  bool single;
  std::vector<Body> bodies;  ///< by increasing id
  BodyId next_id = 0;
  std::vector<BodyPair> ignored;  ///< sorted, each the smaller id first
  Filter filter;
  int threads = 1;

  // State of the last update. Bodies are identified by their index in `bodies`.
  bool is_current = true;
  std::vector<unsigned> in_tree, unbounded;
  BodyTree tree;
  std::vector<WorldBox> boxes;  ///< of those in the tree

  Distance last_nearest;  ///< the pair that `distance` found last

  /// The place of a body. Throws std::invalid_argument when there is none.
  std::size_t placeOf(BodyId id) const;
  bool contains(BodyId id) const;
  /// Throws std::logic_error unless everything is as it was in the last update.
  void requireCurrent() const;
  void update();

  // ---- Which pairs count

  void ignore(BodyId first, BodyId second);
  void unignore(BodyId first, BodyId second);
  void ignoreNeighbours(const std::vector<BodyId>& chain);
  /// Removes all pairs of a body.
  void forget(BodyId body);
  bool admits(const Body& a, const Body& b) const;

  /// How far a matrix that requireRigid accepts may be from a rotation, and what is rounded.
  double turnError() const { return single ? 2e-3 : 2e-6; }
  /// Distances of two bodies count in either's frame, by rotations that are such up to an error.
  double slack(double distance) const { return distance * (1 + turnError()); }

  /// Calls visit(body) for all bodies, those without bounds first, then by how far their boxes are
  /// from a box at least; it returns the distance from which on no more are wanted.
  template <typename Visit>
  void visitByDistance(const WorldBox& box, const Visit& visit) const {
    for (const unsigned place : unbounded) visit(bodies[place]);
    if (box.isBounded())
      tree.visitByDistance(box, [&](unsigned i, double) { return visit(bodies[in_tree[i]]); });
    else
      for (const unsigned place : in_tree) visit(bodies[place]);
  }
  /// All pairs that count whose boxes are at most so far apart, by places, sorted: those with at
  /// least so many meshes.
  void findPairs(double distance, int meshes, std::vector<BodyPair>& pairs) const;

  // ---- Queries

  void collisions(const SceneCollisionRequest& request, SceneCollisions<double>& result) const;
  void pairsWithin(const ProximityRequest<double>& request,
                   SceneTrianglePairs<double>& result) const;
  void featurePairsWithin(double distance, SceneFeaturePairs& result) const;
  void vertexContacts(double margin, SceneVertexContacts<double>& result) const;
  bool isNearer(double distance) const;

  Distance distance();
  Distance nearest(BodyId body);
  void nearest(BodyId body, std::size_t k, std::vector<Distance>& result) const;
  ScenePoint<double> nearestPoint(const fcl::Vector3d& point) const;

  void firstHits(const fcl::Vector3d* origins, const fcl::Vector3d* directions, std::size_t count,
                 const RayRange<double>& range, std::vector<SceneRayHit<double>>& result) const;
  SceneImpact earliestImpact(double separation) const;

 private:
  std::vector<Body>::const_iterator find(BodyId id) const;
};

}  // namespace adaptive_bvh
