#pragma once

#include <limits>
#include <utility>

#include <fcl/math/bv/AABB.h>
#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>

#include "base/rigid.h"
#include "mesh/mesh_view.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_contact.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// The triangles of an object of a query, and where it is.
template <typename S>
struct PlacedTriangles {
  const fcl::CollisionGeometry<S>* geometry;
  MeshView<S> view;
  const fcl::Transform3<S>& tf;

  TrianglePoints<S> operator[](int triangle) const {
    const VertexIndices t = view.verticesOf(static_cast<unsigned>(triangle));
    return {view.vertices[t[0]], view.vertices[t[1]], view.vertices[t[2]]};
  }
};

/// Adds the contacts of two triangles, by our own test: those touch whose distance is 0, and every
/// such pair has a contact, with all its fields when they are requested. (FCL decides by the signs
/// of rounded numbers. When a triangle is a segment or a point, it reads a plane that it did not
/// set.) `touching`: they are known to touch, neither is thin. At most `most` contacts. `to_first`
/// takes the second object to the first's frame.
template <typename S>
void addContactsOf(const PlacedTriangles<S>& first, const PlacedTriangles<S>& second,
                   const RelativePlacement& to_first, int id1, int id2, bool touching,
                   unsigned most, const fcl::CollisionRequest<S>& request,
                   fcl::CollisionResult<S>& result) {
  const bool occupied = first.geometry->isOccupied() && second.geometry->isOccupied();
  // Also for objects that are uncertain, that is, neither occupied nor free.
  const bool has_cost =
      request.enable_cost && !first.geometry->isFree() && !second.geometry->isFree();
  if (!occupied && !has_cost) return;
  const auto hasRoom = [&] { return result.numContacts() < request.num_max_contacts; };
  const auto addPair = [&] {
    if (hasRoom())
      result.addContact(fcl::Contact<S>(first.geometry, second.geometry, id1, id2, unsetPoint<S>(),
                                        unsetPoint<S>(), std::numeric_limits<S>::quiet_NaN()));
  };
  if (touching && occupied && !request.enable_contact && !request.enable_cost) return addPair();
  const TrianglePoints<S> p = first[id1], q = second[id2];
  const TrianglePoints<double> in_first = {to_first(q[0]), to_first(q[1]), to_first(q[2])};
  if (!touching && !touch(pointsAs<double>(p), in_first)) return;
  if (occupied && request.enable_contact) {
    const TriangleContact<S> contact = contactOf(p, pointsAs<S>(in_first));
    for (unsigned i = 0; i < contact.count && i < most && hasRoom(); ++i)
      result.addContact(fcl::Contact<S>(first.geometry, second.geometry, id1, id2,
                                        first.tf * contact.points[i],
                                        first.tf.linear() * contact.normal, contact.depth));
  } else if (occupied) {
    addPair();
  }
  if (!request.enable_cost) return;
  const auto boxOf = [](const fcl::Transform3<S>& tf, const TrianglePoints<S>& t) {
    return fcl::AABB<S>(tf * t[0], tf * t[1], tf * t[2]);
  };
  fcl::AABB<S> common;
  boxOf(first.tf, p).overlap(boxOf(second.tf, q), common);
  const S density = first.geometry->cost_density * second.geometry->cost_density;
  result.addCostSource(fcl::CostSource<S>(common, density), request.num_max_cost_sources);
}

}  // namespace adaptive_bvh
