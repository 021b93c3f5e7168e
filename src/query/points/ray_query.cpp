// Ray queries in S, by RayWalk in double precision. A callback receives each hit and returns the t
// up to which further hits are of interest; a negative t ends the search of that ray.
#include <algorithm>
#include <cmath>

#include "adaptive_bvh/point_query.h"
#include "query/points/point_search.h"
#include "query/points/ray_search.h"

namespace adaptive_bvh {
namespace {

/// The result of a ray without hits.
template <typename S>
RayHit<S> noHit() {
  return {std::numeric_limits<S>::infinity(), -1, 0, 0};
}
template <typename S>
RayHit<S> hitOf(int triangle, const RayTriangle::Hit& hit) {
  return {static_cast<S>(hit.t), triangle, static_cast<S>(hit.u), static_cast<S>(hit.v)};
}
/// Whether a hit is in the range, and S can represent its t.
template <typename S>
bool isInRange(const RayRange<S>& range, S t) {
  return range.begin <= t && t <= range.end && std::isfinite(t);
}
/// The order of hits. (Two hits that differ in double precision may be equal in single precision.)
template <typename S>
bool isBefore(const RayHit<S>& a, const RayHit<S>& b) {
  return a.t != b.t ? a.t < b.t : a.triangle < b.triangle;
}

/// Keeps a hit if it is the first one so far. Returns the t up to which other hits may be earlier.
template <typename S>
double keepFirst(const RayRange<S>& range, int triangle, const RayTriangle::Hit& hit,
                 RayHit<S>& first) {
  const RayHit<S> found = hitOf<S>(triangle, hit);
  if (isInRange(range, found.t) && isBefore(found, first)) first = found;
  return static_cast<double>(std::min(first.t, range.end));
}
/// If the hit is in the range, sets `any` and returns a negative t: other hits do not matter.
template <typename S>
double keepAny(const RayRange<S>& range, const RayTriangle::Hit& hit, std::uint8_t& any) {
  if (!isInRange(range, static_cast<S>(hit.t))) return static_cast<double>(range.end);
  any = 1;
  return -1;
}

/// Searches one ray, and calls found(triangle, hit) for each hit.
template <typename S, typename Found>
void search(const DeformableMesh<S>& mesh, const fcl::Vector3<S>& origin,
            const fcl::Vector3<S>& direction, const RayRange<S>& range, const Found& found) {
  RayWalk(stateOf(mesh))
      .search(origin.template cast<double>(), direction.template cast<double>(),
              double(range.begin), double(range.end), found);
}

/// Searches many rays, after checks. `none` is the initial result of each ray;
/// found(triangle, hit, ray_result) is called for each hit.
template <typename S, typename Result, typename Found>
void searchMany(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
                const fcl::Vector3<S>* directions, std::size_t count, const RayRange<S>& range,
                const Result& none, std::vector<Result>& result, const Found& found) {
  for (std::size_t i = 0; i < count; ++i) requireRay(origins[i], directions[i]);
  requireRange(range);
  result.resize(count);
  forEachBatch(stateOf(mesh).query_threads, count, [&](std::size_t begin, std::size_t end) {
    RayBatch(stateOf(mesh))
        .search(
            begin, end,
            [&](RayWalk& walk, std::size_t i) -> bool {
              result[i] = none;
              return walk.start(origins[i].template cast<double>(),
                                directions[i].template cast<double>(), double(range.begin),
                                double(range.end));
            },
            [&](std::size_t i, int triangle, const RayTriangle::Hit& hit) -> double {
              return found(triangle, hit, result[i]);
            });
  });
}

}  // namespace

template <typename S>
std::size_t rayHits(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
                    const NonDeduced<fcl::Vector3<S>>& direction,
                    const NonDeduced<RayRange<S>>& range, std::vector<RayHit<S>>& result) {
  requireRay(origin, direction);
  requireRange(range);
  result.clear();
  search(mesh, origin, direction, range, [&](int triangle, const RayTriangle::Hit& hit) -> double {
    const RayHit<S> found = hitOf<S>(triangle, hit);
    if (isInRange(range, found.t)) result.push_back(found);
    return static_cast<double>(range.end);
  });
  std::sort(result.begin(), result.end(), isBefore<S>);
  return result.size();
}

template <typename S>
RayHit<S> firstHit(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
                   const NonDeduced<fcl::Vector3<S>>& direction,
                   const NonDeduced<RayRange<S>>& range) {
  requireRay(origin, direction);
  requireRange(range);
  RayHit<S> first = noHit<S>();
  search(mesh, origin, direction, range, [&](int triangle, const RayTriangle::Hit& hit) -> double {
    return keepFirst(range, triangle, hit, first);
  });
  return first;
}

template <typename S>
bool anyHit(const DeformableMesh<S>& mesh, const NonDeduced<fcl::Vector3<S>>& origin,
            const NonDeduced<fcl::Vector3<S>>& direction, const NonDeduced<RayRange<S>>& range) {
  requireRay(origin, direction);
  requireRange(range);
  std::uint8_t any = 0;
  search(mesh, origin, direction, range,
         [&](int, const RayTriangle::Hit& hit) -> double { return keepAny(range, hit, any); });
  return any != 0;
}

template <typename S>
void firstHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
               const fcl::Vector3<S>* directions, std::size_t count,
               const NonDeduced<RayRange<S>>& range, std::vector<RayHit<S>>& result) {
  searchMany(mesh, origins, directions, count, range, noHit<S>(), result,
             [&](int triangle, const RayTriangle::Hit& hit, RayHit<S>& first) -> double {
               return keepFirst(range, triangle, hit, first);
             });
}

template <typename S>
void anyHits(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* origins,
             const fcl::Vector3<S>* directions, std::size_t count,
             const NonDeduced<RayRange<S>>& range, std::vector<std::uint8_t>& result) {
  searchMany(mesh, origins, directions, count, range, std::uint8_t(0), result,
             [&](int, const RayTriangle::Hit& hit, std::uint8_t& any) -> double {
               return keepAny(range, hit, any);
             });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                               \
  template std::size_t rayHits(const DeformableMesh<S>&, const fcl::Vector3<S>&,                  \
                               const fcl::Vector3<S>&, const RayRange<S>&,                        \
                               std::vector<RayHit<S>>&);                                          \
  template RayHit<S> firstHit(const DeformableMesh<S>&, const fcl::Vector3<S>&,                   \
                              const fcl::Vector3<S>&, const RayRange<S>&);                        \
  template bool anyHit(const DeformableMesh<S>&, const fcl::Vector3<S>&, const fcl::Vector3<S>&,  \
                       const RayRange<S>&);                                                       \
  template void firstHits(const DeformableMesh<S>&, const fcl::Vector3<S>*,                       \
                          const fcl::Vector3<S>*, std::size_t, const RayRange<S>&,                \
                          std::vector<RayHit<S>>&);                                               \
  template void anyHits(const DeformableMesh<S>&, const fcl::Vector3<S>*, const fcl::Vector3<S>*, \
                        std::size_t, const RayRange<S>&, std::vector<std::uint8_t>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
