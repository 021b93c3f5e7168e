// Nearest points, signed distances, winding numbers and clearances. Checks the arguments, then runs
// PointSearch (nearest triangle) and WindingNumber (side) for each point, on several threads.
#include "adaptive_bvh/point_query.h"

#include <limits>
#include <stdexcept>

#include "adaptive_bvh/proximity.h"
#include "base/leased.h"
#include "base/rigid.h"
#include "query/closed_surface.h"
#include "query/points/point_order.h"
#include "query/points/point_search.h"
#include "query/points/surface_normals.h"
#include "query/points/winding_number.h"

namespace adaptive_bvh {
namespace {

/// Throws std::invalid_argument if a coordinate is infinite or NaN.
template <typename S>
void requireFinite(const fcl::Vector3<S>* points, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!points[i].allFinite())
      throw std::invalid_argument("adaptive_bvh: point " + std::to_string(i) + " is not finite");
}

/// Calls each(i, x) for all points, neighbours in space one after the other, on the threads of the
/// mesh's queries. Each thread calls makeEach() for a function of its own.
template <typename S, typename MakeEach>
void forEachPoint(const MeshState& mesh, const fcl::Vector3<S>* points, std::size_t count,
                  const MakeEach& makeEach) {
  const auto point = [&](std::size_t i) -> fcl::Vector3d {
    return points[i].template cast<double>();
  };
  const Leased<PointOrder> leased;
  const PointOrder& order = *leased;
  leased->sort(count, point);
  forEachBatch(mesh.query_threads, count, [&](std::size_t begin, std::size_t end) {
    auto each = makeEach();
    for (std::size_t i = begin; i < end; ++i) each(order[i], point(order[i]));
  });
}

/// Converts the result of a search to S.
template <typename S>
ClosestPoint<S> pointOf(const PointSearch::Nearest& nearest) {
  return {nearest.point.template cast<S>(), static_cast<S>(nearest.distance), nearest.triangle};
}

/// Converts the result of a search to S; adds the feature of the nearest point and its normal. If
/// no triangle was found: a NaN point at an infinite distance.
template <typename S>
ClosestFeature<S> featureOf(const SurfaceNormals& normals, const fcl::Vector3d& x,
                            const PointSearch::Nearest& nearest) {
  if (nearest.triangle < 0)
    return {fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()),
            std::numeric_limits<S>::infinity(),
            -1,
            fcl::Vector3<S>::Zero(),
            SurfaceFeature::Face,
            0,
            fcl::Vector3<S>::Zero()};
  const SurfacePlace place = normals.placeOf(x, nearest.place, unsigned(nearest.triangle));
  return {nearest.point.template cast<S>(),
          static_cast<S>(nearest.distance),
          nearest.triangle,
          place.barycentric.template cast<S>(),
          place.feature,
          normals.numberOf(place),
          normals.at(place).template cast<S>()};
}

/// Sets `result`, by vertex of `mesh`, to the distance to `other`, at most `limit`, times sign(x);
/// x is the vertex in the other's frame. makeSign() returns a thread's own function.
template <typename S, typename MakeSign>
void findDistances(const MeshState& mesh, const RelativePlacement& to_other, const MeshState& other,
                   S limit, const MakeSign& makeSign, std::vector<S>& result) {
  result.resize(mesh.vertices.size());
  forEachPoint(other, mesh.vertices.data(), result.size(), [&] {
    return [&, search = NearestInTurn(other), sign = makeSign()](std::size_t i,
                                                                 const fcl::Vector3d& x) mutable {
      const fcl::Vector3d in_other = to_other(x);
      result[i] =
          sign(in_other) * static_cast<S>(search(in_other, static_cast<double>(limit)).distance);
    };
  });
}

}  // namespace

template <typename S>
void closestPoints(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                   std::vector<ClosestPoint<S>>& result) {
  requireFinite(points, count);
  result.resize(count);
  const MeshState& state = stateOf(mesh);
  forEachPoint(state, points, count, [&] {
    return [&, search = NearestInTurn(state)](std::size_t i, const fcl::Vector3d& x) mutable {
      result[i] = pointOf<S>(search(x));
    };
  });
}

template <typename S>
ClosestPoint<S> closestPoint(const DeformableMesh<S>& mesh,
                             const NonDeduced<fcl::Vector3<S>>& point) {
  requireFinite(&point, 1);
  return pointOf<S>(NearestInTurn(stateOf(mesh))(point.template cast<double>()));
}

