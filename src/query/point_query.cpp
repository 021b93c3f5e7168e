#include "adaptive_bvh/point_query.h"

#include <algorithm>

#include "query/point_search.h"

namespace adaptive_bvh {
namespace {

template <typename S>
void requireFinite(const fcl::Vector3<S>& v) {
  if (!v.allFinite())
    throw std::invalid_argument("adaptive_bvh: a point or direction to ask for is not finite");
}
template <typename S>
ClosestPoint<S> search(PointSearch<S>& search, const fcl::Vector3<S>& point, int guess) {
  const fcl::Vector3d& x = point.template cast<double>();
  typename PointSearch<S>::Nearest nearest;
  if (guess >= 0) search.tryTriangle(x, guess, nearest);
  search.search(x, nearest);
  return {nearest.point.template cast<S>(), static_cast<S>(nearest.distance), nearest.triangle};
}

}  // namespace

template <typename S>
ClosestPoint<S> closestPoint(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& point) {
  requireFinite(point);
  PointSearch<S> points(stateOf(mesh));
  return search(points, point, -1);
}

template <typename S>
void closestPoints(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                   std::vector<ClosestPoint<S>>& result) {
  std::for_each(points, points + count, requireFinite<S>);
  result.resize(count);
  forEachBatch(stateOf(mesh).query_threads, count, [&](std::size_t begin, std::size_t end) {
    PointSearch<S> one(stateOf(mesh));
    for (std::size_t i = begin; i < end; ++i)
      result[i] = search(one, points[i], i > begin ? result[i - 1].triangle : -1);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                          \
  template ClosestPoint<S> closestPoint(const DeformableMesh<S>&, const fcl::Vector3<S>&);   \
  template void closestPoints(const DeformableMesh<S>&, const fcl::Vector3<S>*, std::size_t, \
                              std::vector<ClosestPoint<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
