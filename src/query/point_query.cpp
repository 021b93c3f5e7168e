#include "adaptive_bvh/point_query.h"

#include <algorithm>
#include <cmath>

#include "query/point_search.h"
#include "query/ray_search.h"

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

template <typename S>
ClosestPoint<S> search(PointSearch<S>& search, const fcl::Vector3<S>& point, int guess) {
  const fcl::Vector3d& x = point.template cast<double>();
  typename PointSearch<S>::Nearest nearest;
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

template <typename S>
RayHit<S> searchFirst(RaySearch<S>& search, const fcl::Vector3<S>& origin,
                      const fcl::Vector3<S>& direction) {
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

template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                    const fcl::Vector3<S>& direction, std::vector<RayHit<S>>& result) {
  requireRay(origin, direction);
  RaySearch<S> search(stateOf(mesh));
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

template <typename S>
RayHit<S> firstHit(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
                   const fcl::Vector3<S>& direction) {
  requireRay(origin, direction);
  RaySearch<S> search(stateOf(mesh));
  return searchFirst(search, origin, direction);
}

template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count,
               std::vector<RayHit<S>>& result) {
  for (std::size_t i = 0; i < count; ++i) requireRay(origins[i], directions[i]);
  result.resize(count);
  forEachBatch(stateOf(mesh).query_threads, count, [&](std::size_t begin, std::size_t end) {
    RaySearch<S> one(stateOf(mesh));
    for (std::size_t i = begin; i < end; ++i)
      result[i] = searchFirst(one, origins[i], directions[i]);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                          \
  template ClosestPoint<S> closestPoint(const DeformableMesh<S>&, const fcl::Vector3<S>&);   \
  template void closestPoints(const DeformableMesh<S>&, const fcl::Vector3<S>*, std::size_t, \
                              std::vector<ClosestPoint<S>>&);                                \
  template std::size_t rayHits(const DeformableMesh<S>&, const fcl::Vector3<S>&,             \
                               const fcl::Vector3<S>&, std::vector<RayHit<S>>&);             \
  template RayHit<S> firstHit(const DeformableMesh<S>&, const fcl::Vector3<S>&,              \
                              const fcl::Vector3<S>&);                                       \
  template void firstHits(const DeformableMesh<S>&, const fcl::Vector3<S>*,                  \
                          const fcl::Vector3<S>*, std::size_t, std::vector<RayHit<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
