#include <cmath>

#include "base/leased.h"
#include "dispatch/contained.h"
#include "dispatch/pairs.h"
#include "dispatch/shape_search.h"
#include "query/depth/depth_meshes.h"
#include "query/nearest/nearest_search.h"
#include "query/single_precision.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

/// Whether two bodies are nearer than `best` is; then `best` has their distance. `witness`:
/// elements that may be near, or -1.
template <typename S>
bool improve(const Body<S>& a, const Body<S>& b, const std::array<int, 2>& witness,
             SceneDistance<S>& best) {
  fcl::DistanceRequest<S> request(true);
  fcl::DistanceResult<S> result(best.distance);
  bool is_in_order = true;
  if (a.mesh && b.mesh) {
    const PlacedMesh first(*a.mesh, a.tf), second(*b.mesh, b.tf);
    answerInDouble(DistanceQuery<S>{request, result}, a.geometry, b.geometry,
                   [&](const DistanceQuery<double>& query) {
                     NearestPair nearest(first, second, query);
                     nearest.addWitness(witness[0], witness[1]);
                     NearestSearch(first, second, nearest).run();
                   });
    if (!result.o1) return false;
  } else {
    const QueryObject first(objectOf(a)), second(objectOf(b));
    const PairSearch& pair = searchOf(first.kind(), second.kind());
    is_in_order = !pair.is_swapped;
    answerInDouble(DistanceQuery<S>{request, result}, a.geometry, b.geometry,
                   [&](const DistanceQuery<double>& query) {
                     pair.distance(is_in_order ? first : second, is_in_order ? second : first,
                                   query);
                   });
    if (!(result.min_distance < best.distance)) return false;
  }
  best.bodies = {a.id, b.id};
  best.distance = result.min_distance;
  best.points = {result.nearest_points[0], result.nearest_points[1]};
  best.elements = {int(result.b1), int(result.b2)};
  if (!is_in_order) {
    std::swap(best.points[0], best.points[1]);
    std::swap(best.elements[0], best.elements[1]);
  }
  return true;
}

/// Whether a leaf of a mesh may be at most so far from the box of another body.
template <typename S>
bool hasNearLeaf(const Body<S>& mesh, const WorldBox& box, double distance) {
  ShapeCore core;
  core.low = box.low;
  core.high = box.high;
  const WideTree& tree = stateOf(*mesh.mesh).tree;
  const ShapeInTree in_tree(core, fcl::Transform3d::Identity(), tree,
                            mesh.tf.template cast<double>());
  if (!in_tree.isPrecise()) return true;
  const float limit = in_tree.squaredLimit(distance);
  return TreeWalk(tree).nearestFirst(
      [&](const WideNode& node) -> Float4 { return in_tree.squaredGaps(node.boxes); },
      [&] { return limit; }, [](const WideNode&, unsigned, const Float4&) { return true; });
}

}  // namespace

template <typename S>
SceneDistance<S> Scene<S>::nearest(BodyId body) {
  State& state = *state_;
  state.requireCurrent();
  Body<S>& asked = state.bodies[state.placeOf(body)];
  SceneDistance<S> best;
  const auto tryBody = [&](const Body<S>& other, const std::array<int, 2>& witness) {
    if (&other != &asked && state.admits(asked, other)) improve(asked, other, witness, best);
  };
  const auto& last = asked.witness;
  const bool has_witness = last.exists && state.contains(last.other);
  if (has_witness) tryBody(state.bodies[state.placeOf(last.other)], last.elements);
  const auto tryOthers = [&](const Body<S>& other) {
    const double limit = State::slack(double(best.distance));
    const bool is_tried = has_witness && other.id == last.other;
    const bool is_far = asked.mesh && !hasNearLeaf(asked, other.box, limit);
    if (!is_tried && !is_far) tryBody(other, {-1, -1});
    return State::slack(double(best.distance));
  };
  state.visitByDistance(asked.box, tryOthers);
  if (best.exists()) asked.witness = {true, best.bodies.second, best.elements};
  return best;
}

