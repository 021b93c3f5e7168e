#include "dispatch/contained.h"

#include "query/depth/depth_meshes.h"
#include "solids/hull.h"

namespace adaptive_bvh {
namespace {

/// The contact of a point x (in the mesh's frame) inside a mesh: the motion to the nearest surface.
class InsideContact {
 public:
  InsideContact(const PlacedMesh& around, const fcl::Vector3d& x, MeshTarget& target)
      : tf_(around.tf) {
    point_.x = x;
    target.measure(point_, 0);
    target.findNearest(point_, bounds_);
  }

  int nearestTriangle() const { return point_.witness; }
  /// Sets position, normal and depth. `sign`: 1 if the mesh is the first object, else -1.
  void describe(double sign, fcl::Contactd& contact) const {
    constexpr double kShort = 1e-8;
    const fcl::Vector3d path = bounds_.nearest - point_.x;
    const bool is_short = !(point_.distance > kShort * point_.x.norm());
    const fcl::Vector3d outward = is_short ? bounds_.outward : fcl::Vector3d(path / path.norm());
    contact.pos = tf_ * point_.x;
    contact.normal = (sign * (tf_.linear() * outward)).normalized();
    contact.penetration_depth = point_.distance;
  }

 private:
  const fcl::Transform3d tf_;
  DepthPoint<int> point_;
  DepthBounds bounds_;
};

void add(fcl::Contactd contact, const InsideContact& inside, double sign,
         const CollisionQuery& query) {
  if (query.request.enable_contact) inside.describe(sign, contact);
  query.result.addContact(contact);
}

/// Calls visit(x, target) if a bounded shape is inside a mesh; x is a point of it, in the mesh.
template <typename Visit>
void visitShapeInside(const PlacedSolid& shape, const PlacedMesh& around, const Visit& visit) {
  if (shape.solid.flat()) return;
  const HullSolid* const hull = shape.solid.hull();
  const fcl::Vector3d of_shape = hull ? hull->point(0) : fcl::Vector3d(fcl::Vector3d::Zero());
  const fcl::Vector3d x = RelativePlacement(around.tf, shape.tf)(of_shape);
  MeshTarget target(around);
  if (!target.isClear(x, 0) && target.isInside(x)) visit(x, target);
}

}  // namespace

void addContained(const PlacedMesh& mesh, const PlacedMesh& around, bool is_around_first,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query) {
  if (!o1.isOccupied() || !o2.isOccupied()) return;
  visitContained(mesh, around, [&](int triangle, const fcl::Vector3d& x, MeshTarget& target) {
    const InsideContact inside(around, x, target);
    const int nearest = inside.nearestTriangle();
    add(is_around_first ? fcl::Contactd(&o1, &o2, nearest, triangle)
                        : fcl::Contactd(&o1, &o2, triangle, nearest),
        inside, is_around_first ? 1 : -1, query);
    return !query.isSatisfied() && query.result.numContacts() < query.request.num_max_contacts;
  });
}

bool isContained(const PlacedSolid& shape, const PlacedMesh& around) {
  bool is_contained = false;
  visitShapeInside(shape, around, [&](const fcl::Vector3d&, MeshTarget&) { is_contained = true; });
  return is_contained;
}

void addContained(const PlacedSolid& shape, const PlacedMesh& around,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query) {
  if (!o1.isOccupied() || !o2.isOccupied()) return;
  visitShapeInside(shape, around, [&](const fcl::Vector3d& x, MeshTarget& target) {
    const InsideContact inside(around, x, target);
    add(fcl::Contactd(&o1, &o2, inside.nearestTriangle(), fcl::Contactd::NONE), inside, 1, query);
  });
}

}  // namespace adaptive_bvh
