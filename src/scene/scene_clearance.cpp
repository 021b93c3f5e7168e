// Least distances of a scene's bodies over a step, and the times at which they are too near.
#include <algorithm>
#include <limits>
#include <utility>

#include "base/rigid.h"
#include "base/task_pool.h"
#include "ccd/clearance_search.h"
#include "scene/scene_state.h"
#include "scene/stepping_body.h"

namespace adaptive_bvh {
namespace {

/// Finds the bodies that come nearest to one body.
class NearestOverStep {
 public:
  NearestOverStep(const SceneState& scene, const Body& body, double tolerance, FramePath path)
      : scene_(scene), tolerance_(tolerance), path_(path), first_(body, path) {
    requireTolerable(tolerance, 0);
  }

  /// Lowers `best` to the distance of the triangles that were found last.
  void lowerToKept(SceneClearance& best) {
    const SceneDistance kept = first_.body.nearest.found;  // a filter may change it
    if (!kept.exists() || !scene_.contains(kept.bodies.second)) return;
    const Body& other = scene_.bodies[scene_.indexOf(kept.bodies.second)];
    if (!isTriangle(first_.body, kept.elements[0]) || !isTriangle(other, kept.elements[1]) ||
        !scene_.admits(first_.body, other))
      return;
    SteppingBody second(other, path_);
    const ClearanceQuery query = {first_.whole(), second.whole(), tolerance_};
    requireTolerable(query);
    lowerToTriangles(query, kept.elements, best.clearance);
    if (best.exists()) best.bodies = {first_.body.id, other.id};
  }

  /// Calls visit(other) for the bodies nearer than a limit, by increasing gap. It returns the
  /// distance beyond which no bodies are needed.
  template <typename Visit>
  void visit(double limit, const Visit& visit) {
    findCandidates(limit);
    for (const auto& [gap, index] : candidates_) {
      if (gap > limit) return;
      SteppingBody second(scene_.bodies[index], path_);
      limit = visit(second);
    }
  }
  /// Lowers best.clearance if the other body comes nearer than that less the tolerance.
  bool lower(SteppingBody& other, SceneClearance& best) {
    MotionClearance& least = best.clearance;
    bool is_lower = false;
    const auto limit = [&] { return least.upper - tolerance_; };
    visitParts(first_, other, tolerance_, limit, [&](const ClearanceQuery& query) {
      requireTolerable(query);
      if (lowerClearance(query, least)) is_lower = true;
    });
    if (!is_lower) return false;
    best.bodies = {first_.body.id, other.body.id};
    // Cells that meet later, or not, may have hidden the one that meets first.
    if (least.upper <= tolerance_ && (first_.body.isOctree() || other.body.isOctree()))
      lowerToImpact(first_, other, 0, least);
    return true;
  }

 private:
  static bool isTriangle(const Body& body, int element) {
    return body.isMesh() && element >= 0 && element < body.mesh().numTriangles();
  }
  /// Finds the other bodies at most `limit` away, by boxes around the motions.
  void findCandidates(double limit) {
    const WorldBox box = sweptBox(first_.body, path_);
    for (unsigned i = 0; i < scene_.bodies.size(); ++i) {
      const Body& other = scene_.bodies[i];
      if (&other == &first_.body || !(box.isBounded() || other.box.isBounded())) continue;
      const WorldBox swept = sweptBox(other, path_);
      if (gapOf(box, swept) > limit || !scene_.admits(first_.body, other)) continue;
      const double gap = first_.gapTo(swept);
      if (gap <= limit) candidates_.emplace_back(gap, i);
    }
    std::sort(candidates_.begin(), candidates_.end());
  }

  const SceneState& scene_;
  const double tolerance_;
  const FramePath path_;
  SteppingBody first_;
  std::vector<std::pair<double, unsigned>> candidates_;  ///< lower bounds of distances, and bodies
};

bool isNearerClearance(const SceneClearance& a, const SceneClearance& b) {
  return a.clearance.upper != b.clearance.upper ? a.clearance.upper < b.clearance.upper
                                                : a.bodies.second < b.bodies.second;
}

/// Inserts intervals into disjoint ones in order. Those that touch become one.
void unite(const std::vector<MotionInterval>& more, std::vector<MotionInterval>& all) {
  all.insert(all.end(), more.begin(), more.end());
  std::sort(all.begin(), all.end(),
            [](const MotionInterval& a, const MotionInterval& b) { return a.begin < b.begin; });
  std::size_t count = 0;
  for (const MotionInterval next : all) {
    if (count > 0 && next.begin <= all[count - 1].end)
      all[count - 1].end = std::max(all[count - 1].end, next.end);
    else
      all[count++] = next;
  }
  all.resize(count);
}

/// Finds the intervals of one pair of bodies: those of its parts together.
void intervalsOf(const Body& a, const Body& b, double clearance, double tolerance, FramePath path,
                 std::vector<MotionInterval>& intervals) {
  SteppingBody first(a, path), second(b, path);
  std::vector<MotionInterval> of_parts;
  const auto limit = [&] {
    const bool is_whole = !intervals.empty() && intervals[0].begin == 0 && intervals[0].end == 1;
    return is_whole ? -1 : clearance;
  };
  visitParts(first, second, tolerance, limit, [&](const ClearanceQuery& query) {
    requireTolerable(query);
    findIntervalsBelow(query, clearance, of_parts);
    unite(of_parts, intervals);
  });
}

}  // namespace

SceneClearance SceneState::leastDistance(BodyId body, double tolerance, FramePath path) const {
  requireCurrent();
  NearestOverStep search(*this, bodies[indexOf(body)], tolerance, path);
  SceneClearance best;
  search.lowerToKept(best);
  search.visit(best.clearance.upper - tolerance, [&](SteppingBody& other) {
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
  kept.found.elements = found.clearance.elements;
}

/// A body beyond the first k is compared with the last of these.
void SceneState::leastDistances(BodyId body, std::size_t k, double tolerance, FramePath path,
                                std::vector<SceneClearance>& result) const {
  requireCurrent();
  NearestOverStep search(*this, bodies[indexOf(body)], tolerance, path);
  result.clear();
  if (k == 0) return;
  search.visit(std::numeric_limits<double>::infinity(), [&](SteppingBody& other) {
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
  requireSeparation(clearance);
  requireTolerable(tolerance, 0);
  requireCurrent();
  std::vector<BodyPair> pairs;
  findSweptPairs(path, clearance, pairs);
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
