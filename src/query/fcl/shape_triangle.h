#pragma once

#include <algorithm>
#include <limits>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

#include "geometry/triangle_gap.h"
#include "query/unset_fields.h"

namespace adaptive_bvh {

/// The distance of a shape and a triangle of a mesh, -1 when they touch: of spheres, capsules and
/// boxes by their geometry, of others by FCL's solvers.
template <typename S>
struct ShapeTriangleDistance {
  S distance = -1;
  fcl::Vector3<S> on_shape = unsetPoint<S>(), on_triangle = unsetPoint<S>();  ///< in the world
};

template <typename BV, typename Shape, typename Solver, typename S = typename BV::S>
ShapeTriangleDistance<S> shapeTriangleDistance(const Solver& solver, const Shape& shape,
                                               const fcl::Transform3<S>& shape_tf,
                                               const fcl::BVHModel<BV>& mesh,
                                               const fcl::Transform3<S>& mesh_tf, int triangle) {
  const fcl::Triangle& corners = mesh.tri_indices[triangle];
  ShapeTriangleDistance<S> found;
  if (!solver.shapeTriangleDistance(shape, shape_tf, mesh.vertices[corners[0]],
                                    mesh.vertices[corners[1]], mesh.vertices[corners[2]], mesh_tf,
                                    &found.distance, &found.on_shape, &found.on_triangle))
    return {};
  return found;
}

/// A triangle of a mesh in the frame of a shape.
template <typename BV, typename S = typename BV::S>
TrianglePoints<double> triangleInShape(const fcl::BVHModel<BV>& mesh, int triangle,
                                       const fcl::Transform3<S>& mesh_tf,
                                       const fcl::Transform3<S>& shape_tf) {
  const auto linear = [](const fcl::Transform3<S>& tf) -> fcl::Matrix3d {
    return tf.linear().template cast<double>();
  };
  const auto translation = [](const fcl::Transform3<S>& tf) -> fcl::Vector3d {
    return tf.translation().template cast<double>();
  };
  const fcl::Matrix3d R = linear(shape_tf).transpose() * linear(mesh_tf);
  const fcl::Vector3d T =
      linear(shape_tf).transpose() * (translation(mesh_tf) - translation(shape_tf));
  const fcl::Triangle& t = mesh.tri_indices[triangle];
  TrianglePoints<double> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = R * mesh.vertices[t[int(k)]].template cast<double>() + T;
  return corners;
}

/// The points are in the frame of the shape, whose surface is `radius` around the second.
template <typename S>
ShapeTriangleDistance<S> inWorld(const TriangleGap& gap, double radius,
                                 const fcl::Transform3<S>& shape_tf) {
  if (!(gap.distance > radius)) return {};
  const fcl::Vector3d& on_triangle = gap.points.first;
  const fcl::Vector3d on_shape =
      gap.points.second + (on_triangle - gap.points.second) * (radius / gap.distance);
  return {static_cast<S>(gap.distance - radius), shape_tf * on_shape.template cast<S>(),
          shape_tf * on_triangle.template cast<S>()};
}

template <typename BV, typename Solver, typename S = typename BV::S>
ShapeTriangleDistance<S> shapeTriangleDistance(const Solver&, const fcl::Sphere<S>& sphere,
                                               const fcl::Transform3<S>& sphere_tf,
                                               const fcl::BVHModel<BV>& mesh,
                                               const fcl::Transform3<S>& mesh_tf, int triangle) {
  const TrianglePoints<double> corners = triangleInShape(mesh, triangle, mesh_tf, sphere_tf);
  const fcl::Vector3d center = fcl::Vector3d::Zero();
  TriangleGap gap{{nearestPoint(corners, center), center}, 0};
  gap.distance = gap.points.first.norm();
  return inWorld(gap, static_cast<double>(sphere.radius), sphere_tf);
}

template <typename BV, typename Solver, typename S = typename BV::S>
ShapeTriangleDistance<S> shapeTriangleDistance(const Solver&, const fcl::Capsule<S>& capsule,
                                               const fcl::Transform3<S>& capsule_tf,
                                               const fcl::BVHModel<BV>& mesh,
                                               const fcl::Transform3<S>& mesh_tf, int triangle) {
  const fcl::Vector3d end(0, 0, static_cast<double>(capsule.lz) / 2);
  return inWorld(gapOf(triangleInShape(mesh, triangle, mesh_tf, capsule_tf), {end, -end, -end}),
                 static_cast<double>(capsule.radius), capsule_tf);
}

/// A triangle that is apart from a box is nearest to a face whose plane it is beyond, at least with
/// a corner; and one that crosses the box, without a corner inside, crosses such a face.
template <typename BV, typename Solver, typename S = typename BV::S>
ShapeTriangleDistance<S> shapeTriangleDistance(const Solver&, const fcl::Box<S>& box,
                                               const fcl::Transform3<S>& box_tf,
                                               const fcl::BVHModel<BV>& mesh,
                                               const fcl::Transform3<S>& mesh_tf, int triangle) {
  const TrianglePoints<double> corners = triangleInShape(mesh, triangle, mesh_tf, box_tf);
  const fcl::Vector3d half = box.side.template cast<double>() / 2;
  for (const fcl::Vector3d& x : corners)
    if ((x.cwiseAbs().array() <= half.array()).all()) return {};
  TriangleGap nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1., 1.}) {
      const double beyond =
          std::max({side * corners[0][k], side * corners[1][k], side * corners[2][k]});
      if (beyond < half[k]) continue;
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const auto corner = [&](double u, double v) -> fcl::Vector3d {
        fcl::Vector3d x;
        x[k] = side * half[k];
        x[i] = u * half[i];
        x[j] = v * half[j];
        return x;
      };
      for (const double w : {-1., 1.}) {
        const TriangleGap gap = gapOf(corners, {corner(-1, -1), corner(1, 1), corner(w, -w)});
        if (gap.distance < nearest.distance) nearest = gap;
      }
    }
  return inWorld(nearest, 0, box_tf);
}

}  // namespace adaptive_bvh
