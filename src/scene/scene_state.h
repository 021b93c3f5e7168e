#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/body_tree.h"

namespace adaptive_bvh {

/// Boxes around bodies, which are given by their index, and a tree of them.
struct BodyBoxes {
  std::vector<unsigned> in_tree, unbounded;  ///< bodies with a bounded box, and others
  BodyTree tree;                             ///< its body i is in_tree[i]
  std::vector<WorldBox> boxes;               ///< of the bodies in the tree

  /// Sets all but the tree.
  template <typename BoxOf>
  void assign(std::size_t count, const BoxOf& boxOf);
  void updateTree() { boxes.empty() ? tree.clear() : tree.update(boxes); }
  /// Calls found(a, b) for the pairs of bodies whose boxes are at most `distance` apart, or
  /// unbounded.
  template <typename Found>
  void forEachPair(double distance, const Found& found) const;
};

/// The private data of a Scene, which calls its members of the same names.
struct SceneState : BodyBoxes {
  using Filter = Scene::Filter;
  using Distance = SceneDistance;

  std::vector<Body> bodies;  ///< by increasing id
  BodyId next_id = 0;
  std::vector<BodyPair> ignored;  ///< sorted; each has the smaller id first
  Filter filter;
  int threads = 1;
  /// Identifies the bodies, their options and transforms and which pairs count, among those of all
  /// scenes; and after an update their geometry.
  std::uint64_t version = 0;

  bool is_current = true;  ///< whether the bounds of bodies and BodyBoxes are those of now

  /// Grows with every change that may change an answer. Shapes and octrees may change in place, so
  /// each update of a scene that has some counts.
  std::uint64_t epoch = 1;
  KeptDistance nearest_pair;  ///< what `distance` found last

  /// The index of a body in `bodies`. Throws std::invalid_argument if there is no such body.
  std::size_t indexOf(BodyId id) const;
  bool contains(BodyId id) const;
  /// Throws std::logic_error if bodies, transforms or meshes have changed since the last update.
  void requireCurrent() const;
  /// Whether the geometry is that of the last update, as far as versions of meshes tell.
  bool isAsUpdated() const;
  /// Whether all bodies are meshes, whose changes are known.
  bool hasVersionsOnly() const;
  void update();      ///< computes the bounds of all bodies, and the tree
  void setChanged();  ///< gives the state a new version, and begins an epoch

  // ---- Which pairs count

  void ignore(BodyId first, BodyId second);
  void unignore(BodyId first, BodyId second);
  void ignoreNeighbours(const std::vector<BodyId>& chain);
  /// Removes the ignored pairs of a body.
  void forget(BodyId body);
  bool admits(const Body& a, const Body& b) const;

  /// An upper bound of a distance in the world that was measured in the frame of either body.
  static double slack(double distance) { return distance * (1 + kTurnError); }

  /// Calls visit(body) for unbounded bodies, then for others by the distance of their boxes from
  /// `box` (if bounded). `visit` returns the distance beyond which no bodies are needed.
  template <typename Visit>
  void visitByDistance(const WorldBox& box, const Visit& visit) const {
    for (const unsigned index : unbounded) visit(bodies[index]);
    if (box.isBounded())
      tree.visitByDistance(box, [&](unsigned i, double) { return visit(bodies[in_tree[i]]); });
    else
      for (const unsigned index : in_tree) visit(bodies[index]);
  }
  /// Finds the admitted pairs of bodies with at least `meshes` meshes whose bounds are at most
  /// `distance` apart, as sorted pairs of indices.
  void findPairs(double distance, int meshes, std::vector<BodyPair>& pairs) const;
  /// Inserts pairs (i, i) of the bodies with self_collision into sorted pairs of indices.
  void addSelfPairs(std::vector<BodyPair>& pairs) const;

  /// Finds the admitted pairs of bodies that may come within `distance` in the step, as sorted
  /// pairs of indices. Pairs of two planes or half-spaces are left out.
  void findSweptPairs(FramePath path, double distance, std::vector<BodyPair>& pairs) const;

  // ---- Queries

  void collide(const SceneCollisionRequest& request, SceneCollisions& result) const;
  void pairsWithin(const ProximityRequest& request, SceneTrianglePairs& result) const;
  void featurePairsWithin(double distance, SceneFeaturePairs& result) const;
  void vertexContacts(double margin, SceneVertexContacts& result) const;
  bool isNearer(double distance) const;

  Distance distance() const;
  Distance nearest(BodyId body) const;
  /// Whether a kept distance is the answer now. A filter may change its mind at any time.
  bool isAnswer(const KeptDistance& kept) const;
  /// Keeps an answer of `distance` or `nearest` as the start of the next search.
  void keepDistance(const Distance& found);
  void keepNearest(BodyId body, const Distance& found);
  /// Keeps a pair as the start of the next search, unless the answer of `nearest` is kept.
  void keepNearest(BodyId body, const SceneClearance& found);
  void nearest(BodyId body, std::size_t k, std::vector<Distance>& result) const;
  ScenePoint nearestPoint(const fcl::Vector3d& point) const;

  void firstHits(const fcl::Vector3d* origins, const fcl::Vector3d* directions, std::size_t count,
                 const RayRange& range, std::vector<SceneRayHit>& result) const;
  SceneImpact earliestImpact(double separation) const;
  SceneClearance leastDistance(BodyId body, double tolerance, FramePath path) const;
  void leastDistances(BodyId body, std::size_t k, double tolerance, FramePath path,
                      std::vector<SceneClearance>& result) const;
  void intervalsBelow(double clearance, double tolerance, FramePath path,
                      SceneIntervals& result) const;

 private:
  std::vector<Body>::const_iterator find(BodyId id) const;
  template <typename Test>
  void findAdmitted(const BodyBoxes& near, double distance, const Test& test,
                    std::vector<BodyPair>& pairs) const;
};

template <typename BoxOf>
void BodyBoxes::assign(std::size_t count, const BoxOf& boxOf) {
  in_tree.clear();
  unbounded.clear();
  boxes.clear();
  for (unsigned i = 0; i < count; ++i) {
    const WorldBox& box = boxOf(i);
    (box.isBounded() ? in_tree : unbounded).push_back(i);
    if (box.isBounded()) boxes.push_back(box);
  }
}

template <typename Found>
void BodyBoxes::forEachPair(double distance, const Found& found) const {
  tree.forEachPair(distance, [&](unsigned i, unsigned j) { found(in_tree[i], in_tree[j]); });
  for (const unsigned a : unbounded) {
    for (const unsigned b : in_tree) found(a, b);
    for (const unsigned b : unbounded)
      if (b < a) found(a, b);
  }
}

namespace detail {

/// Gives the library access to the private data of a scene.
struct SceneAccess {
  static const SceneState& state(const Scene& scene);
};

}  // namespace detail

}  // namespace adaptive_bvh
