// Distance, depth and contacts of a shape with the triangles that a ShapeSearch finds.
#include <algorithm>
#include <array>
#include <limits>

#include <fcl/geometry/shape/utility.h>

#include "dispatch/shape_triangles.h"

namespace adaptive_bvh {
namespace {

/// Lowers a query's distance by the triangles that a search finds.
class ShapeDistance {
 public:
  ShapeDistance(const ShapeSearch& search, const DistanceQuery& query, double enough)
      : search_(search),
        query_(query),
        enough_(enough),
        next_check_(std::max(kFirstCheck, search.triangles.placed().count / kTrianglesPerTest)) {}

  void run() {
    const double before = query_.result.min_distance;
    search_.nearest(query_, nearest_.points, [this](int triangle) { return take(triangle); });
    if (query_.result.min_distance <= 0 && query_.request.enable_signed_distance)
      takeDepth(before > 0 ? -1 : -before);
  }

 private:
  /// Tests a triangle. Returns whether the search is over.
  bool take(int triangle) {
    const TriangleGap gap = search_.triangles.gap(triangle);
    if (!(gap.distance < query_.result.min_distance)) return isOver();
    nearest_ = gap;
    query_.result.update(gap.distance, nullptr, nullptr, triangle, fcl::DistanceResultd::NONE,
                         search_.triangles.inWorld(gap.points.first),
                         search_.triangles.inWorld(gap.points.second));
    return query_.isSatisfied() || query_.result.min_distance <= enough_ || isOver();
  }
  /// Whether a plane proves that no triangle is nearer. Tried at intervals that double.
  bool isOver() {
    if (++tests_ < next_check_ || nearest_.distance < 0) return false;
    next_check_ = 2 * tests_;
    return search_.triangles.areSeparated(static_cast<int>(query_.result.b1), nearest_.points,
                                          std::min(nearest_.distance, limitOf(query_)));
  }

  /// Sets the distance to minus the largest depth of a triangle, if that exceeds `deepest`.
  void takeDepth(double deepest) const {
    search_.touching([this, &deepest](int triangle) {
      ShapeContact contact;
      if (!search_.triangles.touches(triangle, contact) || !(contact.depth > deepest)) return false;
      deepest = contact.depth;
      fcl::DistanceResultd& result = query_.result;
      result.min_distance = deepest > 0 ? -deepest : 0;
      result.b1 = triangle;
      result.nearest_points[0] = result.nearest_points[1] =
          search_.triangles.inWorld(contact.position);
      return false;
    });
  }

  const ShapeSearch& search_;
  const DistanceQuery& query_;
  const double enough_;
  static constexpr int kFirstCheck = 64, kTrianglesPerTest = 256;
  TriangleGap nearest_{{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()}, -1};  ///< so far
  int tests_ = 0, next_check_;
};

/// Adds the contacts and cost sources of the triangles that a search finds.
class ShapeContacts {
 public:
  ShapeContacts(const ShapeSearch& search, const fcl::CollisionGeometryd& mesh,
                const fcl::CollisionGeometryd& shape, const CollisionQuery& query)
      : search_(search), mesh_(mesh), shape_(shape), query_(query) {
    const ShapeTriangles& triangles = search.triangles;
    if (query.request.enable_cost)
      box_ = worldBoxOf({triangles.shape(), triangles.shapeTransform()});
  }

  void run() const {
    const bool occupied = mesh_.isOccupied() && shape_.isOccupied();
    const bool has_cost = query_.request.enable_cost && !mesh_.isFree() && !shape_.isFree();
    const bool has_exact_cost = has_cost && !query_.request.use_approximate_cost;
    if (occupied || has_exact_cost)
      search_.touching([this, occupied, has_exact_cost](int triangle) {
        return take(triangle, occupied, has_exact_cost);
      });
    if (has_cost && !has_exact_cost) addApproximateCost();
  }

 private:
  bool take(int triangle, bool adds_contact, bool adds_cost) const {
    ShapeContact contact;
    const bool touches = query_.request.enable_contact
                             ? search_.triangles.touches(triangle, contact)
                             : search_.triangles.gap(triangle).distance <= 0;
    if (!touches) return false;
    if (adds_contact) addContact(triangle, contact);
    if (adds_cost) addCost(boxOf(triangle));
    return query_.isSatisfied();
  }
  void addContact(int triangle, const ShapeContact& found) const {
    if (query_.result.numContacts() >= query_.request.num_max_contacts) return;
    fcl::Contactd contact(&mesh_, &shape_, triangle, fcl::Contactd::NONE, unsetPoint(),
                          unsetPoint(), std::numeric_limits<double>::quiet_NaN());
    if (query_.request.enable_contact) {
      contact.pos = search_.triangles.inWorld(found.position);
      contact.normal = search_.triangles.turnedToWorld(found.normal);
      contact.penetration_depth = found.depth;
    }
    query_.result.addContact(contact);
  }

  fcl::AABBd boxOf(int triangle) const {
    const auto& placed = search_.triangles.placed();
    const TrianglePoints x = placed[triangle];
    return fcl::AABBd(placed.tf * x[0], placed.tf * x[1], placed.tf * x[2]);
  }
  void addCost(const fcl::AABBd& mesh_box) const {
    fcl::AABBd common;
    mesh_box.overlap(box_, common);
    query_.result.addCostSource(fcl::CostSourced(common, mesh_.cost_density * shape_.cost_density),
                                query_.request.num_max_cost_sources);
  }

  /// Adds FCL's approximate cost: the box around the whole mesh, if it touches the shape.
  void addApproximateCost() const {
    const Solid& shape = search_.triangles.shape();
    const fcl::Transform3d& shape_tf = search_.triangles.shapeTransform();
    fcl::Boxd box;
    fcl::Transform3d box_tf;
    search_.boxAround(box, box_tf);
    const RelativePlacement to_shape(shape_tf, box_tf);
    std::array<fcl::Vector3d, 8> corners;
    for (std::size_t i = 0; i < 8; ++i)
      corners[i] = to_shape(fcl::Vector3d(box.side.cwiseProduct(
          fcl::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1) / 2)));
    const ShapeCore core = shape.core();
    const fcl::Vector3d middle =
        RelativePlacement(box_tf, shape_tf)(fcl::Vector3d((core.low + core.high) / 2));
    const bool is_inside = (middle.cwiseAbs().array() <= box.side.array() / 2).all();
    if (!is_inside && !touchesSurface(corners)) return;
    fcl::AABBd around;
    fcl::computeBV(box, box_tf, around);
    addCost(around);
  }
  /// Whether the shape touches a face of a box with the corners x.
  bool touchesSurface(const std::array<fcl::Vector3d, 8>& x) const {
    const std::size_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                      {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                      {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return std::any_of(std::begin(faces), std::end(faces), [&](const auto& f) {
      return search_.triangles.shape().gap({x[f[0]], x[f[1]], x[f[2]]}).distance <= 0;
    });
  }

  const ShapeSearch& search_;
  const fcl::CollisionGeometryd &mesh_, &shape_;
  const CollisionQuery& query_;
  fcl::AABBd box_;  ///< of the shape in the world, if costs are requested
};

}  // namespace

void distanceToShape(const ShapeSearch& search, const DistanceQuery& query, double enough) {
  ShapeDistance(search, query, enough).run();
}

void collideWithShape(const ShapeSearch& search, const fcl::CollisionGeometryd& mesh,
                      const fcl::CollisionGeometryd& shape, const CollisionQuery& query) {
  ShapeContacts(search, mesh, shape, query).run();
}

}  // namespace adaptive_bvh
