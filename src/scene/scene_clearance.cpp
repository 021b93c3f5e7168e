// Least distances of a scene's bodies over a step, and the times at which they are too near.
#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "base/leased.h"
#include "base/task_pool.h"
#include "ccd/clearance_search.h"
#include "scene/scene_state.h"
#include "scene/stepping_body.h"

namespace adaptive_bvh {
namespace {

/// Throws std::invalid_argument if a body is an octree or may pair with one; any body if that is
/// null.
void requireNoOctree(const SceneState& scene, const Body* body) {
  for (const Body& octree : scene.bodies) {
    if (!octree.isOctree()) continue;
    const auto pairs = [&](const Body& other) {
      return (!body || body == &other) && &octree != &other && scene.admits(octree, other);
    };
    if (body == &octree || std::any_of(scene.bodies.begin(), scene.bodies.end(), pairs))
      throw std::invalid_argument("adaptive_bvh: body " + std::to_string(octree.id) +
                                  " is an octree, which has no clearance over a motion; give it a "
                                  "group that this query leaves out");
  }
}

/// The box around a body's motion on a screw, by spheres around parts of it.
WorldBox boxOfSpheres(const MovingBody& moving) {
  constexpr int kParts = 8;
  WorldBox box;
  for (int i = 0; i <= kParts; ++i) {
    const fcl::Vector3d middle = moving.at(double(i) / kParts).frame(moving.middle());
    box = i == 0 ? WorldBox{middle, middle} : aroundBoth(box, {middle, middle});
  }
  const double margin =
      (moving.radius() + moving.arc(1. / kParts) + 2 * moving.error()) * (1 + 1e-12);
  return {box.low.array() - margin, box.high.array() + margin};
}

/// The box around a body's motion; unbounded for a plane or half-space.
WorldBox sweptBox(const Body& body, FramePath path) {
  if (path == FramePath::Straight || !body.box.isBounded() || body.isOctree())
    return sweptBox(body);
  const SteppingBody stepping(body, path);
  return stepping.moving().frame().isScrew() ? boxOfSpheres(stepping.moving()) : sweptBox(body);
}

/// Boxes that together hold the motion of a body, which `whole` holds: those of the upper nodes of
/// a mesh. A hose is in few places of its box.
std::vector<WorldBox> boxesOf(BoxedBody& boxed, const WorldBox& whole) {
  const MovingBody& body = boxed.body;
  if (!body.mesh() || body.acceleration() > 0) return {whole};
  const double scale = walkScale(body);
  boxed.prepare(scale, 0, 1);
  MovingBoxes& boxes = boxed.boxes();
  constexpr int kLevels = 2;
  std::vector<int> nodes = {0}, below;
  for (int level = 0; level < kLevels; ++level, nodes.swap(below)) {
    below.clear();
    for (const int node : nodes) {
      const WideNode& links = boxes.links()[node];
      if (links.isLeaf()) below.push_back(node);
      for (int i = 0; i < int(links.count) && !links.isLeaf(); ++i) below.push_back(links.below[i]);
    }
  }
  std::vector<WorldBox> result;
  for (const int node : nodes) {
    const MovingNode& moving = boxes[node];
    for (int i = 0; i < int(boxes.links()[node].count); ++i) {
      WorldBox ends[2];
      for (int e = 0; e < 2; ++e)
        for (int k = 0; k < 3; ++k) {
          ends[e].low[k] = double(moving.at[e].low[k][i]) / scale + boxes.origin(e)[k];
          ends[e].high[k] = double(moving.at[e].high[k][i]) / scale + boxes.origin(e)[k];
        }
      result.push_back(aroundBoth(ends[0], ends[1]));
    }
  }
  return result;
}

/// A candidate of a query, by a lower bound of its distance.
struct Candidate {
  double gap;  ///< between boxes around the motions: of the first body as a whole, or of its nodes
  unsigned index;
  bool is_of_nodes;

