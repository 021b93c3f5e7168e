#pragma once

#include <limits>

#include <fcl/math/bv/AABB.h>

#include "geometry/triangle_intersection.h"
#include "query/candidate_tests.h"
#include "query/triangle_contacts.h"
#include "query/triangle_search.h"

namespace adaptive_bvh {

/// The test of two triangles of a query, which adds their contacts.
template <typename S>
class ContactNode {
 public:
  /// `is_self`: both meshes are the same in the same place: the triangle with the smaller index is
  /// tested as the first, and a pair has one contact.
  ContactNode(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
              const CollisionQuery<S>& query, bool is_self)
      : request(query.request),
        result(&query.result),
        first_(first),
        second_(second),
        to_first_(is_self ? RelativePlacement() : RelativePlacement(first.tf, second.tf)),
        is_self_(is_self) {}

  fcl::CollisionRequest<S> request;
  fcl::CollisionResult<S>* result;

  const RelativePlacement& toFirst() const { return to_first_; }
  /// Two triangles that touch, neither of them thin.
  void add(int triangle1, int triangle2) const { test(triangle1, triangle2, true); }
  void test(int triangle1, int triangle2) const { test(triangle1, triangle2, false); }
  bool isDone() const { return request.isSatisfied(*result); }

 private:
  void test(int triangle1, int triangle2, bool touching) const {
    if (is_self_ && triangle2 < triangle1) std::swap(triangle1, triangle2);
    addContactsOf<S>({first_.geometry, first_.mesh.view(), first_.tf},
                     {second_.geometry, second_.mesh.view(), second_.tf}, to_first_, triangle1,
                     triangle2, touching, is_self_ ? 1 : 2, request, *result);
  }

  const PlacedMesh<S>&first_, &second_;
  const RelativePlacement to_first_;
  const bool is_self_;
};

/// Its output is a ContactNode, which takes the contacts.
template <typename S, typename Frame>
using ContactSearch = TriangleSearch<CandidateTests<S, Frame, const ContactNode<S>>>;

}  // namespace adaptive_bvh
