#include <algorithm>
#include <optional>

#include "adaptive_bvh/proximity.h"
#include "query/close_triangles.h"
#include "query/motion_sample.h"
#include "query/nearest_known.h"
#include "query/rigid_motion.h"
#include "query/surroundings.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
struct CoherentProximity<BV>::State {
  const AdaptiveBVHModel<BV>&first, &second;
  RigidMotion<S> rigid = {};
  std::uint64_t generations[2] = {0, 0};
  /// How far the models have moved, in all, when the bound was found; and at the last look.
  double moved_then = 0, moved = 0;
  double step = 0;    ///< in a call, lately; 0 when they were first looked at
  double bound = -1;  ///< of their distance then; negative where there is none
  std::size_t searches = 0;
  PairCache<BV> cache = {0, 0, false, Front<BV>()};
  /// Leaves that were near when a search last said that there are such.
  std::optional<LeafPair> near = std::nullopt;
  LeavesOfTriangles leaves[2] = {};
  MotionSample<BV> sample = {};
  std::optional<double> least_step = std::nullopt;  ///< as the sample has it
  int calls = 0;                                    ///< since `moved` was brought up to date

  TrianglePair witness() const { return {unsigned(cache.witness1), unsigned(cache.witness2)}; }
  void setWitness(const TrianglePair& witness) {
    cache.witness1 = static_cast<int>(witness.first);
    cache.witness2 = static_cast<int>(witness.second);
  }
  /// `witness`: are near.
  bool setNear(const PairOfMeshes<BV>& meshes, const TrianglePair& witness) {
    setWitness(witness);
    leaves[0].adopt(meshes.first);
    leaves[1].adopt(meshes.second);
    near = {leaves[0].leaf(witness.first), leaves[1].leaf(witness.second)};
    return true;
  }
  /// Whether around those leaves there still are some that are near.
  bool isStillNear(const PairOfMeshes<BV>& meshes, double distance) {
    const bool are_same =
        near && leaves[0].isCurrent(meshes.first) && leaves[1].isCurrent(meshes.second);
    if (are_same && Surroundings<BV>(meshes, *near).find(distance, *near)) return true;
    near.reset();
    return false;
  }

  /// Whether a bound is worth to be kept: where it may last for some steps. Else it costs more to
  /// bring boxes up to date in each than to search the four-wide trees. Before there was a step,
  /// balls around the models tell.
  bool isBoundWorth(const PairOfMeshes<BV>& meshes, double distance) const {
    const double room = meshes.gap(witness()).distance - distance;
    const bool may_last = least_step ? !(room <= kSteps * *least_step) : areApart(meshes, distance);
    return may_last || !isFewEdges(meshes, distance);
  }
  /// Brings `moved` and `step` up to date.
  void move(const PairOfMeshes<BV>& meshes) {
    for (const PlacedMesh<BV>* mesh : {&meshes.first, &meshes.second})
      if (mesh->hasBoxes()) updateBoxes(*mesh);
    const std::uint64_t now[2] = {meshes.first.tree->generation, meshes.second.tree->generation};
    const bool same_trees = std::equal(now, now + 2, generations);
    std::copy(now, now + 2, generations);
    const bool goes_on =
        rigid.moveTo(meshes.first.tf, first, meshes.second.tf, second) && same_trees;
    if (!goes_on || !meshes.first.hasBoxes() || !meshes.second.hasBoxes()) bound = -1;
    const double before = moved;
    moved = rigid.sum() + motionOf(meshes.first) + motionOf(meshes.second);
    step = goes_on ? std::max(moved - before, 0.) / calls : 0;
    calls = 0;
  }
  /// Whether what is known says that nothing is as near as that. The sums of motion are rounded up;
  /// their sum and difference by less than the last term.
  bool isSurelyFarther(double distance) const {
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return bound >= 0 && bound > distance + (moved - moved_then) + kRounding * (moved + bound);
  }