template <typename S>
void closestFeatures(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points,
                     std::size_t count, NonDeduced<S> limit,
                     std::vector<ClosestFeature<S>>& result) {
  requireDistance(limit, "limit");
  requireFinite(points, count);
  result.resize(count);
  const MeshState& state = stateOf(mesh);
  const SurfaceNormals normals(state);
  forEachPoint(state, points, count, [&] {
    return [&, search = NearestInTurn(state)](std::size_t i, const fcl::Vector3d& x) mutable {
      result[i] = featureOf<S>(normals, x, search(x, static_cast<double>(limit)));
    };
  });
}

template <typename S>
void signedDistances(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points,
                     std::size_t count, std::vector<S>& result) {
  const MeshState& state = stateOf(mesh);
  requireClosed(state, "signedDistances");
  requireFinite(points, count);
  result.resize(count);
  forEachPoint(state, points, count, [&] {
    return [&, search = NearestInTurn(state), winding = WindingNumber(state)](
               std::size_t i, const fcl::Vector3d& x) mutable {
      const double distance = search(x).distance;
      const bool is_inside = distance > 0 && winding.of(x) != 0;
      result[i] = static_cast<S>(is_inside ? -distance : distance);
    };
  });
}

template <typename S>
void windingNumbers(const DeformableMesh<S>& mesh, const fcl::Vector3<S>* points, std::size_t count,
                    std::vector<S>& result) {
  requireFinite(points, count);
  result.resize(count);
  const MeshState& state = stateOf(mesh);
  forEachPoint(state, points, count, [&] {
    return [&, winding = WindingNumber(state)](std::size_t i, const fcl::Vector3d& x) mutable {
      result[i] = static_cast<S>(winding.of(x));
    };
  });
}

template <typename S>
bool isWatertight(const DeformableMesh<S>& mesh, std::vector<OpenEdge>* open_edges) {
  const MeshState& state = stateOf(mesh);
  const bool is_closed = state.topology->owners.isClosed();
  if (!open_edges) return is_closed;
  open_edges->clear();
  if (is_closed) return true;
  forEachOpenEdge(
      state.view(), static_cast<unsigned>(state.numTriangles()), state.topology->vertex_triangles,
      [&](unsigned from, unsigned to, const EdgeUse& use) {
        open_edges->push_back({from, to, use.triangle, std::abs(use.forward - use.back)});
        return true;
      });
  return false;
}

template <typename S>
void clearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
               const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf,
               NonDeduced<S> limit, std::vector<S>& result) {
  requireDistance(limit, "limit");
  requireRigid(tf);
  requireRigid(other_tf);
  const auto makePositive = [] { return [](const fcl::Vector3d&) { return S(1); }; };
  findDistances(stateOf(mesh), RelativePlacement(other_tf, tf), stateOf(other), limit, makePositive,
                result);
}

template <typename S>
void signedClearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                     const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf,
                     NonDeduced<S> limit, std::vector<S>& result) {
  requireDistance(limit, "limit");
  requireRigid(tf);
  requireRigid(other_tf);
  const MeshState& closed = stateOf(other);
  requireClosed(closed, "a signed clearance");
  const auto makeWindingSign = [&] {
    return [number = WindingNumber(closed)](const fcl::Vector3d& x) mutable {
      return number.of(x) != 0 ? S(-1) : S(1);
    };
  };
  findDistances(stateOf(mesh), RelativePlacement(other_tf, tf), closed, limit, makeWindingSign,
                result);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                               \
  template ClosestPoint<S> closestPoint(const DeformableMesh<S>&, const fcl::Vector3<S>&);        \
  template void closestPoints(const DeformableMesh<S>&, const fcl::Vector3<S>*, std::size_t,      \
                              std::vector<ClosestPoint<S>>&);                                     \
  template void closestFeatures(const DeformableMesh<S>&, const fcl::Vector3<S>*, std::size_t, S, \
                                std::vector<ClosestFeature<S>>&);                                 \
  template void signedDistances(const DeformableMesh<S>&, const fcl::Vector3<S>*, std::size_t,    \
                                std::vector<S>&);                                                 \
  template void windingNumbers(const DeformableMesh<S>&, const fcl::Vector3<S>*, std::size_t,     \
                               std::vector<S>&);                                                  \
  template bool isWatertight(const DeformableMesh<S>&, std::vector<OpenEdge>*);                   \
  template void clearance(const DeformableMesh<S>&, const fcl::Transform3<S>&,                    \
                          const DeformableMesh<S>&, const fcl::Transform3<S>&, S,                 \
                          std::vector<S>&);                                                       \
  template void signedClearance(const DeformableMesh<S>&, const fcl::Transform3<S>&,              \
                                const DeformableMesh<S>&, const fcl::Transform3<S>&, S,           \
                                std::vector<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
