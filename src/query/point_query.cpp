#include "adaptive_bvh/point_query.h"

#include <algorithm>
#include <cmath>

#include "query/batches.h"
#include "query/point_search.h"
#include "query/proximity_arguments.h"
#include "query/ray_search.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

template <typename S>
void requireFinite(const fcl::Vector3<S>& v) {
  if (!v.allFinite())
    throw std::invalid_argument("adaptive_bvh: a point or direction to ask for is not finite");
}
template <typename S>
void requireRay(const fcl::Vector3<S>& origin, const fcl::Vector3<S>& direction) {
  requireFinite(origin);
  requireFinite(direction);
  if (direction.isZero(0)) throw std::invalid_argument("adaptive_bvh: a ray's direction is zero");
}

template <typename BV>
const WideTree<typename BV::S>& queryableTree(const AdaptiveBVHModel<BV>& model) {
  requireQueryable(model);
  return treeOf(model).wide.current(model, treeOf(model));
}

template <typename BV>
ClosestPoint<typename BV::S> search(PointSearch<BV>& search,
                                    const fcl::Vector3<typename BV::S>& point, int guess) {
  using S = typename BV::S;
  const fcl::Vector3d& x = point.template cast<double>();
  typename PointSearch<BV>::Nearest nearest;
  if (guess >= 0) search.tryTriangle(x, guess, nearest);
  search.search(x, nearest);
  return {nearest.point.template cast<S>(), static_cast<S>(nearest.distance), nearest.triangle};
}

template <typename S>
RayHit<S> hitOf(int triangle, const RayTriangle::Hit& hit) {
  return {static_cast<S>(hit.t), triangle, static_cast<S>(hit.u), static_cast<S>(hit.v)};
}
/// The order of hits. (Two that differ in double precision may be equal in single.)
template <typename S>
bool isBefore(const RayHit<S>& a, const RayHit<S>& b) {
  return a.t != b.t ? a.t < b.t : a.triangle < b.triangle;
}

template <typename BV>
RayHit<typename BV::S> searchFirst(RaySearch<BV>& search,
                                   const fcl::Vector3<typename BV::S>& origin,
                                   const fcl::Vector3<typename BV::S>& direction) {
  using S = typename BV::S;
  constexpr S kNever = std::numeric_limits<S>::infinity();
  RayHit<S> result{kNever, -1, 0, 0};
  search.search(origin.template cast<double>(), direction.template cast<double>(),
                [&](int triangle, const RayTriangle::Hit& hit) -> double {
                  const RayHit<S> found = hitOf<S>(triangle, hit);
                  if (found.t < kNever && isBefore(found, result)) result = found;
                  return result.t;
                });
  return result;
}

}  // namespace

template <typename BV>
ClosestPoint<typename BV::S> closestPoint(const AdaptiveBVHModel<BV>& model,
                                          const fcl::Vector3<typename BV::S>& point) {
  requireFinite(point);
  PointSearch<BV> points(model, queryableTree(model));
  return search(points, point, -1);
}

template <typename BV>
void closestPoints(const AdaptiveBVHModel<BV>& model, const fcl::Vector3<typename BV::S>* points,
                   std::size_t count, std::vector<ClosestPoint<typename BV::S>>& result) {
  std::for_each(points, points + count, requireFinite<typename BV::S>);
  const auto& wide = queryableTree(model);
  result.resize(count);
  forEachBatch(treeOf(model), count, [&](std::size_t begin, std::size_t end) {
    PointSearch<BV> one(model, wide);
    for (std::size_t i = begin; i < end; ++i)
      result[i] = search(one, points[i], i > begin ? result[i - 1].triangle : -1);
  });
}

template <typename BV>
std::size_t rayHits(const AdaptiveBVHModel<BV>& model, const fcl::Vector3<typename BV::S>& origin,
                    const fcl::Vector3<typename BV::S>& direction,
                    std::vector<RayHit<typename BV::S>>& result) {
  using S = typename BV::S;
  requireRay(origin, direction);
  RaySearch<BV> search(model, queryableTree(model));
  result.clear();
  search.search(origin.template cast<double>(), direction.template cast<double>(),
                [&](int triangle, const RayTriangle::Hit& hit) {
                  const RayHit<S> found = hitOf<S>(triangle, hit);
                  if (std::isfinite(found.t)) result.push_back(found);
                  return std::numeric_limits<double>::infinity();
                });
  std::sort(result.begin(), result.end(), isBefore<S>);
  return result.size();
}

template <typename BV>
RayHit<typename BV::S> firstHit(const AdaptiveBVHModel<BV>& model,
                                const fcl::Vector3<typename BV::S>& origin,
                                const fcl::Vector3<typename BV::S>& direction) {
  requireRay(origin, direction);
  RaySearch<BV> search(model, queryableTree(model));
  return searchFirst(search, origin, direction);
}

template <typename BV>
void firstHits(const AdaptiveBVHModel<BV>& model, const fcl::Vector3<typename BV::S>* origins,
               const fcl::Vector3<typename BV::S>* directions, std::size_t count,
               std::vector<RayHit<typename BV::S>>& result) {
  for (std::size_t i = 0; i < count; ++i) requireRay(origins[i], directions[i]);
  const auto& wide = queryableTree(model);
  result.resize(count);
  forEachBatch(treeOf(model), count, [&](std::size_t begin, std::size_t end) {
    RaySearch<BV> one(model, wide);
    for (std::size_t i = begin; i < end; ++i)
      result[i] = searchFirst(one, origins[i], directions[i]);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                       \
  template ClosestPoint<BV::S> closestPoint(const AdaptiveBVHModel<BV>&,                   \
                                            const fcl::Vector3<BV::S>&);                   \
  template void closestPoints(const AdaptiveBVHModel<BV>&, const fcl::Vector3<BV::S>*,     \
                              std::size_t, std::vector<ClosestPoint<BV::S>>&);             \
  template std::size_t rayHits(const AdaptiveBVHModel<BV>&, const fcl::Vector3<BV::S>&,    \
                               const fcl::Vector3<BV::S>&, std::vector<RayHit<BV::S>>&);   \
  template RayHit<BV::S> firstHit(const AdaptiveBVHModel<BV>&, const fcl::Vector3<BV::S>&, \
                                  const fcl::Vector3<BV::S>&);                             \
  template void firstHits(const AdaptiveBVHModel<BV>&, const fcl::Vector3<BV::S>*,         \
                          const fcl::Vector3<BV::S>*, std::size_t, std::vector<RayHit<BV::S>>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