  /// By the four-wide trees, which need no boxes.
  bool searchNear(const PairOfMeshes<BV>& meshes, double distance) {
    NearestKnown<BV> known(meshes);
    if (known.isNearer(distance)) return setNear(meshes, known.triangles());
    ++searches;
    const TrianglePair close = closeTriangles(meshes);
    const double apart = meshes.gap(close).distance;
    if (apart <= distance) return setNear(meshes, close);
    if (known.searchNearer(distance)) return setNear(meshes, known.triangles());
    if (apart < meshes.gap(witness()).distance) setWitness(close);
    return false;
  }
  /// And for a bound: as much farther as many steps like the last one could use up, or a part of
  /// what two triangles are that are known.
  bool searchBound(const PairOfMeshes<BV>& meshes, double distance) {
    const double least = distance + (isFewEdges(meshes, distance) ? usedUpBySteps() : 0);
    return canCompareByBoxes(meshes, least) ? searchByBoxes(meshes, distance, least)
                                            : searchByTrees(meshes, distance);
  }

 private:
  static constexpr double kSteps = 8;  ///< as many a bound is to last at least

  double usedUpBySteps() const { return kSteps * std::max(step, least_step.value_or(0)); }
  void setBound(double farther_than) {
    bound = farther_than;
    moved_then = moved;
  }
  static bool areApart(const PairOfMeshes<BV>& meshes, double distance) {
    const auto &a = *meshes.first.model, &b = *meshes.second.model;
    const fcl::Vector3d way =
        meshes.to_first(b.aabb_center) - a.aabb_center.template cast<double>();
    return way.norm() > distance + double(a.aabb_radius) + double(b.aabb_radius);
  }
  /// Ends when there is a pair within `least`, so that a bound would not last.
  bool searchByBoxes(const PairOfMeshes<BV>& meshes, double distance, double least) {
    const double room = meshes.gap(witness()).distance - distance;
    if (room <= 0) return setNear(meshes, witness());
    S farther = static_cast<S>(distance + std::max(2 * usedUpBySteps(), room / 2));
    const std::optional<bool> is_nearer =
        compareByBoxes(meshes.first, meshes.second, static_cast<S>(least), false, cache, farther);
    if (is_nearer && !*is_nearer) {
      ++searches;
      setBound(static_cast<double>(farther));
      return false;
    }
    if (meshes.gap(witness()).distance > distance) return searchNear(meshes, distance);
    ++searches;
    return setNear(meshes, witness());
  }
  bool searchByTrees(const PairOfMeshes<BV>& meshes, double distance) {
    NearestKnown<BV> known(meshes);
    if (known.isNearer(distance)) return setNear(meshes, known.triangles());
    ++searches;
    const double room = known.distance() - distance;
    double farther = distance + std::clamp(2 * usedUpBySteps(), room / 64, room / 2);
    if (known.searchNearer(farther)) {
      if (known.isNearer(distance) || known.searchNearer(distance))
        return setNear(meshes, known.triangles());
      farther = distance;
    }
    setBound(farther);
    return false;
  }
  static double motionOf(const PlacedMesh<BV>& mesh) {
    if (!mesh.hasBoxes()) return 0;
    return double(mesh.tree->motion.accumulatedMotion(0)) * double(mesh.tree->boxes->frame.unit());
  }
};

template <typename BV>
CoherentProximity<BV>::CoherentProximity(const AdaptiveBVHModel<BV>& first,
                                         const AdaptiveBVHModel<BV>& second)
    : state_(new State{first, second}) {}
template <typename BV>
CoherentProximity<BV>::~CoherentProximity() = default;
template <typename BV>
CoherentProximity<BV>::CoherentProximity(CoherentProximity&&) noexcept = default;
template <typename BV>
std::size_t CoherentProximity<BV>::searches() const {
  return state_->searches;
}

template <typename BV>
bool CoherentProximity<BV>::isNearer(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
                                     S distance) {
  State& state = *state_;
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireQueryable(state.first);
  requireQueryable(state.second);
  const PairOfMeshes<BV> meshes(state.first, tf1, state.second, tf2);
  const auto limit = static_cast<double>(distance);
  ++state.calls;
  state.least_step = state.sample.step(meshes);
  if (state.isStillNear(meshes, limit)) return true;
  if (!state.isBoundWorth(meshes, limit)) return state.searchNear(meshes, limit);
  state.move(meshes);
  return !state.isSurelyFarther(limit) && state.searchBound(meshes, limit);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class CoherentProximity<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
