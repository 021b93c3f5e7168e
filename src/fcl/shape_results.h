#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/utility.h>

#include "fcl/shape_geometry.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_gap.h"
#include "triangles/triangle_shape.h"

namespace adaptive_bvh {

/// The distance of the triangles of a mesh or model and a shape. `Search`: MeshShapeSearch or
/// ModelShapeSearch. All that depends on the type of the shape is behind TriangleShape.
template <typename S, typename Search>
class ShapeDistance {
 public:
  /// Ends where the distance is at most `enough`.
  ShapeDistance(const PlacedGeometry<S>& shape, const Search& search, const DistanceQuery<S>& query,
                S enough)
      : shape_(shape),
        search_(search),
        query_(query),
        enough_(enough),
        next_check_(std::max(kMany, search.triangles.count() / kShare)) {}

  void run() {
    search_.nearest(query_, nearest_.points, [&](int triangle) { return take(triangle); });
    const fcl::DistanceResult<S>& result = query_.result;
    if (result.o1 != object() || result.o2 != shape_.geometry) return;
    if (result.min_distance <= 0 && query_.request.enable_signed_distance) takeDepth();
  }

 private:
  const fcl::CollisionGeometry<S>* object() const { return search_.triangles.placed().geometry; }

  bool take(int triangle) {
    const TriangleGap gap = search_.triangles.gap(triangle);
    if (!(gap.distance < double(query_.result.min_distance))) return isOver();
    nearest_ = gap;
    query_.result.update(distanceAs<S>(gap.distance), object(), shape_.geometry, triangle,
                         fcl::DistanceResult<S>::NONE, search_.triangles.inWorld(gap.points.first),
                         search_.triangles.inWorld(gap.points.second));
    return query_.isSatisfied() || query_.result.min_distance <= enough_ || isOver();
  }
  /// Whether the triangles as a whole are as far from the shape as the nearest one so far. Looks
  /// only after many tests.
  bool isOver() {
    if (++tests_ < next_check_ || nearest_.distance < 0) return false;
    next_check_ = 2 * tests_;
    return search_.triangles.areSeparated(static_cast<int>(query_.result.b1), nearest_.points,
                                          std::min(nearest_.distance, limitOf(query_)));
  }

  /// The deepest triangle's depth, negative.
  void takeDepth() const {
    fcl::DistanceResult<S>& result = query_.result;
    double deepest = -1;
    search_.touching([&](int triangle) {
      ShapeContact contact;
      if (!search_.triangles.touches(triangle, contact) || !(contact.depth > deepest)) return false;
      deepest = contact.depth;
      result.b1 = triangle;
      result.nearest_points[0] = result.nearest_points[1] =
          search_.triangles.inWorld(contact.position);
      return false;
    });
    result.min_distance = deepest > 0 ? static_cast<S>(-deepest) : S(0);
  }

  const PlacedGeometry<S>& shape_;
  const Search& search_;
  const DistanceQuery<S>& query_;
  const S enough_;
  static constexpr int kMany = 64, kShare = 256;
  TriangleGap nearest_{{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()}, -1};  ///< so far
  int tests_ = 0, next_check_;
};

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

/// The contacts of the triangles of a mesh or model with a shape. `Search`: MeshShapeSearch or
/// ModelShapeSearch. All that depends on the type of the shape is behind TriangleShape.
template <typename S, typename Search>
class ShapeContacts {
 public:
  ShapeContacts(const PlacedGeometry<S>& shape, const TriangleShape& geometry,
                const ShapeCore& core, const Search& search, const CollisionQuery<S>& query)
      : shape_(shape),
        geometry_(geometry),
        core_(core),
        box_(boxAround(*shape.geometry, core, shape.tf)),
        search_(search),
        query_(query) {}

  void run() const {
    const fcl::CollisionGeometry<S>&mesh = object(), &shape = *shape_.geometry;
    const bool occupied = mesh.isOccupied() && shape.isOccupied();
    const bool has_cost = query_.request.enable_cost && !mesh.isFree() && !shape.isFree();
    const bool has_exact_cost = has_cost && !query_.request.use_approximate_cost;
    if (occupied || has_exact_cost)
      search_.touching([&](int triangle) {
        ShapeContact contact;
        const bool touches = query_.request.enable_contact
                                 ? search_.triangles.touches(triangle, contact)
                                 : search_.triangles.gap(triangle).distance <= 0;
        if (!touches) return false;
        if (occupied) addContact(triangle, contact);
        if (has_exact_cost) addCost(boxOf(triangle));
        return query_.isSatisfied();
      });
    if (has_cost && !has_exact_cost) addApproximateCost();
  }

 private:
  const fcl::CollisionGeometry<S>& object() const { return *search_.triangles.placed().geometry; }
  void addContact(int triangle, const ShapeContact& found) const {
    if (query_.result.numContacts() >= query_.request.num_max_contacts) return;
    fcl::Contact<S> contact(&object(), shape_.geometry, triangle, fcl::Contact<S>::NONE,
                            unsetPoint<S>(), unsetPoint<S>(), std::numeric_limits<S>::quiet_NaN());
    if (query_.request.enable_contact) {
      contact.pos = search_.triangles.inWorld(found.position);
      contact.normal = search_.triangles.turnedToWorld(found.normal);
      contact.penetration_depth = static_cast<S>(found.depth);
    }
    query_.result.addContact(contact);
  }

  fcl::AABB<S> boxOf(int triangle) const {
    const auto& placed = search_.triangles.placed();
    const TrianglePoints<S> x = pointsAs<S>(placed[triangle]);
    return fcl::AABB<S>(placed.tf * x[0], placed.tf * x[1], placed.tf * x[2]);
  }
  void addCost(const fcl::AABB<S>& of_mesh) const {
    fcl::AABB<S> common;
    of_mesh.overlap(box_, common);
    query_.result.addCostSource(
        fcl::CostSource<S>(common, object().cost_density * shape_.geometry->cost_density),
        query_.request.num_max_cost_sources);
  }

  /// FCL's approximate cost: a box around the whole mesh against the shape.
  void addApproximateCost() const {
    fcl::Box<S> box;
    fcl::Transform3<S> box_tf;
    search_.boxAround(box, box_tf);
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

  const PlacedGeometry<S>& shape_;
  const TriangleShape& geometry_;
  const ShapeCore& core_;
  const fcl::AABB<S> box_;
  const Search& search_;
  const CollisionQuery<S>& query_;
};

}  // namespace adaptive_bvh
