#include "fcl/mesh_pairs.h"

#include <fcl/geometry/shape/convex.h>

#include "query/depth_meshes.h"

namespace adaptive_bvh {
namespace {

/// The contact of a point inside of a mesh: how it gets out at the nearest point of the surface.
template <typename S>
class InsideContact {
 public:
  InsideContact(const MeshObject<S>& around, const fcl::Vector3d& x, MeshTarget& target)
      : tf_(around.placed.tf) {
    point_.x = x;
    target.measure(point_, 0);
    target.findNearest(point_, bounds_);
  }

  int nearestTriangle() const { return point_.witness; }
  /// `sign`: 1 where the point moves along the normal to get out, -1 where the mesh does.
  void describe(double sign, fcl::Contact<S>& contact) const {
    constexpr double kShort = 1e-8;
    const fcl::Vector3d way = bounds_.nearest - point_.x;
    const bool is_short = !(point_.distance > kShort * point_.x.norm());
    const fcl::Vector3d out = is_short ? bounds_.outward : fcl::Vector3d(way / way.norm());
    contact.pos = (tf_ * point_.x).template cast<S>();
    contact.normal = (sign * (tf_.linear() * out)).normalized().template cast<S>();
    contact.penetration_depth = static_cast<S>(point_.distance);
  }

 private:
  const fcl::Transform3<double> tf_;
  DepthPoint<int> point_;
  DepthBounds bounds_;
};

template <typename S>
void add(fcl::Contact<S> contact, const InsideContact<S>& inside, double sign,
         const CollisionQuery<S>& query) {
  if (query.request.enable_contact) inside.describe(sign, contact);
  query.result.addContact(contact);
}

/// Any point of a bounded shape, in its frame.
template <typename S>
fcl::Vector3<S> pointOf(const fcl::CollisionGeometry<S>& shape) {
  if (shape.getNodeType() != fcl::GEOM_CONVEX) return fcl::Vector3<S>::Zero();
  return static_cast<const fcl::Convex<S>&>(shape).getVertices()[0];
}

/// Calls visit(x, target) where a shape is inside of a mesh, with a point of it.
template <typename S, typename Visit>
void visitShapeInside(const PlacedGeometry<S>& shape, const MeshObject<S>& around,
                      const Visit& visit) {
  const fcl::NODE_TYPE type = shape.geometry->getNodeType();
  if (type == fcl::GEOM_PLANE || type == fcl::GEOM_HALFSPACE) return;
  const fcl::Vector3d x = RelativePlacement(around.tf, shape.tf)(pointOf(*shape.geometry));
  MeshTarget target(around.placed);
  if (!target.isClear(x, 0) && target.isInside(x)) visit(x, target);
}

}  // namespace

template <typename S>
void addContained(const MeshObject<S>& mesh, const MeshObject<S>& around, bool is_around_first,
                  const CollisionQuery<S>& query) {
  if (!mesh.geometry->isOccupied() || !around.geometry->isOccupied()) return;
  visitContained(
      mesh.placed, around.placed, [&](int triangle, const fcl::Vector3d& x, MeshTarget& target) {
        const InsideContact<S> inside(around, x, target);
        const int at = inside.nearestTriangle();
        const fcl::CollisionGeometry<S>*one = mesh.geometry, *other = around.geometry;
        add(is_around_first ? fcl::Contact<S>(other, one, at, triangle)
                            : fcl::Contact<S>(one, other, triangle, at),
            inside, is_around_first ? 1 : -1, query);
        return !query.isSatisfied() && query.result.numContacts() < query.request.num_max_contacts;
      });
}

template <typename S>
bool isContained(const PlacedGeometry<S>& shape, const MeshObject<S>& around) {
  bool is_contained = false;
  visitShapeInside(shape, around, [&](const fcl::Vector3d&, MeshTarget&) { is_contained = true; });
  return is_contained;
}

template <typename S>
void addContained(const PlacedGeometry<S>& shape, const MeshObject<S>& around,
                  const CollisionQuery<S>& query) {
  if (!shape.geometry->isOccupied() || !around.geometry->isOccupied()) return;
  visitShapeInside(shape, around, [&](const fcl::Vector3d& x, MeshTarget& target) {
    const InsideContact<S> inside(around, x, target);
    add(fcl::Contact<S>(around.geometry, shape.geometry, inside.nearestTriangle(),
                        fcl::Contact<S>::NONE),
        inside, 1, query);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                            \
  template void addContained(const MeshObject<S>&, const MeshObject<S>&, bool, \
                             const CollisionQuery<S>&);                        \
  template bool isContained(const PlacedGeometry<S>&, const MeshObject<S>&);   \
  template void addContained(const PlacedGeometry<S>&, const MeshObject<S>&,   \
                             const CollisionQuery<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