template <typename S>
void Scene<S>::nearest(BodyId body, std::size_t k, std::vector<SceneDistance<S>>& result) const {
  const State& state = *state_;
  state.requireCurrent();
  const Body<S>& asked = state.bodies[state.placeOf(body)];
  result.clear();
  if (k == 0) return;
  const auto isLess = [](const SceneDistance<S>& a, const SceneDistance<S>& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.bodies.second < b.bodies.second;
  };
  const auto tryBody = [&](const Body<S>& other) {
    constexpr S kFar = std::numeric_limits<S>::infinity();
    const bool is_full = result.size() == k;
    if (&other != &asked && state.admits(asked, other)) {
      SceneDistance<S> found;
      if (is_full) found.distance = std::nextafter(result.back().distance, kFar);
      if (improve(asked, other, {-1, -1}, found)) {
        if (!is_full || isLess(found, result.back())) {
          if (is_full) result.pop_back();
          result.insert(std::upper_bound(result.begin(), result.end(), found, isLess), found);
        }
      }
    }
    return result.size() == k ? State::slack(double(result.back().distance)) : double(kFar);
  };
  state.visitByDistance(asked.box, tryBody);
}

template <typename S>
SceneDistance<S> Scene<S>::distance() {
  State& state = *state_;
  state.requireCurrent();
  SceneDistance<S> best;
  const SceneDistance<S> last = state.nearest;  // a filter may ask for the distance, too
  if (last.exists() && state.contains(last.bodies.first) && state.contains(last.bodies.second)) {
    const Body<S>&a = state.bodies[state.placeOf(last.bodies.first)],
          &b = state.bodies[state.placeOf(last.bodies.second)];
    if (state.admits(a, b)) improve(a, b, last.elements, best);
  }
  for (std::size_t i = 0; i < state.bodies.size() && !best.exists(); ++i)
    best = nearest(state.bodies[i].id);
  if (best.exists() && best.bodies.second < best.bodies.first) {
    std::swap(best.bodies.first, best.bodies.second);
    std::swap(best.points[0], best.points[1]);
    std::swap(best.elements[0], best.elements[1]);
  }
  struct Candidate {
    double gap;
    BodyPair pair;
  };
  if (!best.exists()) return best;
  const Leased<std::vector<BodyPair>> pairs;
  const Leased<std::vector<Candidate>> leased;
  std::vector<Candidate>& candidates = *leased;
  state.findPairs(double(best.distance), 0, *pairs);
  candidates.clear();
  for (const BodyPair& pair : *pairs) {
    const WorldBox &a = state.bodies[pair.first].box, &b = state.bodies[pair.second].box;
    candidates.push_back({a.isBounded() && b.isBounded() ? gapOf(a, b) : 0, pair});
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.gap != b.gap ? a.gap < b.gap : a.pair < b.pair;
  });
  for (const Candidate& c : candidates) {
    if (c.gap > State::slack(double(best.distance))) break;
    improve(state.bodies[c.pair.first], state.bodies[c.pair.second], {-1, -1}, best);
  }
  state.nearest = best;
  return best;
}

namespace {

/// Whether a body is inside of a solid one, whose surface it does not touch.
template <typename S>
bool isInside(const Body<S>& inner, const Body<S>& around) {
  if (!around.options.solid) return false;
  const PlacedMesh solid(*around.mesh, around.tf);
  const QueryObject object(objectOf(inner));
  if (object.kind() == ObjectKind::Mesh) return isContained(object.mesh(), solid);
  return object.kind() == ObjectKind::Shape && isContained(object.solid(), solid);
}

}  // namespace

template <typename S>
bool Scene<S>::isNearer(S distance) const {
  const State& state = *state_;
  requireDistance(distance);
  state.requireCurrent();
  const Leased<std::vector<BodyPair>> pairs;
  state.findPairs(double(distance), 0, *pairs);
  for (const BodyPair& pair : *pairs) {
    const Body<S>*a = &state.bodies[pair.first], *b = &state.bodies[pair.second];
    if (b->mesh && !a->mesh) std::swap(a, b);
    if (b->mesh) {
      if (adaptive_bvh::isNearer(*a->mesh, a->tf, *b->mesh, b->tf, distance)) return true;
    } else if (!a->mesh || b->geometry->getNodeType() == fcl::GEOM_OCTREE) {
      SceneDistance<S> found;
      found.distance = std::nextafter(distance, std::numeric_limits<S>::infinity());
      if (improve(*a, *b, {-1, -1}, found)) return true;
    } else if (adaptive_bvh::isNearer(*a->mesh, a->tf, *b->geometry, b->tf, distance)) {
      return true;
    }
    if (isInside(*a, *b) || isInside(*b, *a)) return true;
  }
  return false;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template SceneDistance<S> Scene<S>::nearest(BodyId);                                        \
  template void Scene<S>::nearest(BodyId, std::size_t, std::vector<SceneDistance<S>>&) const; \
  template SceneDistance<S> Scene<S>::distance();                                             \
  template bool Scene<S>::isNearer(S) const;
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
