// Distances of a scene's bodies, which are visited in order of the distance of their boxes.
#include <algorithm>
#include <cmath>

#include "base/leased.h"
#include "base/shortcut.h"
#include "dispatch/contained.h"
#include "dispatch/pairs.h"
#include "dispatch/shape_search.h"
#include "query/depth/depth_meshes.h"
#include "query/nearest/nearest_search.h"
#include "query/within/near_pairs.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

/// The order of Scene::nearest: by distance, then by the other body's id.
bool isNearerBody(const SceneDistance& a, const SceneDistance& b) {
  return a.distance != b.distance ? a.distance < b.distance : a.bodies.second < b.bodies.second;
}

/// Lowers query.result to the distance of two bodies. `witness`: triangles that may be near, or -1.
/// Returns whether the result has the bodies in reverse order.
bool lowerDistance(const Body& a, const Body& b, const std::array<int, 2>& witness,
                   const DistanceQuery& query) {
  if (a.isMesh() && b.isMesh()) {
    const PlacedMesh first(a.placedMesh()), second(b.placedMesh());
    NearestPair nearest(first, second, query);
    nearest.addWitness(witness[0], witness[1]);
    NearestSearch(first, second, nearest).run();
    return false;
  }
  const QueryObject first(a.object()), second(b.object());
  const PairSearch& pair = searchOf(first.kind(), second.kind());
  pair.distance(pair.is_swapped ? second : first, pair.is_swapped ? first : second, query);
  return pair.is_swapped;
}

/// Reverses the order of the bodies.
void swapBodies(SceneDistance& distance) {
  std::swap(distance.bodies.first, distance.bodies.second);
  std::swap(distance.points[0], distance.points[1]);
  std::swap(distance.elements[0], distance.elements[1]);
}

/// Sets `best` to the distance of two bodies if it is smaller; returns whether it is.
bool improve(const Body& a, const Body& b, const std::array<int, 2>& witness, SceneDistance& best) {
  const fcl::DistanceRequestd request(true);
  fcl::DistanceResultd result(best.distance);
  const bool is_swapped = lowerDistance(a, b, witness, {request, result});
  if (!(result.min_distance < best.distance)) return false;
  best.bodies = is_swapped ? BodyPair{b.id, a.id} : BodyPair{a.id, b.id};
  best.distance = result.min_distance;
  best.points = {result.nearest_points[0], result.nearest_points[1]};
  best.elements = {int(result.b1), int(result.b2)};
  if (is_swapped) swapBodies(best);
  return true;
}

/// Whether a triangle of a mesh may be at most `distance` from a box.
bool hasNearLeaf(const Body& mesh, const WorldBox& box, double distance) {
  ShapeCore core;
  core.low = box.low;
  core.high = box.high;
  const WideTree& tree = mesh.mesh().tree;
  const ShapeInTree in_tree(core, fcl::Transform3d::Identity(), tree, mesh.tf);
  if (!in_tree.isPrecise()) return true;
  const float limit = in_tree.squaredLimit(distance);
  return TreeWalk(tree).nearestFirst(
      [&](const WideNode& node) -> Float4 { return in_tree.squaredGaps(node.boxes); },
      [&] { return limit; }, [](const WideNode&, unsigned, const Float4&) { return true; });
}

}  // namespace

bool SceneState::isAnswer(const KeptDistance& kept) const {
  return isTaken(Shortcut::Coherence) && kept.epoch == epoch && !filter;
}

void SceneState::keepNearest(BodyId body, const Distance& found) {
  if (found.exists()) bodies[indexOf(body)].nearest = {found, epoch};
}

void SceneState::keepDistance(const Distance& found) {
  if (found.exists()) nearest_pair = {found, epoch};
}

SceneState::Distance SceneState::nearest(BodyId body) const {
  requireCurrent();
  const Body& first = bodies[indexOf(body)];
  if (isAnswer(first.nearest)) return first.nearest.found;
  Distance best;
  const auto tryBody = [&](const Body& other, const std::array<int, 2>& witness) {
    if (&other != &first && admits(first, other)) improve(first, other, witness, best);
  };
  const Distance last = first.nearest.found;  // a copy: a filter may run a search that is kept
  const BodyId last_other = last.bodies.second;
  const bool has_witness = last.exists() && contains(last_other);
  if (has_witness) tryBody(bodies[indexOf(last_other)], last.elements);
  const auto tryOthers = [&](const Body& other) {
    const double limit = slack(best.distance);
    const bool is_tried = has_witness && other.id == last_other;
    const bool is_far = first.isMesh() && !hasNearLeaf(first, other.box, limit);
    if (!is_tried && !is_far) tryBody(other, {-1, -1});
    return slack(best.distance);
  };
  visitByDistance(first.box, tryOthers);
  return best;
}

