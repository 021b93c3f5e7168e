#include <fcl/geometry/shape/utility.h>

#include "query/fcl/mesh_shape.h"
#include "query/fcl/mesh_shape_search.h"
#include "query/fcl/shape_geometry.h"
#include "query/unset_fields.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// A box along the world's axes around a shape in its place, as FCL has it; infinite where it is.
template <typename S>
fcl::AABB<S> boxAround(const fcl::CollisionGeometry<S>& shape, const ShapeCore& core,
                       const fcl::Transform3<S>& tf) {
  if (shape.getNodeType() == fcl::GEOM_CONVEX) {
    fcl::AABB<S> box;
    for (const fcl::Vector3<S>& x : static_cast<const fcl::Convex<S>&>(shape).getVertices())
      box += tf * x;
    return box;
  }
  const fcl::Matrix3d R = tf.linear().template cast<double>() * core.axes;
  fcl::Vector3d low = tf.translation().template cast<double>(), high = low;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      if (R(i, k) == 0) continue;  // 0 times an infinite side
      low[i] += std::min(R(i, k) * core.low[k], R(i, k) * core.high[k]);
      high[i] += std::max(R(i, k) * core.low[k], R(i, k) * core.high[k]);
    }
    low[i] -= core.radius;
    high[i] += core.radius;
  }
  return fcl::AABB<S>(low.template cast<S>(), high.template cast<S>());
}

/// One query. All that depends on the type of the shape is behind TriangleShape.
template <typename BV>
class ShapeCollision {
 public:
  using S = typename BV::S;

  ShapeCollision(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& shape,
                 const TriangleShape& geometry, const ShapeCore& core,
                 const CollisionQuery<S>& query)
      : mesh_(mesh),
        shape_(shape),
        geometry_(geometry),
        core_(core),
        box_(boxAround(*shape.geometry, core, shape.tf)),
        search_(mesh, geometry, core, shape.tf),
        query_(query) {}

  void run() const {
    const fcl::CollisionGeometry<S>&mesh = *mesh_.model, &shape = *shape_.geometry;
    const bool occupied = mesh.isOccupied() && shape.isOccupied();
    const bool has_cost = query_.request.enable_cost && !mesh.isFree() && !shape.isFree();
    const bool has_exact_cost = has_cost && !query_.request.use_approximate_cost;
    if (occupied || has_exact_cost)
      search_.touching([&](int triangle) {
        ShapeContact contact;
        const bool touches = query_.request.enable_contact ? search_.touches(triangle, contact)
                                                           : search_.gap(triangle).distance <= 0;
        if (!touches) return false;
        if (occupied) addContact(triangle, contact);
        if (has_exact_cost) addCost(boxOf(triangle));
        return query_.isSatisfied();
      });
    if (has_cost && !has_exact_cost) addApproximateCost();
  }

 private:
  void addContact(int triangle, const ShapeContact& found) const {
    if (query_.result.numContacts() >= query_.request.num_max_contacts) return;
    fcl::Contact<S> contact(mesh_.model, shape_.geometry, triangle, fcl::Contact<S>::NONE,
                            unsetPoint<S>(), unsetPoint<S>(), std::numeric_limits<S>::quiet_NaN());
    if (query_.request.enable_contact) {
      contact.pos = search_.inWorld(found.position);
      contact.normal = search_.turnedToWorld(found.normal);
      contact.penetration_depth = static_cast<S>(found.depth);
    }
    query_.result.addContact(contact);
  }

  fcl::AABB<S> boxOf(int triangle) const {
    const fcl::Triangle& t = mesh_.model->tri_indices[triangle];
    const fcl::Vector3<S>* x = mesh_.model->vertices;
    return fcl::AABB<S>(mesh_.tf * x[t[0]], mesh_.tf * x[t[1]], mesh_.tf * x[t[2]]);
  }
  void addCost(const fcl::AABB<S>& of_mesh) const {
    fcl::AABB<S> common;
    of_mesh.overlap(box_, common);
    query_.result.addCostSource(
        fcl::CostSource<S>(common, mesh_.model->cost_density * shape_.geometry->cost_density),
        query_.request.num_max_cost_sources);
  }

  /// FCL's approximate cost: the mesh's root volume as a box against the shape. (FCL centres that
  /// box on the rectangle's corner; kept, so that the field is FCL's.)
  void addApproximateCost() const {
    updateVolumes(mesh_);
    fcl::Box<S> box;
    fcl::Transform3<S> box_tf;
    fcl::constructBox(mesh_.model->getBV(0).bv, mesh_.tf, box, box_tf);
    const RelativePlacement to_shape(shape_.tf, box_tf);
    std::array<fcl::Vector3d, 8> corners;
    for (std::size_t i = 0; i < 8; ++i)
      corners[i] = to_shape(fcl::Vector3<S>(box.side.cwiseProduct(
          fcl::Vector3<S>(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1) / 2)));
    const fcl::Vector3d middle =
        RelativePlacement(box_tf, shape_.tf)(fcl::Vector3d((core_.low + core_.high) / 2));
    const bool is_inside =
        (middle.cwiseAbs().array() <= box.side.template cast<double>().array() / 2).all();
    if (!is_inside && !touchesSurface(corners)) return;
    fcl::AABB<S> around;
    fcl::computeBV(box, box_tf, around);
    addCost(around);
  }
  bool touchesSurface(const std::array<fcl::Vector3d, 8>& x) const {
    const std::size_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                      {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                      {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return std::any_of(std::begin(faces), std::end(faces), [&](const auto& f) {
      return geometry_.gap({x[f[0]], x[f[1]], x[f[2]]}).distance <= 0;
    });
  }

  const PlacedMesh<BV>& mesh_;
  const PlacedGeometry<S>& shape_;
  const TriangleShape& geometry_;
  const ShapeCore& core_;
  const fcl::AABB<S> box_;
  const MeshShapeSearch<BV> search_;
  const CollisionQuery<S>& query_;
};

}  // namespace

template <typename BV>
std::size_t meshShapeCollide(const PlacedMesh<BV>& mesh,
                             const PlacedGeometry<typename BV::S>& shape,
                             const CollisionQuery<typename BV::S>& query) {
  if (query.isSatisfied()) return query.result.numContacts();
  visitShape(*shape.geometry, [&](const TriangleShape& geometry, const ShapeCore& core) {
    ShapeCollision<BV>(mesh, shape, geometry, core, query).run();
  });
  return query.result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                         \
  template std::size_t meshShapeCollide(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&, \
                                        const CollisionQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