  /// Heap order, from the top: smaller bounds, then smaller indices.
  friend bool operator<(const Candidate& a, const Candidate& b) {
    return a.gap != b.gap ? a.gap > b.gap : a.index > b.index;
  }
};

double leastGap(const std::vector<WorldBox>& boxes, const WorldBox& other) {
  double least = std::numeric_limits<double>::infinity();
  for (const WorldBox& box : boxes) least = std::min(least, gapOf(box, other));
  return least;
}

/// Memory of a query of one pair.
struct PairMemory {
  MovingBoxes first, second;
};

/// Finds the bodies that come nearest to one body.
class NearestOverStep {
 public:
  NearestOverStep(const SceneState& scene, const Body& body, double tolerance, FramePath path)
      : scene_(scene),
        first_(body, path),
        tolerance_(tolerance),
        path_(path),
        boxed_(first_.moving(), memory_->first) {}

  /// Lowers `best` to the distance of the triangles that were found last.
  void lowerToKept(SceneClearance& best) {
    const SceneDistance kept = first_.body.nearest.found;  // a filter may change it
    if (!kept.exists() || !scene_.contains(kept.bodies.second)) return;
    const Body& other = scene_.bodies[scene_.indexOf(kept.bodies.second)];
    if (!isTriangle(first_.body, kept.elements[0]) || !isTriangle(other, kept.elements[1]) ||
        !scene_.admits(first_.body, other))
      return;
    const SteppingBody second(other, path_);
    BoxedBody boxed(second.moving(), memory_->second);
    const ClearanceQuery query = {boxed_, boxed, tolerance_};
    requireTolerable(query);
    lowerToTriangles(query, kept.elements, best.clearance);
    if (best.exists()) best.bodies = {first_.body.id, other.id};
  }

  /// Calls visit(other) for the bodies nearer than a limit, by increasing gap. It returns the
  /// distance beyond which no bodies are needed.
  template <typename Visit>
  void visit(double limit, const Visit& visit) {
    const WorldBox box = sweptBox(first_.body, path_);
    findCandidates(box, limit);
    if (box.isBounded()) boxes_ = boxesOf(boxed_, box);
    while (!candidates_.empty() && candidates_.front().gap <= limit) {
      std::pop_heap(candidates_.begin(), candidates_.end());
      Candidate& next = candidates_.back();
      const Body& other = scene_.bodies[next.index];
      if (!next.is_of_nodes) {
        next.gap = leastGap(boxes_, sweptBox(other, path_));
        next.is_of_nodes = true;
        std::push_heap(candidates_.begin(), candidates_.end());
        continue;
      }
      candidates_.pop_back();
      const SteppingBody second(other, path_);
      if (!(first_.isFlat() && second.isFlat())) limit = visit(second);
    }
  }
  /// Lowers best.clearance if the other body comes nearer than that less the tolerance.
  bool lower(const SteppingBody& other, SceneClearance& best) {
    BoxedBody second(other.moving(), memory_->second);
    const bool swaps = orderOf(first_.moving()) > orderOf(other.moving());
    const ClearanceQuery query = {swaps ? second : boxed_, swaps ? boxed_ : second, tolerance_};
    requireTolerable(query);
    if (!lowerClearance(query, best.clearance)) return false;
    best.bodies = {first_.body.id, other.body.id};
    if (swaps) swapBodies(best.clearance);
    return true;
  }

 private:
  static bool isTriangle(const Body& body, int element) {
    return body.isMesh() && element >= 0 && element < body.mesh().numTriangles();
  }
  /// Finds the other bodies whose boxes are at most `limit` from a box.
  void findCandidates(const WorldBox& box, double limit) {
    for (unsigned i = 0; i < scene_.bodies.size(); ++i) {
      const Body& other = scene_.bodies[i];
      if (&other == &first_.body) continue;
      const bool is_bounded = box.isBounded() && other.box.isBounded();
      const double gap = is_bounded ? gapOf(box, sweptBox(other, path_)) : 0;
      if (gap <= limit && scene_.admits(first_.body, other))
        candidates_.push_back({gap, i, !is_bounded});
    }
    std::make_heap(candidates_.begin(), candidates_.end());
  }

