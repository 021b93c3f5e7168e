#include "adaptive_bvh/coherent_distance.h"

#include <cstdint>

#include "base/rigid.h"
#include "query/nearest_search.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

template <typename S>
struct CoherentDistance<S>::State {
  State(const DeformableMesh<S>& one, const DeformableMesh<S>& other) : first(one), second(other) {}

  const DeformableMesh<S>&first, &second;
  /// The triangles that were nearest last.
  int witness1 = 0, witness2 = 0;
  bool supports_paid = false;  ///< in the last search
  /// The arguments of the last call, and its answer.
  std::uint64_t positions[2] = {0, 0};
  fcl::Transform3<S> tf1, tf2;
  fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result;

  bool isAnswered(const fcl::Transform3<S>& to1, const fcl::Transform3<S>& to2,
                  const fcl::DistanceRequest<S>& asked) const {
    const auto now = [](const DeformableMesh<S>& mesh) { return stateOf(mesh).positions; };
    return positions[0] == now(first) && positions[1] == now(second) &&
           tf1.matrix() == to1.matrix() && tf2.matrix() == to2.matrix() &&
           request.enable_nearest_points == asked.enable_nearest_points &&
           request.abs_err == asked.abs_err && request.rel_err == asked.rel_err;
  }
};

template <typename S>
CoherentDistance<S>::CoherentDistance(const DeformableMesh<S>& first,
                                      const DeformableMesh<S>& second)
    : state_(std::make_unique<State>(first, second)) {}
template <typename S>
CoherentDistance<S>::~CoherentDistance() = default;
template <typename S>
CoherentDistance<S>::CoherentDistance(CoherentDistance&&) noexcept = default;

template <typename S>
S CoherentDistance<S>::distance(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
                                const fcl::DistanceRequest<S>& request,
                                fcl::DistanceResult<S>& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  State& state = *state_;
  if (request.isSatisfied(result)) return result.min_distance;
  if (!state.isAnswered(tf1, tf2, request)) {
    const PlacedMesh<S> first(state.first, tf1), second(state.second, tf2);
    state.result = fcl::DistanceResult<S>();
    NearestPair<S> nearest(first, second, {request, state.result});
    nearest.addWitness(state.witness1, state.witness2);
    NearestSearch<S> search(first, second, nearest, state.supports_paid);
    search.run();
    state.supports_paid = search.supportsPaid();
    state.witness1 = static_cast<int>(state.result.b1);
    state.witness2 = static_cast<int>(state.result.b2);
    state.positions[0] = first.mesh.positions;
    state.positions[1] = second.mesh.positions;
    state.tf1 = tf1;
    state.tf2 = tf2;
    state.request = request;
  }
  if (!result.o1) unsetPoints(result);
  if (state.result.min_distance < result.min_distance) result = state.result;
  return result.min_distance;
}

template class CoherentDistance<float>;
template class CoherentDistance<double>;

}  // namespace adaptive_bvh
