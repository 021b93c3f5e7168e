// Ray queries, by RayWalk. A callback receives each hit and returns the t
// up to which further hits are of interest; a negative t ends the search of that ray.
#include <algorithm>
#include <cmath>

#include "adaptive_bvh/point_query.h"
#include "query/points/point_search.h"
#include "query/points/ray_search.h"

namespace adaptive_bvh {
namespace {

/// The result of a ray without hits.
RayHit noHit() { return {std::numeric_limits<double>::infinity(), -1, 0, 0}; }
RayHit hitOf(int triangle, const RayTriangle::Hit& hit) { return {hit.t, triangle, hit.u, hit.v}; }
/// Whether a hit is in the range, and its t finite.
bool isInRange(const RayRange& range, double t) {
  return range.begin <= t && t <= range.end && std::isfinite(t);
}
/// The order of hits.
bool isBefore(const RayHit& a, const RayHit& b) {
  return a.t != b.t ? a.t < b.t : a.triangle < b.triangle;
}

/// Keeps a hit if it is the first one so far. Returns the t up to which other hits may be earlier.
double keepFirst(const RayRange& range, int triangle, const RayTriangle::Hit& hit, RayHit& first) {
  const RayHit found = hitOf(triangle, hit);
  if (isInRange(range, found.t) && isBefore(found, first)) first = found;
  return std::min(first.t, range.end);
}
/// If the hit is in the range, sets `any` and returns a negative t: other hits do not matter.
double keepAny(const RayRange& range, const RayTriangle::Hit& hit, std::uint8_t& any) {
  if (!isInRange(range, hit.t)) return range.end;
  any = 1;
  return -1;
}

/// Searches one ray, and calls found(triangle, hit) for each hit.
template <typename Found>
void search(const DeformableMesh& mesh, const fcl::Vector3d& origin, const fcl::Vector3d& direction,
            const RayRange& range, const Found& found) {
  RayWalk(stateOf(mesh)).search(origin, direction, double(range.begin), double(range.end), found);
}

/// Searches many rays, after checks. `none` is the initial result of each ray;
/// found(triangle, hit, ray_result) is called for each hit.
template <typename Result, typename Found>
void searchMany(const DeformableMesh& mesh, const fcl::Vector3d* origins,
                const fcl::Vector3d* directions, std::size_t count, const RayRange& range,
                const Result& none, std::vector<Result>& result, const Found& found) {
  for (std::size_t i = 0; i < count; ++i) requireRay(origins[i], directions[i]);
  requireRange(range);
  result.resize(count);
  forEachBatch(stateOf(mesh).threads, count, [&](std::size_t begin, std::size_t end) {
    RayBatch(stateOf(mesh))
        .search(
            begin, end,
            [&](RayWalk& walk, std::size_t i) -> bool {
              result[i] = none;
              return walk.start(origins[i], directions[i], double(range.begin), double(range.end));
            },
            [&](std::size_t i, int triangle, const RayTriangle::Hit& hit) -> double {
              return found(triangle, hit, result[i]);
            });
  });
}

}  // namespace

std::size_t rayHits(const DeformableMesh& mesh, const fcl::Vector3d& origin,
                    const fcl::Vector3d& direction, const RayRange& range,
                    std::vector<RayHit>& result) {
  requireRay(origin, direction);
  requireRange(range);
  result.clear();
  search(mesh, origin, direction, range, [&](int triangle, const RayTriangle::Hit& hit) -> double {
    const RayHit found = hitOf(triangle, hit);
    if (isInRange(range, found.t)) result.push_back(found);
    return range.end;
  });
  std::sort(result.begin(), result.end(), isBefore);
  return result.size();
}

RayHit firstHit(const DeformableMesh& mesh, const fcl::Vector3d& origin,
                const fcl::Vector3d& direction, const RayRange& range) {
  requireRay(origin, direction);
  requireRange(range);
  RayHit first = noHit();
  search(mesh, origin, direction, range, [&](int triangle, const RayTriangle::Hit& hit) -> double {
    return keepFirst(range, triangle, hit, first);
  });
  return first;
}

bool anyHit(const DeformableMesh& mesh, const fcl::Vector3d& origin, const fcl::Vector3d& direction,
            const RayRange& range) {
  requireRay(origin, direction);
  requireRange(range);
  std::uint8_t any = 0;
  search(mesh, origin, direction, range,
         [&](int, const RayTriangle::Hit& hit) -> double { return keepAny(range, hit, any); });
  return any != 0;
}

void firstHits(const DeformableMesh& mesh, const fcl::Vector3d* origins,
               const fcl::Vector3d* directions, std::size_t count, const RayRange& range,
               std::vector<RayHit>& result) {
  searchMany(mesh, origins, directions, count, range, noHit(), result,
             [&](int triangle, const RayTriangle::Hit& hit, RayHit& first) -> double {
               return keepFirst(range, triangle, hit, first);
             });
}

void anyHits(const DeformableMesh& mesh, const fcl::Vector3d* origins,
             const fcl::Vector3d* directions, std::size_t count, const RayRange& range,
             std::vector<std::uint8_t>& result) {
  searchMany(mesh, origins, directions, count, range, std::uint8_t(0), result,
             [&](int, const RayTriangle::Hit& hit, std::uint8_t& any) -> double {
               return keepAny(range, hit, any);
             });
}

}  // namespace adaptive_bvh
