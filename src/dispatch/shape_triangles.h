#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include <fcl/geometry/shape/box.h>

#include "base/rigid.h"
#include "query/placed_mesh.h"
#include "solids/flat.h"
#include "solids/shape_solid.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// Candidates at this distance or farther do not matter to a query, as in FCL.
inline double limitOf(const DistanceQuery& query) {
  const double found = query.result.min_distance;
  return std::max(found - query.request.abs_err, found / (1 + query.request.rel_err));
}

/// The triangles of a mesh or of an FCL model, and their pose.
struct QueryTriangles {
  explicit QueryTriangles(const PlacedMesh& mesh)
      : QueryTriangles(mesh.mesh.view(), mesh.mesh.numTriangles(), mesh.tf,
                       mesh.bounds().aabb_center, mesh.bounds().aabb_radius) {}
  QueryTriangles(const MeshView<double>& view, int number, const fcl::Transform3d& placement,
                 const fcl::Vector3d& center, double radius)
      : points(view.vertices),
        count(number),
        tf(placement),
        coordinate_sum(center.lpNorm<1>() + 2 * radius) {
    corners.triangles = view.triangles;
  }

  TrianglePoints operator[](int triangle) const {
    const VertexIndices t = corners.verticesOf(static_cast<unsigned>(triangle));
    return {points[t[0]], points[t[1]], points[t[2]]};
  }

  const fcl::Vector3d* const points;
  MeshView<double> corners;  ///< without positions
  const int count;
  const fcl::Transform3d tf;
  const double coordinate_sum;  ///< upper bound of |x| + |y| + |z| of the points
};

/// The triangles of a query and a shape: tests each triangle, in the shape's frame.
class ShapeTriangles {
 public:
  ShapeTriangles(const QueryTriangles& triangles, const PlacedSolid& shape)
      : triangles_(triangles),
        shape_(shape.solid),
        shape_tf_(shape.tf),
        to_shape_(shape.tf, triangles.tf) {}

  const QueryTriangles& placed() const { return triangles_; }
  const Solid& shape() const { return shape_; }
  const fcl::Transform3d& shapeTransform() const { return shape_tf_; }
  /// The corners of a triangle in the shape's frame.
  TrianglePoints corners(int triangle) const {
    const TrianglePoints points = triangles_[triangle];
    return {to_shape_(points[0]), to_shape_(points[1]), to_shape_(points[2])};
  }
  TriangleGap gap(int triangle) const { return shape_.gap(corners(triangle)); }
  bool touches(int triangle, ShapeContact& contact) const {
    return shape_.touches(corners(triangle), contact);
  }
  /// Whether all triangles are at least `distance` from the shape, up to rounding, along one of two
  /// directions: the line between the nearest points of `triangle` and the shape, or the triangle's
  /// normal, if that is nearly the same. False if rounding could hide a contact.
  bool areSeparated(int triangle, const PointPair& nearest, double distance) const {
    constexpr double kNearly = 0.999;
    const DistanceRounding rounded = rounding(nearest);
    if (!rounded.isClear(distance)) return false;
    const double least = rounded.below(distance);
    const fcl::Vector3d line = (nearest.first - nearest.second).stableNormalized();
    const TrianglePoints x = corners(triangle);
    const fcl::Vector3d normal = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
    const double cosine = normal.dot(line);
    return areApart(line, least) ||
           (std::abs(cosine) > kNearly && areApart(cosine > 0 ? normal : -normal, least));
  }
  /// Rounding errors of all triangles' distances, given the nearest points of one and the shape.
  DistanceRounding rounding(const PointPair& nearest) const {
    return DistanceRounding(2 * nearest.first.lpNorm<1>() + nearest.second.lpNorm<1>() +
                            4 * triangles_.coordinate_sum);
  }
  /// Transforms a point, or a direction, from the shape's frame to the world.
  fcl::Vector3d inWorld(const fcl::Vector3d& x) const { return shape_tf_ * x; }
  fcl::Vector3d turnedToWorld(const fcl::Vector3d& direction) const {
    return shape_tf_.linear() * direction;
  }

 private:
  /// Whether all triangles are at least `least` from the shape along a unit vector in its frame.
  bool areApart(fcl::Vector3d along, double least) const {
    double shape_end;  // the largest coordinate of the shape's points along the vector
    if (const FlatSolid* const flat = shape_.flat()) {
      const double side = flat->normal().dot(along) < 0 ? -1 : 1;
      along = side * flat->normal();
      shape_end = side * flat->offset();
    } else {
      shape_end = along.dot(shape_.support(along));
    }
    const fcl::Vector3d in_mesh = to_shape_.R.transpose() * along;
    const double mesh_begin = shape_end + least - along.dot(to_shape_.T);
    constexpr int kSampleStride = 32;  // a sample is tested first, because it often decides
    for (const int stride : {kSampleStride, 1})
      for (int i = 0; i < triangles_.count; i += stride)
        for (const fcl::Vector3d& x : triangles_[i])
          if (!(in_mesh.dot(x) >= mesh_begin)) return false;
    return true;
  }

  const QueryTriangles triangles_;
  const Solid& shape_;
  const fcl::Transform3d shape_tf_;
  const RelativePlacement to_shape_;
};

/// A search for triangles near a shape: by a four-wide tree, or by FCL's traversal of a model.
class ShapeSearch {
 public:
  using Test = std::function<bool(int triangle)>;

  virtual ~ShapeSearch() = default;
  /// Calls test(triangle) for all triangles that may touch the shape, until it returns true.
  virtual void touching(const Test& test) const = 0;
  /// Calls test(triangle) for all triangles that may be nearer to the shape than query.result,
  /// nearest boxes first, until it returns true. The test updates query.result, and `points`, the
  /// nearest points so far, in the shape's frame.
  virtual void nearest(const DistanceQuery& query, const PointPair& points,
                       const Test& test) const = 0;
  /// Box of the whole mesh, for FCL's approximate cost.
  virtual void boxAround(fcl::Boxd& box, fcl::Transform3d& box_tf) const = 0;

  const ShapeTriangles triangles;

 protected:
  ShapeSearch(const QueryTriangles& mesh, const PlacedSolid& shape) : triangles(mesh, shape) {}
};

/// Lowers query.result to the distance of triangles and a shape; does not set its objects. Stops as
/// soon as the distance is at most `enough`.
void distanceToShape(const ShapeSearch& search, const DistanceQuery& query, double enough = 0);

/// Adds the contacts of triangles with a shape.
void collideWithShape(const ShapeSearch& search, const fcl::CollisionGeometryd& mesh,
                      const fcl::CollisionGeometryd& shape, const CollisionQuery& query);

}  // namespace adaptive_bvh
