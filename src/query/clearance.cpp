#include <algorithm>

#include "adaptive_bvh/proximity.h"
#include "query/batches.h"
#include "query/point_search.h"
#include "query/proximity_arguments.h"
#include "query/winding_number.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// The points of one model in the frame of another.
template <typename BV>
class PointsSeenFrom {
 public:
  using S = typename BV::S;

  PointsSeenFrom(const AdaptiveBVHModel<BV>& model, const fcl::Transform3<S>& tf,
                 const fcl::Transform3<S>& other_tf)
      : model_(model),
        turn_(other_tf.linear().template cast<double>().transpose()),
        R_(turn_ * tf.linear().template cast<double>()),
        T_(turn_ * (tf.translation().template cast<double>() -
                    other_tf.translation().template cast<double>())) {}

  fcl::Vector3d operator[](std::size_t vertex) const {
    return R_ * model_.vertices[vertex].template cast<double>() + T_;
  }

 private:
  const AdaptiveBVHModel<BV>& model_;
  const fcl::Matrix3d turn_, R_;
  const fcl::Vector3d T_;
};

/// Calls sign(x), for each vertex x where it is in the other's frame, for the sign of its distance.
template <typename BV, typename MakeSign>
void findDistances(const AdaptiveBVHModel<BV>& model, const PointsSeenFrom<BV>& points,
                   const AdaptiveBVHModel<BV>& other, typename BV::S limit,
                   const MakeSign& makeSign, std::vector<typename BV::S>& result) {
  using S = typename BV::S;
  const WideTree<S>& wide = treeOf(other).wide.current(other, treeOf(other));
  result.resize(static_cast<std::size_t>(model.num_vertices));
  forEachBatch(treeOf(other), result.size(), [&](std::size_t begin, std::size_t end) {
    PointSearch<BV> search(other, wide);
    auto sign = makeSign(wide);
    int last = -1;
    for (std::size_t i = begin; i < end; ++i) {
      const fcl::Vector3d x = points[i];
      typename PointSearch<BV>::Nearest nearest;
      nearest.distance = static_cast<double>(limit);
      if (last >= 0) search.tryTriangle(x, last, nearest);
      search.search(x, nearest);
      if (nearest.triangle >= 0) last = nearest.triangle;
      result[i] = sign(x) * static_cast<S>(nearest.distance);
    }
  });
}

template <typename BV>
void requireClosed(const AdaptiveBVHModel<BV>& model) {
  const AdaptiveTree<BV>& tree = treeOf(model);
  if (!tree.owners.current(model, tree.topology_number).isClosed())
    throw std::invalid_argument(
        "adaptive_bvh: a signed clearance is asked for to a model that is not closed: some edge is "
        "not run through as often in one direction as in the other");
}

}  // namespace

template <typename BV>
void clearance(const AdaptiveBVHModel<BV>& model, const fcl::Transform3<typename BV::S>& tf,
               const AdaptiveBVHModel<BV>& other, const fcl::Transform3<typename BV::S>& other_tf,
               typename BV::S limit, std::vector<typename BV::S>& result) {
  using S = typename BV::S;
  requireDistance(limit);
  requireRigid(tf);
  requireRigid(other_tf);
  requireQueryable(model);
  requireQueryable(other);
  const auto noSign = [](const WideTree<S>&) { return [](const fcl::Vector3d&) { return S(1); }; };
  findDistances(model, PointsSeenFrom<BV>(model, tf, other_tf), other, limit, noSign, result);
}

template <typename BV>
void signedClearance(const AdaptiveBVHModel<BV>& model, const fcl::Transform3<typename BV::S>& tf,
                     const AdaptiveBVHModel<BV>& other,
                     const fcl::Transform3<typename BV::S>& other_tf, typename BV::S limit,
                     std::vector<typename BV::S>& result) {
  using S = typename BV::S;
  requireDistance(limit);
  requireRigid(tf);
  requireRigid(other_tf);
  requireQueryable(model);
  requireQueryable(other);
  requireClosed(other);
  const auto byWinding = [&](const WideTree<S>& wide) {
    return [number = WindingNumber<BV>(other, wide)](const fcl::Vector3d& x) mutable {
      return number.of(x) != 0 ? S(-1) : S(1);
    };
  };
  findDistances(model, PointsSeenFrom<BV>(model, tf, other_tf), other, limit, byWinding, result);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                               \
  template void clearance(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,              \
                          const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, BV::S,       \
                          std::vector<BV::S>&);                                                    \
  template void signedClearance(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,        \
                                const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, BV::S, \
                                std::vector<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