  const SceneState& scene_;
  const SteppingBody first_;
  const double tolerance_;
  const FramePath path_;
  const Leased<PairMemory> memory_;
  BoxedBody boxed_;
  std::vector<WorldBox> boxes_;        ///< around the motion of the first body
  std::vector<Candidate> candidates_;  ///< a heap
};

bool isNearerClearance(const SceneClearance& a, const SceneClearance& b) {
  return a.clearance.upper != b.clearance.upper ? a.clearance.upper < b.clearance.upper
                                                : a.bodies.second < b.bodies.second;
}

/// Finds the intervals of one pair of bodies.
void intervalsOf(const Body& a, const Body& b, double clearance, double tolerance, FramePath path,
                 std::vector<MotionInterval>& intervals) {
  const SteppingBody first(a, path), second(b, path);
  if (first.isFlat() && second.isFlat()) return;
  const Leased<PairMemory> memory;
  BoxedBody boxed1(first.moving(), memory->first), boxed2(second.moving(), memory->second);
  const bool swaps = orderOf(first.moving()) > orderOf(second.moving());
  const ClearanceQuery query = {swaps ? boxed2 : boxed1, swaps ? boxed1 : boxed2, tolerance};
  requireTolerable(query);
  findIntervalsBelow(query, clearance, intervals);
}

}  // namespace

SceneClearance SceneState::leastDistance(BodyId body, double tolerance, FramePath path) const {
  requireCurrent();
  const Body& first = bodies[indexOf(body)];
  requireNoOctree(*this, &first);
  NearestOverStep search(*this, first, tolerance, path);
  SceneClearance best;
  search.lowerToKept(best);
  const double limit =
      best.exists() ? best.clearance.upper - tolerance : std::numeric_limits<double>::infinity();
  search.visit(limit, [&](const SteppingBody& other) {
    search.lower(other, best);
    return best.clearance.upper - tolerance;
  });
  return best;
}

void SceneState::keepNearest(BodyId body, const SceneClearance& found) {
  KeptDistance& kept = bodies[indexOf(body)].nearest;
  if (!found.exists() || kept.epoch == epoch) return;
  kept = {};
  kept.found.bodies = found.bodies;
  kept.found.distance = found.clearance.upper;
  kept.found.elements = found.clearance.triangles;
}

/// A body beyond the first k is compared with the last of these.
void SceneState::leastDistances(BodyId body, std::size_t k, double tolerance, FramePath path,
                                std::vector<SceneClearance>& result) const {
  requireCurrent();
  const Body& first = bodies[indexOf(body)];
  requireNoOctree(*this, &first);
  NearestOverStep search(*this, first, tolerance, path);
  result.clear();
  if (k == 0) return;
  search.visit(std::numeric_limits<double>::infinity(), [&](const SteppingBody& other) {
    const bool is_full = result.size() == k;
    SceneClearance found;
    if (is_full) found.clearance.upper = result.back().clearance.upper;
    if (search.lower(other, found)) {
      if (is_full) result.pop_back();
      result.insert(std::upper_bound(result.begin(), result.end(), found, isNearerClearance),
                    found);
    }
    return result.size() == k ? result.back().clearance.upper - tolerance
                              : std::numeric_limits<double>::infinity();
  });
}

void SceneState::intervalsBelow(double clearance, double tolerance, FramePath path,
                                SceneIntervals& result) const {
  requireClearance(clearance);
  requireCurrent();
  requireNoOctree(*this, nullptr);
  std::vector<WorldBox> swept;
  for (const Body& body : bodies) swept.push_back(sweptBox(body, path));
  std::vector<BodyPair> pairs;
  findSweptPairs(swept, clearance, pairs);
  std::vector<std::vector<MotionInterval>> found(pairs.size());
  const TaskPool pool(pairs.size() > 1 ? threads : 1);
  pool.forEach(static_cast<int>(pairs.size()), [&](int task, int) {
    const auto i = static_cast<std::size_t>(task);
    intervalsOf(bodies[pairs[i].first], bodies[pairs[i].second], clearance, tolerance, path,
                found[i]);
  });
  result.pairs.clear();
  result.found.clear();
  result.begins.assign(1, 0);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (found[i].empty()) continue;
    result.pairs.push_back({bodies[pairs[i].first].id, bodies[pairs[i].second].id});
    result.found.insert(result.found.end(), found[i].begin(), found[i].end());
    result.begins.push_back(result.found.size());
  }
}

}  // namespace adaptive_bvh
