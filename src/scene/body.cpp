#include "scene/body.h"

#include <limits>
#include <stdexcept>

#include <fcl/config.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#endif

#include "deformable/mesh_state.h"

namespace adaptive_bvh {
namespace {

using fcl::Vector3d;

/// Half the extent along each axis of a box that is turned.
Vector3d turnedHalf(const fcl::Matrix3d& rotation, const Vector3d& half) {
  return rotation.cwiseAbs() * half;
}

/// Boxes of four nodes below the root, in the mesh's own axes, turned into the world.
template <typename S>
WorldBox boxOfMesh(const MeshState<S>& mesh, const fcl::Transform3<S>& tf) {
  const BodyCoordinates& coordinates = mesh.tree.coordinates();
  const fcl::Matrix3d turn = tf.linear().template cast<double>() * coordinates.axes();
  const Vector3d origin = tf.linear().template cast<double>() * coordinates.origin +
                          tf.translation().template cast<double>();
  WorldBox box = {Vector3d::Constant(std::numeric_limits<double>::infinity()),
                  Vector3d::Constant(-std::numeric_limits<double>::infinity())};
  const auto add = [&](const Boxes4& boxes, int lane) {
    const auto corner = [&](const Float4* of) -> Vector3d {
      return {double(of[0][lane]), double(of[1][lane]), double(of[2][lane])};
    };
    const Vector3d low = corner(boxes.low), high = corner(boxes.high);
    const Vector3d middle = origin + turn * (low + high) / (2 * coordinates.scale),
                   half = turnedHalf(turn, (high - low) / (2 * coordinates.scale));
    box.low = box.low.cwiseMin(middle - half);
    box.high = box.high.cwiseMax(middle + half);
  };
  const WideNode* const nodes = mesh.tree.nodes();
  for (int i = 0; i < int(nodes[0].count); ++i) {
    if (nodes[0].isLeaf()) {
      add(nodes[0].boxes, i);
      continue;
    }
    const WideNode& below = nodes[nodes[0].below[i]];
    for (int j = 0; j < int(below.count); ++j) add(below.boxes, j);
  }
  return box;
}

/// Of what is symmetric about its own origin.
template <typename S>
WorldBox around(const fcl::Transform3<S>& tf, const Vector3d& half) {
  const Vector3d middle = tf.translation().template cast<double>(),
                 extent = turnedHalf(tf.linear().template cast<double>(), half);
  return {middle - extent, middle + extent};
}

template <typename S>
WorldBox boxOfConvex(const fcl::Convex<S>& convex, const fcl::Transform3<S>& tf) {
  WorldBox box = {Vector3d::Constant(std::numeric_limits<double>::infinity()),
                  Vector3d::Constant(-std::numeric_limits<double>::infinity())};
  for (const fcl::Vector3<S>& x : convex.getVertices()) {
    const Vector3d at = tf.template cast<double>() * x.template cast<double>();
    box.low = box.low.cwiseMin(at);
    box.high = box.high.cwiseMax(at);
  }
  return box;
}

template <typename S>
WorldBox boxOfShape(const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf) {
  const auto round = [](S radius, S length) -> Vector3d {
    return {double(radius), double(radius), double(length) / 2};
  };
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE: {
      const Vector3d half =
          Vector3d::Constant(double(static_cast<const fcl::Sphere<S>&>(shape).radius));
      const Vector3d middle = tf.translation().template cast<double>();
      return {middle - half, middle + half};
    }
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      return around(tf, round(capsule.radius, capsule.lz + 2 * capsule.radius));
    }
    case fcl::GEOM_BOX:
      return around(tf, static_cast<const fcl::Box<S>&>(shape).side.template cast<double>() / 2);
    case fcl::GEOM_CYLINDER: {
      const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(shape);
      return around(tf, round(cylinder.radius, cylinder.lz));
    }
    case fcl::GEOM_CONE: {
      const auto& cone = static_cast<const fcl::Cone<S>&>(shape);
      return around(tf, round(cone.radius, cone.lz));
    }
    case fcl::GEOM_ELLIPSOID:
      return around(tf, static_cast<const fcl::Ellipsoid<S>&>(shape).radii.template cast<double>());
    case fcl::GEOM_CONVEX: return boxOfConvex(static_cast<const fcl::Convex<S>&>(shape), tf);
#if FCL_HAVE_OCTOMAP
    case fcl::GEOM_OCTREE: {
      const fcl::AABB<S> root = static_cast<const fcl::OcTree<S>&>(shape).getRootBV();
      const Vector3d middle = tf.template cast<double>() *
                              ((root.min_ + root.max_).template cast<double>() / 2).eval(),
                     half = turnedHalf(tf.linear().template cast<double>(),
                                       (root.max_ - root.min_).template cast<double>() / 2);
      return {middle - half, middle + half};
    }
#endif
    default:
      return {Vector3d::Constant(-std::numeric_limits<double>::infinity()),
              Vector3d::Constant(std::numeric_limits<double>::infinity())};
  }
}

/// So much a rotation may be off that is taken for one (requireRigid), and what is rounded.
template <typename S>
constexpr double kTurnError = std::is_same<S, float>::value ? 2e-3 : 2e-6;

}  // namespace

template <typename S>
void requireBodyGeometry(const fcl::CollisionGeometry<S>& geometry) {
  if (dynamic_cast<const DeformableMesh<S>*>(&geometry)) return;
  const fcl::NODE_TYPE type = geometry.getNodeType();
  const bool is_shape = type >= fcl::GEOM_BOX && type <= fcl::GEOM_HALFSPACE;
  if (!is_shape && type != fcl::GEOM_OCTREE)
    throw std::invalid_argument(
        "adaptive_bvh: a scene holds objects of type DeformableMesh, shapes and octrees; make a "
        "DeformableMesh of a BVHModel");
}

template <typename S>
void bound(Body<S>& body) {
  const std::uint64_t positions = body.mesh ? stateOf(*body.mesh).positions : 0;
  if (body.is_placed && body.positions == positions) return;
  body.positions = positions;
  body.is_placed = true;
  body.box =
      body.mesh ? boxOfMesh(stateOf(*body.mesh), body.tf) : boxOfShape(*body.geometry, body.tf);
  body.middle = (body.box.low + body.box.high) / 2;
  body.radius = (body.box.high - body.box.low).norm() / 2;
  if (!body.box.isBounded()) return;
  const auto at = body.tf.translation().template cast<double>();
  // A rotation is one up to an error, which counts for all that is seen from the body's origin.
  const double far = body.radius + (body.middle - at).norm(),
               margin = kTurnError<S> * far + 1e-12 * body.middle.norm();
  body.box.low.array() -= margin;
  body.box.high.array() += margin;
  if (body.mesh) {
    body.middle = body.tf.template cast<double>() * body.mesh->aabb_center.template cast<double>();
    body.radius = double(body.mesh->aabb_radius);
  }
  body.radius += margin;
}

template void requireBodyGeometry(const fcl::CollisionGeometry<float>&);
template void requireBodyGeometry(const fcl::CollisionGeometry<double>&);
template void bound(Body<float>&);
template void bound(Body<double>&);

}  // namespace adaptive_bvh