void SceneState::nearest(BodyId body, std::size_t k, std::vector<Distance>& result) const {
  requireCurrent();
  const Body& first = bodies[indexOf(body)];
  result.clear();
  if (k == 0) return;
  const auto tryBody = [&](const Body& other) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const bool is_full = result.size() == k;
    Distance found;
    if (is_full) found.distance = std::nextafter(result.back().distance, kFar);
    if (&other != &first && admits(first, other) && improve(first, other, {-1, -1}, found) &&
        (!is_full || isNearerBody(found, result.back()))) {
      if (is_full) result.pop_back();
      result.insert(std::upper_bound(result.begin(), result.end(), found, isNearerBody), found);
    }
    return result.size() == k ? slack(result.back().distance) : kFar;
  };
  visitByDistance(first.box, tryBody);
}

SceneState::Distance SceneState::distance() const {
  requireCurrent();
  if (isAnswer(nearest_pair)) return nearest_pair.found;
  Distance best;
  const Distance last = nearest_pair.found;  // a copy: a filter may run a search that is kept
  if (last.exists() && contains(last.bodies.first) && contains(last.bodies.second)) {
    const Body &a = bodies[indexOf(last.bodies.first)], &b = bodies[indexOf(last.bodies.second)];
    if (admits(a, b)) improve(a, b, last.elements, best);
  }
  for (std::size_t i = 0; i < bodies.size() && !best.exists(); ++i) best = nearest(bodies[i].id);
  if (!best.exists()) return best;
  if (best.bodies.second < best.bodies.first) swapBodies(best);
  struct Candidate {
    double gap;
    BodyPair pair;
  };
  const Leased<std::vector<BodyPair>> pairs;
  const Leased<std::vector<Candidate>> leased;
  std::vector<Candidate>& candidates = *leased;
  findPairs(best.distance, 0, *pairs);
  candidates.clear();
  for (const BodyPair& pair : *pairs) {
    const WorldBox &a = bodies[pair.first].box, &b = bodies[pair.second].box;
    candidates.push_back({a.isBounded() && b.isBounded() ? gapOf(a, b) : 0, pair});
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.gap != b.gap ? a.gap < b.gap : a.pair < b.pair;
  });
  for (const Candidate& c : candidates) {
    if (c.gap > slack(best.distance)) break;
    improve(bodies[c.pair.first], bodies[c.pair.second], {-1, -1}, best);
  }
  return best;
}

namespace {

/// Whether a body is inside another one, which is solid. The surfaces must not touch.
bool isInside(const Body& inner, const Body& around) {
  if (!around.options.solid) return false;
  const PlacedMesh solid(around.placedMesh());
  const QueryObject object(inner.object());
  if (object.kind() == ObjectKind::Mesh) return isContained(object.mesh(), solid);
  return object.kind() == ObjectKind::Shape && isContained(object.solid(), solid);
}

/// Whether two bodies are at most `distance` apart. Meshes are surfaces here, even if solid.
bool areNearer(const Body& a, const Body& b, double distance) {
  if (b.isMesh() && !a.isMesh()) return areNearer(b, a, distance);
  if (b.isMesh()) return isNearer({a.placedMesh(), b.placedMesh()}, distance);
  if (a.isMesh() && b.geometry.kind() == ObjectKind::Shape) {
    const QueryObject shape(b.object());
    return isNearer(a.placedMesh(), shape.solid(), shape.parts().shape().core(), distance);
  }
  SceneDistance found;
  found.distance = std::nextafter(distance, std::numeric_limits<double>::infinity());
  return improve(a, b, {-1, -1}, found);
}

}  // namespace

bool SceneState::isNearer(double distance) const {
  requireCurrent();
  const Leased<std::vector<BodyPair>> pairs;
  findPairs(distance, 0, *pairs);
  for (const BodyPair& pair : *pairs) {
    const Body &a = bodies[pair.first], &b = bodies[pair.second];
    if (areNearer(a, b, distance) || isInside(a, b) || isInside(b, a)) return true;
  }
  return false;
}

}  // namespace adaptive_bvh
