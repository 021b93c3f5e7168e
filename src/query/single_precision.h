#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/proximity.h"
#include "base/leased.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

// Queries compute in double precision. This file converts requests to double precision (inDouble),
// results to single precision (narrow), and runs a query with both conversions (answerInDouble).

inline const ProximityRequest<double>& inDouble(const ProximityRequest<double>& request) {
  return request;
}
ProximityRequest<double> inDouble(const ProximityRequest<float>& request);

inline const FeatureProximityRequest<double>& inDouble(
    const FeatureProximityRequest<double>& request) {
  return request;
}
FeatureProximityRequest<double> inDouble(const FeatureProximityRequest<float>& request);

inline const fcl::DistanceRequestd& inDouble(const fcl::DistanceRequestd& request) {
  return request;
}
fcl::DistanceRequestd inDouble(const fcl::DistanceRequestf& request);

/// Rounds a result to single precision, to nearest unless stated otherwise. An unsigned distance
/// that is not 0 stays positive (distanceAs). The bounds of a SignedDistance are rounded outward.
void narrow(const TrianglePairs<double>& from, TrianglePairs<float>& to);
void narrow(const VertexContacts<double>& from, VertexContacts<float>& to);
void narrow(const FeatureDetails<double>& from, FeatureDetails<float>& to);
void narrow(const FeaturePairDetails<double>& from, FeaturePairDetails<float>& to);
void narrow(const ContactRegions<double>& from, ContactRegions<float>& to);
void narrow(const SignedDistance<double>& from, SignedDistance<float>& to);

/// Calls query(result) with a result in double precision, which the query overwrites. If `result`
/// is in single precision, that is a temporary one, which is then rounded.
template <template <typename> class Result, typename Query>
void answerInDouble(Result<double>& result, const Query& query) {
  query(result);
}
template <template <typename> class Result, typename Query>
void answerInDouble(Result<float>& result, const Query& query) {
  const Leased<Result<double>> found;
  query(*found);
  narrow(*found, result);
}

/// The same for a list of results.
template <template <typename> class Result, typename Query>
void answerInDouble(std::vector<Result<double>>& results, const Query& query) {
  query(results);
}
template <template <typename> class Result, typename Query>
void answerInDouble(std::vector<Result<float>>& results, const Query& query) {
  const Leased<std::vector<Result<double>>> found;
  query(*found);
  results.resize(found->size());
  for (std::size_t i = 0; i < results.size(); ++i) narrow((*found)[i], results[i]);
}

/// Calls search(query) in double precision. The search may lower the distance of the result and set
/// triangles and points; if it lowers the distance, the objects `o1` and `o2` are stored, too.
template <typename Search>
void answerInDouble(const DistanceQuery<double>& query, const fcl::CollisionGeometryd* o1,
                    const fcl::CollisionGeometryd* o2, const Search& search) {
  const double before = query.result.min_distance;
  search(query);
  if (!(query.result.min_distance < before)) return;
  query.result.o1 = o1;
  query.result.o2 = o2;
}
/// Rounds a result and stores the objects `o1` and `o2` in it.
void narrow(const fcl::DistanceResultd& from, const fcl::CollisionGeometryf* o1,
            const fcl::CollisionGeometryf* o2, fcl::DistanceResultf& to);
template <typename Search>
void answerInDouble(const DistanceQuery<float>& query, const fcl::CollisionGeometryf* o1,
                    const fcl::CollisionGeometryf* o2, const Search& search) {
  const fcl::DistanceRequestd request = inDouble(query.request);
  const auto before = static_cast<double>(query.result.min_distance);
  fcl::DistanceResultd found(before);
  for (std::size_t i = 0; i < 2; ++i)  // the search leaves points alone that nobody requests
    found.nearest_points[i] = query.result.nearest_points[i].cast<double>();
  search(DistanceQuery<double>{request, found});
  if (found.min_distance < before) narrow(found, o1, o2, query.result);
}

/// Stands for an object, of either precision, in a contact query in double precision. Has no shape,
/// only the fields that contacts and costs depend on: cost density and occupancy thresholds.
class ContactObject final : public fcl::CollisionGeometryd {
 public:
  template <typename S>
  explicit ContactObject(const fcl::CollisionGeometry<S>& object) {
    cost_density = static_cast<double>(object.cost_density);
    threshold_occupied = static_cast<double>(object.threshold_occupied);
    threshold_free = static_cast<double>(object.threshold_free);
  }
  void computeLocalAABB() override {}
};

/// Returns the request in double precision. Its maximum number of contacts is reduced by those that
/// the result already has, because the query in double precision begins with an empty result.
fcl::CollisionRequestd inDouble(const CollisionQuery<float>& query);
/// Rounds contacts of `o1` and `o2` and cost sources, and adds them to the result of `query`.
void addNarrowed(const fcl::CollisionResultd& from, const fcl::CollisionGeometryf* o1,
                 const fcl::CollisionGeometryf* o2, const CollisionQuery<float>& query);
/// Returns a rounded contact, without its objects.
fcl::Contactf narrowed(const fcl::Contactd& contact);

/// Calls search(o1, o2, query) in double precision, which adds contacts of the objects to a result.
template <typename Search>
void answerInDouble(const CollisionQuery<double>& query, const fcl::CollisionGeometryd* o1,
                    const fcl::CollisionGeometryd* o2, const Search& search) {
  search(*o1, *o2, query);
}
template <typename Search>
void answerInDouble(const CollisionQuery<float>& query, const fcl::CollisionGeometryf* o1,
                    const fcl::CollisionGeometryf* o2, const Search& search) {
  const ContactObject first(*o1), second(*o2);
  const fcl::CollisionRequestd request = inDouble(query);
  const Leased<fcl::CollisionResultd> found;
  found->clear();
  search(first, second, CollisionQuery<double>{request, *found});
  addNarrowed(*found, o1, o2, query);
}

}  // namespace adaptive_bvh
