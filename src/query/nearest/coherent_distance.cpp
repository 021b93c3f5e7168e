#include "adaptive_bvh/coherent_distance.h"

#include <cstdint>

#include "base/rigid.h"
#include "base/shortcut.h"
#include "query/nearest/nearest_search.h"

namespace adaptive_bvh {
namespace {

/// The distance of one pair of meshes, step after step. Keeps the last answer, which is returned
/// again if nothing has moved, and its nearest triangles, where the next search starts.
class CoherentNearest {
 public:
  /// Overwrites the query's result if the meshes are nearer than its distance.
  void search(const PlacedMesh& first, const PlacedMesh& second, const DistanceQuery& query) {
    if (!isTaken(Shortcut::Coherence)) *this = CoherentNearest();
    if (!isAnswered(first, second, query.request)) {
      result_ = fcl::DistanceResultd();
      unsetPoints(result_);
      NearestPair nearest(first, second, {query.request, result_});
      nearest.addWitness(static_cast<int>(witness1_), static_cast<int>(witness2_));
      NearestSearch search(first, second, nearest, supports_paid_);
      search.run();
      supports_paid_ = search.supportsPaid();
      witness1_ = result_.b1;
      witness2_ = result_.b2;
      versions_[0] = first.mesh.version;
      versions_[1] = second.mesh.version;
      tf1_ = first.tf;
      tf2_ = second.tf;
      request_ = query.request;
    }
    if (result_.min_distance < query.result.min_distance) query.result = result_;
  }

 private:
  /// Whether `result_` is the answer: the last call had the same positions, transforms and request.
  bool isAnswered(const PlacedMesh& first, const PlacedMesh& second,
                  const fcl::DistanceRequestd& request) const {
    return versions_[0] == first.mesh.version && versions_[1] == second.mesh.version &&
           tf1_.matrix() == first.tf.matrix() && tf2_.matrix() == second.tf.matrix() &&
           request_.enable_nearest_points == request.enable_nearest_points &&
           request_.abs_err == request.abs_err && request_.rel_err == request.rel_err;
  }

  std::intptr_t witness1_ = 0, witness2_ = 0;  ///< nearest triangles of the last search
  bool supports_paid_ = false;                 ///< NearestSearch::supportsPaid of that search
  // Arguments and answer of the last search.
  std::uint64_t versions_[2] = {0, 0};  ///< MeshState::version; 0 before the first search
  fcl::Transform3d tf1_, tf2_;
  fcl::DistanceRequestd request_;
  fcl::DistanceResultd result_;
};

}  // namespace

struct CoherentDistance::State {
  State(const DeformableMesh& one, const DeformableMesh& other) : first(one), second(other) {}

  const DeformableMesh &first, &second;
  CoherentNearest nearest;
};

CoherentDistance::CoherentDistance(const DeformableMesh& first, const DeformableMesh& second)
    : state_(std::make_unique<State>(first, second)) {}
CoherentDistance::~CoherentDistance() = default;
CoherentDistance::CoherentDistance(CoherentDistance&&) noexcept = default;

double CoherentDistance::distance(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2,
                                  const fcl::DistanceRequestd& request,
                                  fcl::DistanceResultd& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  State& state = *state_;
  if (request.isSatisfied(result)) return result.min_distance;
  if (!result.o1) unsetPoints(result);
  const double before = result.min_distance;
  state.nearest.search({state.first, tf1}, {state.second, tf2}, {request, result});
  setObjects(before, state.first, state.second, {request, result});
  return result.min_distance;
}

}  // namespace adaptive_bvh
