#include "scene/scene_state.h"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>

#include "base/task_pool.h"

// Bodies of a scene: the update of their bounds, and which pairs count.
namespace adaptive_bvh {
namespace {

BodyPair sorted(BodyId a, BodyId b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

/// The first body whose id is not less than `id`.
std::vector<Body>::const_iterator SceneState::find(BodyId id) const {
  return std::lower_bound(bodies.begin(), bodies.end(), id,
                          [](const Body& body, BodyId x) { return body.id < x; });
}

std::size_t SceneState::indexOf(BodyId id) const {
  const auto found = find(id);
  if (found == bodies.end() || found->id != id)
    throw std::invalid_argument("adaptive_bvh: there is no body " + std::to_string(id) +
                                " in the scene");
  return static_cast<std::size_t>(found - bodies.begin());
}

bool SceneState::contains(BodyId id) const {
  const auto found = find(id);
  return found != bodies.end() && found->id == id;
}

bool SceneState::isAsUpdated() const {
  return is_current && std::all_of(bodies.begin(), bodies.end(), [](const Body& body) {
           return !body.isMesh() || body.mesh().version == body.mesh_version;
         });
}

bool SceneState::hasVersionsOnly() const {
  return std::all_of(bodies.begin(), bodies.end(), [](const Body& body) { return body.isMesh(); });
}

void SceneState::requireCurrent() const {
  if (!isAsUpdated())
    throw std::logic_error(
        "adaptive_bvh: the scene has changed since its last update; call update of the scene "
        "before "
        "queries");
}

/// With fewer bodies, one thread is faster than several.
constexpr std::size_t kParallelBodies = 64;

void SceneState::setChanged() {
  static std::atomic<std::uint64_t> last{0};
  version = last.fetch_add(1, std::memory_order_relaxed) + 1;
  ++epoch;
}

void SceneState::update() {
  const bool has_versions = hasVersionsOnly();
  if (has_versions && isAsUpdated()) return;
  if (!has_versions) ++epoch;
  for (const Body& body : bodies)
    if (body.isMesh() && body.mesh().version != body.mesh_version) {
      setChanged();
      break;
    }
  const TaskPool pool(bodies.size() >= kParallelBodies ? threads : 1);
  is_current = false;  // stays false if std::bad_alloc is thrown below
  pool.forEachPart(static_cast<int>(bodies.size()), pool.parts(), [&](int i, int end, int) {
    for (; i < end; ++i) updateBounds(bodies[static_cast<std::size_t>(i)]);
  });
  assign(
      bodies.size(), [&](unsigned i) -> auto& { return bodies[i].box; });
  updateTree();
  is_current = true;
}

void SceneState::ignore(BodyId first, BodyId second) {
  indexOf(first);
  indexOf(second);
  const BodyPair pair = sorted(first, second);
  const auto place = std::lower_bound(ignored.begin(), ignored.end(), pair);
  if (place == ignored.end() || *place != pair) ignored.insert(place, pair);
  setChanged();
}
void SceneState::unignore(BodyId first, BodyId second) {
  indexOf(first);
  indexOf(second);
  const BodyPair pair = sorted(first, second);
  const auto place = std::lower_bound(ignored.begin(), ignored.end(), pair);
  if (place != ignored.end() && *place == pair) ignored.erase(place);
  setChanged();
}
void SceneState::ignoreNeighbours(const std::vector<BodyId>& chain) {
  for (const BodyId body : chain) indexOf(body);
  ignored.reserve(ignored.size() + chain.size());  // nothing is thrown after this
  for (std::size_t i = 1; i < chain.size(); ++i) ignore(chain[i - 1], chain[i]);
}
void SceneState::forget(BodyId body) {
  const auto names = [&](const BodyPair& pair) {
    return pair.first == body || pair.second == body;
  };
  ignored.erase(std::remove_if(ignored.begin(), ignored.end(), names), ignored.end());
}

bool SceneState::admits(const Body& a, const Body& b) const {
  if (!(a.options.group & b.options.mask) || !(b.options.group & a.options.mask)) return false;
  const BodyPair pair = sorted(a.id, b.id);
  if (std::binary_search(ignored.begin(), ignored.end(), pair)) return false;
  return !filter || filter(pair.first, pair.second);
}

/// Finds the admitted pairs of near boxes that pass test(a, b).
template <typename Test>
void SceneState::findAdmitted(const BodyBoxes& near, double distance, const Test& test,
                              std::vector<BodyPair>& pairs) const {
  pairs.clear();
  near.forEachPair(distance, [&](unsigned a, unsigned b) {
    if (test(bodies[a], bodies[b]) && admits(bodies[a], bodies[b]))
      pairs.push_back({std::min(a, b), std::max(a, b)});
  });
  std::sort(pairs.begin(), pairs.end());
}

void SceneState::findPairs(double distance, int meshes, std::vector<BodyPair>& pairs) const {
  const double limit = slack(distance);
  const auto test = [&](const Body& a, const Body& b) {
    const double radii = (a.radius + b.radius + limit) * (1 + 1e-14);
    return int(a.isMesh()) + int(b.isMesh()) >= meshes &&
           !((a.middle - b.middle).squaredNorm() > radii * radii);  // NaN if one is unbounded
  };
  findAdmitted(*this, limit, test, pairs);
}

void SceneState::findSweptPairs(FramePath path, double distance,
                                std::vector<BodyPair>& pairs) const {
  const Leased<BodyBoxes> memory;
  memory->assign(bodies.size(), [&](unsigned i) { return sweptBox(bodies[i], path); });
  memory->updateTree();
  const auto test = [](const Body& a, const Body& b) {  // not two planes or half-spaces
    return a.box.isBounded() || b.box.isBounded();
  };
  findAdmitted(*memory, slack(distance), test, pairs);
}

void SceneState::addSelfPairs(std::vector<BodyPair>& pairs) const {
  const std::size_t before = pairs.size();
  for (unsigned i = 0; i < bodies.size(); ++i)
    if (bodies[i].options.self_collision) pairs.push_back({i, i});
  std::inplace_merge(pairs.begin(), pairs.begin() + std::ptrdiff_t(before), pairs.end());
}

}  // namespace adaptive_bvh
