#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/rigid.h"
#include "deformable/mesh_state.h"
#include "scene/body_tree.h"

namespace adaptive_bvh {

template <typename S>
struct Scene<S>::State {
  std::vector<Body<S>> bodies;  ///< by increasing id
  BodyId next_id = 0;
  std::vector<BodyPair> ignored;  ///< sorted, each the smaller id first
  Filter filter;
  int threads = 1;

  // State of the last update. Bodies are identified by their index in `bodies`.
  bool is_current = true;
  std::vector<unsigned> in_tree, unbounded;
  BodyTree tree;
  std::vector<WorldBox> boxes;  ///< of those in the tree

  SceneDistance<S> nearest;  ///< the pair that `distance` found last

  /// The place of a body. Throws std::invalid_argument when there is none.
  std::size_t placeOf(BodyId id) const {
    const auto at = find(id);
    if (at == bodies.end() || at->id != id)
      throw std::invalid_argument("adaptive_bvh: there is no body " + std::to_string(id) +
                                  " in the scene");
    return static_cast<std::size_t>(at - bodies.begin());
  }
  bool contains(BodyId id) const {
    const auto at = find(id);
    return at != bodies.end() && at->id == id;
  }

  /// Throws std::logic_error unless everything is as it was in the last update.
  void requireCurrent() const {
    bool is_same = is_current;
    for (const Body<S>& body : bodies)
      is_same = is_same && (!body.mesh || stateOf(*body.mesh).version == body.positions);
    if (!is_same)
      throw std::logic_error(
          "adaptive_bvh: the scene has changed since its last update; call Scene::update before "
          "queries");
  }

  /// Whether a pair counts.
  bool admits(const Body<S>& a, const Body<S>& b) const {
    if (!(a.options.group & b.options.mask) || !(b.options.group & a.options.mask)) return false;
    const BodyPair pair = sorted(a.id, b.id);
    if (std::binary_search(ignored.begin(), ignored.end(), pair)) return false;
    return !filter || filter(pair.first, pair.second);
  }
  static BodyPair sorted(BodyId a, BodyId b) { return {std::min(a, b), std::max(a, b)}; }

  /// Distances of two bodies count in either's frame, by rotations that are such up to an error.
  static double slack(double distance) {
    return distance * (std::is_same<S, float>::value ? 1 + 2e-3 : 1 + 2e-6);
  }

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
  void findPairs(double distance, int meshes, std::vector<BodyPair>& pairs) const {
    pairs.clear();
    const auto add = [&](unsigned a, unsigned b) {
      if (int(bodies[a].mesh != nullptr) + int(bodies[b].mesh != nullptr) < meshes) return;
      if (admits(bodies[a], bodies[b])) pairs.push_back({std::min(a, b), std::max(a, b)});
    };
    const double limit = slack(distance);
    tree.forEachPair(limit, [&](unsigned i, unsigned j) {
      const Body<S>&a = bodies[in_tree[i]], &b = bodies[in_tree[j]];
      const double radii = (a.radius + b.radius + limit) * (1 + 1e-14);
      if ((a.middle - b.middle).squaredNorm() <= radii * radii) add(in_tree[i], in_tree[j]);
    });
    for (const unsigned a : unbounded) {
      for (const unsigned b : in_tree) add(a, b);
      for (const unsigned b : unbounded)
        if (b < a) add(a, b);
    }
    std::sort(pairs.begin(), pairs.end());
  }

 private:
  typename std::vector<Body<S>>::const_iterator find(BodyId id) const {
    return std::lower_bound(bodies.begin(), bodies.end(), id,
                            [](const Body<S>& body, BodyId x) { return body.id < x; });
  }
};

}  // namespace adaptive_bvh
