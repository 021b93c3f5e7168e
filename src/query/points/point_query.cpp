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
void requireFinite(const fcl::Vector3d* points, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!points[i].allFinite())
      throw std::invalid_argument("adaptive_bvh: point " + std::to_string(i) + " is not finite");
}

/// Calls each(i, x) for all points, neighbours in space one after the other, on the threads of the
/// mesh's queries. Each thread calls makeEach() for a function of its own.
template <typename MakeEach>
void forEachPoint(const MeshState& mesh, const fcl::Vector3d* points, std::size_t count,
                  const MakeEach& makeEach) {
  const auto point = [&](std::size_t i) -> fcl::Vector3d { return points[i]; };
  const Leased<PointOrder> leased;
  const PointOrder& order = *leased;
  leased->sort(count, point);
  forEachBatch(mesh.threads, count, [&](std::size_t begin, std::size_t end) {
    auto each = makeEach();
    for (std::size_t i = begin; i < end; ++i) each(order[i], point(order[i]));
  });
}

/// Converts the result of a search to S.
ClosestPoint pointOf(const PointSearch::Nearest& nearest) {
  return {nearest.point, nearest.distance, nearest.triangle};
}

/// Converts the result of a search to S; adds the feature of the nearest point and its normal. If
/// no triangle was found: a NaN point at an infinite distance.
ClosestFeature featureOf(const SurfaceNormals& normals, const fcl::Vector3d& x,
                         const PointSearch::Nearest& nearest) {
  if (nearest.triangle < 0)
    return {fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()),
            std::numeric_limits<double>::infinity(),
            -1,
            fcl::Vector3d::Zero(),
            SurfaceFeature::Face,
            0,
            fcl::Vector3d::Zero()};
  const SurfacePlace place = normals.placeOf(x, nearest.place, unsigned(nearest.triangle));
  return {nearest.point, nearest.distance,        nearest.triangle, place.barycentric,
          place.feature, normals.numberOf(place), normals.at(place)};
}

/// Sets `result`, by vertex of `mesh`, to the distance to `other`, at most `limit`, times sign(x);
/// x is the vertex in the other's frame. makeSign() returns a thread's own function.
template <typename MakeSign>
void findDistances(const MeshState& mesh, const RelativePlacement& to_other, const MeshState& other,
                   double limit, const MakeSign& makeSign, std::vector<double>& result) {
  result.resize(mesh.vertices.size());
  forEachPoint(other, mesh.vertices.data(), result.size(), [&] {
    return [&, search = NearestInTurn(other), sign = makeSign()](std::size_t i,
                                                                 const fcl::Vector3d& x) mutable {
      const fcl::Vector3d in_other = to_other(x);
      result[i] = sign(in_other) * search(in_other, limit).distance;
    };
  });
}

}  // namespace

void closestPoints(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                   std::vector<ClosestPoint>& result) {
  requireFinite(points, count);
  result.resize(count);
  const MeshState& state = stateOf(mesh);
  forEachPoint(state, points, count, [&] {
    return [&, search = NearestInTurn(state)](std::size_t i, const fcl::Vector3d& x) mutable {
      result[i] = pointOf(search(x));
    };
  });
}

ClosestPoint closestPoint(const DeformableMesh& mesh, const fcl::Vector3d& point) {
  requireFinite(&point, 1);
  return pointOf(NearestInTurn(stateOf(mesh))(point));
}

void closestFeatures(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                     double limit, std::vector<ClosestFeature>& result) {
  requireDistance(limit, "limit");
  requireFinite(points, count);
  result.resize(count);
  const MeshState& state = stateOf(mesh);
  const SurfaceNormals normals(state);
  forEachPoint(state, points, count, [&] {
    return [&, search = NearestInTurn(state)](std::size_t i, const fcl::Vector3d& x) mutable {
      result[i] = featureOf(normals, x, search(x, limit));
    };
  });
}

void signedDistances(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                     std::vector<double>& result) {
  const MeshState& state = stateOf(mesh);
  requireClosed(state, "signedDistances");
  requireFinite(points, count);
  result.resize(count);
  forEachPoint(state, points, count, [&] {
    return [&, search = NearestInTurn(state), winding = WindingNumber(state)](
               std::size_t i, const fcl::Vector3d& x) mutable {
      const double distance = search(x).distance;
      const bool is_inside = distance > 0 && winding.of(x) != 0;
      result[i] = is_inside ? -distance : distance;
    };
  });
}

void windingNumbers(const DeformableMesh& mesh, const fcl::Vector3d* points, std::size_t count,
                    std::vector<double>& result) {
  requireFinite(points, count);
  result.resize(count);
  const MeshState& state = stateOf(mesh);
  forEachPoint(state, points, count, [&] {
    return [&, winding = WindingNumber(state)](std::size_t i, const fcl::Vector3d& x) mutable {
      result[i] = winding.of(x);
    };
  });
}

bool isWatertight(const DeformableMesh& mesh, std::vector<OpenEdge>* open_edges) {
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

void vertexDistances(const DeformableMesh& first, const fcl::Transform3d& tf1,
                     const DeformableMesh& second, const fcl::Transform3d& tf2, double limit,
                     std::vector<double>& result) {
  requireDistance(limit, "limit");
  requireRigid(tf1);
  requireRigid(tf2);
  const auto makePositive = [] { return [](const fcl::Vector3d&) { return 1.; }; };
  findDistances(stateOf(first), RelativePlacement(tf2, tf1), stateOf(second), limit, makePositive,
                result);
}

void signedVertexDistances(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2, double limit,
                           std::vector<double>& result) {
  requireDistance(limit, "limit");
  requireRigid(tf1);
  requireRigid(tf2);
  const MeshState& closed = stateOf(second);
  requireClosed(closed, "signedVertexDistances");
  const auto makeWindingSign = [&] {
    return [number = WindingNumber(closed)](const fcl::Vector3d& x) mutable {
      return number.of(x) != 0 ? -1. : 1.;
    };
  };
  findDistances(stateOf(first), RelativePlacement(tf2, tf1), closed, limit, makeWindingSign,
                result);
}

}  // namespace adaptive_bvh
