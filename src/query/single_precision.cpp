// Conversions of requests to double precision and of results to single precision.
#include "query/single_precision.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "triangles/triangle_gap.h"

namespace adaptive_bvh {
namespace {

// Converts each number to the nearest float.
void copyTo(double from, float& to) { to = static_cast<float>(from); }
void copyTo(const fcl::Vector3d& from, fcl::Vector3f& to) { to = from.cast<float>(); }
void copyTo(const std::array<fcl::Vector3d, 2>& from, std::array<fcl::Vector3f, 2>& to) {
  to = {from[0].cast<float>(), from[1].cast<float>()};
}
template <typename From, typename To>
void copyTo(const std::vector<From>& from, std::vector<To>& to) {
  to.resize(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) copyTo(from[i], to[i]);
}
/// Rounds unsigned distances; only a distance of 0 becomes 0.
void copyDistances(const std::vector<double>& from, std::vector<float>& to) {
  to.resize(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) to[i] = distanceAs<float>(from[i]);
}

/// Rounds down, or up, to single precision.
float singleBelow(double x) {
  const auto rounded = static_cast<float>(x);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return static_cast<double>(rounded) > x ? std::nextafter(rounded, -kInfinity) : rounded;
}
float singleAbove(double x) { return -singleBelow(-x); }

void copyTo(const ContactPatches<double>& from, ContactPatches<float>& to) {
  copyTo(from.areas, to.areas);
  copyTo(from.centroids, to.centroids);
  to.triangles = from.triangles;
  to.begins = from.begins;
}

}  // namespace

ProximityRequest<double> inDouble(const ProximityRequest<float>& request) {
  return {static_cast<double>(request.distance), request.enable_distances,
          request.enable_nearest_points, request.ignored};
}

FeatureProximityRequest<double> inDouble(const FeatureProximityRequest<float>& request) {
  return {static_cast<double>(request.distance), request.vertex_face, request.face_vertex,
          request.edge_edge};
}

fcl::DistanceRequestd inDouble(const fcl::DistanceRequestf& request) {
  fcl::DistanceRequestd converted(request.enable_nearest_points, request.enable_signed_distance);
  converted.rel_err = static_cast<double>(request.rel_err);
  converted.abs_err = static_cast<double>(request.abs_err);
  return converted;
}

void narrow(const TrianglePairs<double>& from, TrianglePairs<float>& to) {
  to.triangles = from.triangles;
  copyDistances(from.distances, to.distances);
  copyTo(from.nearest_points, to.nearest_points);
}

void narrow(const VertexContacts<double>& from, VertexContacts<float>& to) {
  to.vertices = from.vertices;
  copyTo(from.distances, to.distances);
  copyTo(from.positions, to.positions);
  copyTo(from.nearest_points, to.nearest_points);
  copyTo(from.normals, to.normals);
  to.triangles = from.triangles;
  copyTo(from.barycentric, to.barycentric);
  copyTo(from.areas, to.areas);
}

void narrow(const FeatureDetails<double>& from, FeatureDetails<float>& to) {
  copyDistances(from.distances, to.distances);
  copyTo(from.nearest_points, to.nearest_points);
  copyTo(from.coordinates, to.coordinates);
  copyTo(from.normals, to.normals);
}

void narrow(const FeaturePairDetails<double>& from, FeaturePairDetails<float>& to) {
  narrow(from.vertex_face, to.vertex_face);
  narrow(from.face_vertex, to.face_vertex);
  narrow(from.edge_edge, to.edge_edge);
}

void narrow(const ContactRegions<double>& from, ContactRegions<float>& to) {
  copyTo(from.volumes, to.volumes);
  copyTo(from.depths, to.depths);
  copyTo(from.deepest_points, to.deepest_points);
  copyTo(from.normals, to.normals);
  copyTo(from.first, to.first);
  copyTo(from.second, to.second);
  copyTo(from.curve_points, to.curve_points);
  to.curve_first = from.curve_first;
  to.curve_second = from.curve_second;
  to.curve_begins = from.curve_begins;
  to.curve_regions = from.curve_regions;
}

void narrow(const SignedDistance<double>& from, SignedDistance<float>& to) {
  to.lower = singleBelow(from.lower);
  to.upper = singleAbove(from.upper);
  to.deep_body = from.deep_body;
  copyTo(from.points, to.points);
  copyTo(from.normal, to.normal);
  to.searches = from.searches;
}

void narrow(const fcl::DistanceResultd& from, const fcl::CollisionGeometryf* o1,
            const fcl::CollisionGeometryf* o2, fcl::DistanceResultf& to) {
  const bool is_depth = from.min_distance < 0;  // a signed distance: minus the penetration depth
  to.min_distance =
      is_depth ? static_cast<float>(from.min_distance) : distanceAs<float>(from.min_distance);
  to.o1 = o1;
  to.o2 = o2;
  to.b1 = from.b1;
  to.b2 = from.b2;
  for (std::size_t i = 0; i < 2; ++i) to.nearest_points[i] = from.nearest_points[i].cast<float>();
}

fcl::CollisionRequestd inDouble(const CollisionQuery<float>& query) {
  const fcl::CollisionRequestf& request = query.request;
  const std::size_t most = request.num_max_contacts,
                    remaining = most - std::min(most, query.result.numContacts());
  return fcl::CollisionRequestd(remaining, request.enable_contact, request.num_max_cost_sources,
                                request.enable_cost, request.use_approximate_cost);
}

fcl::Contactf narrowed(const fcl::Contactd& contact) {
  fcl::Contactf to;
  to.b1 = contact.b1;
  to.b2 = contact.b2;
  to.pos = contact.pos.cast<float>();
  to.normal = contact.normal.cast<float>();
  to.penetration_depth = static_cast<float>(contact.penetration_depth);
  return to;
}

void addNarrowed(const fcl::CollisionResultd& from, const fcl::CollisionGeometryf* o1,
                 const fcl::CollisionGeometryf* o2, const CollisionQuery<float>& query) {
  for (std::size_t i = 0; i < from.numContacts(); ++i) {
    fcl::Contactf contact = narrowed(from.getContact(i));
    contact.o1 = o1;
    contact.o2 = o2;
    query.result.addContact(contact);
  }
  std::vector<fcl::CostSourced> costs;
  if (query.request.enable_cost) const_cast<fcl::CollisionResultd&>(from).getCostSources(costs);
  for (const fcl::CostSourced& cost : costs) {
    const fcl::AABBf box(cost.aabb_min.cast<float>(), cost.aabb_max.cast<float>());
    query.result.addCostSource(fcl::CostSourcef(box, static_cast<float>(cost.cost_density)),
                               query.request.num_max_cost_sources);
  }
}

}  // namespace adaptive_bvh
