#include "scene/body.h"

#include <limits>
#include <stdexcept>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#endif

#include "deformable/mesh_state.h"

namespace adaptive_bvh {
namespace {

using fcl::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Half the extent along each axis of a box that is turned.
Vector3d turnedHalf(const fcl::Matrix3d& rotation, const Vector3d& half) {
  return rotation.cwiseAbs() * half;
}

/// Boxes of four nodes below the root, in the mesh's own axes, turned into the world.
template <typename S>
WorldBox boxOfMesh(const MeshState& mesh, const fcl::Transform3<S>& tf) {
  const BodyCoordinates& coordinates = mesh.tree.coordinates();
  const fcl::Matrix3d turn = tf.linear().template cast<double>() * coordinates.axes();
  const Vector3d origin = tf.linear().template cast<double>() * coordinates.origin +
                          tf.translation().template cast<double>();
  WorldBox box = {Vector3d::Constant(kInfinity), Vector3d::Constant(-kInfinity)};
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

/// The box in the world around a core in a body's frame, grown by its radius.
template <typename S>
WorldBox turned(const fcl::Transform3<S>& tf, const ShapeCore& core) {
  if (!core.isBounded()) return {Vector3d::Constant(-kInfinity), Vector3d::Constant(kInfinity)};
  const fcl::Matrix3d turn = tf.linear().template cast<double>() * core.axes;
  const Vector3d middle =
      turn * ((core.low + core.high) / 2) + tf.translation().template cast<double>();
  const Vector3d half =
      turnedHalf(turn, (core.high - core.low) / 2) + Vector3d::Constant(core.radius);
  return {middle - half, middle + half};
}

template <typename S>
WorldBox boxOfGeometry(const fcl::CollisionGeometry<S>& geometry, const fcl::Transform3<S>& tf) {
#if FCL_HAVE_OCTOMAP
  if (geometry.getNodeType() == fcl::GEOM_OCTREE) {
    const fcl::AABB<S> root = static_cast<const fcl::OcTree<S>&>(geometry).getRootBV();
    ShapeCore core;
    core.low = root.min_.template cast<double>();
    core.high = root.max_.template cast<double>();
    return turned(tf, core);
  }
#endif
  return turned(tf, ShapeSolid(geometry).core());
}

/// So much a rotation may be off that is taken for one (requireRigid), and what is rounded.
template <typename S>
constexpr double kTurnError = std::is_same<S, float>::value ? 2e-3 : 2e-6;

}  // namespace

template <typename S>
void requireBodyGeometry(const fcl::CollisionGeometry<S>& geometry) {
  if (dynamic_cast<const DeformableMesh<S>*>(&geometry)) return;
  const fcl::NODE_TYPE type = geometry.getNodeType();
  if (!isShape(type) && type != fcl::GEOM_OCTREE)
    throw std::invalid_argument(
        "adaptive_bvh: a scene holds objects of type DeformableMesh, shapes and octrees; make a "
        "DeformableMesh of a BVHModel");
}

namespace {

/// How far a box is enlarged: a rotation is one up to an error, which counts for all that is seen
/// from the body's origin.
template <typename S>
double marginOf(const WorldBox& box, const fcl::Transform3<S>& tf) {
  const Vector3d middle = (box.low + box.high) / 2;
  const double far =
      (box.high - box.low).norm() / 2 + (middle - tf.translation().template cast<double>()).norm();
  return kTurnError<S> * far + 1e-12 * middle.norm();
}

WorldBox enlarged(const WorldBox& box, double margin) {
  return {box.low.array() - margin, box.high.array() + margin};
}

}  // namespace

template <typename S>
WorldBox boxAround(const Body<S>& body, const fcl::Transform3<S>& tf) {
  const WorldBox box = boxOfGeometry(*body.geometry, tf);
  return box.isBounded() ? enlarged(box, marginOf<S>(box, tf)) : box;
}

template <typename S>
void bound(Body<S>& body) {
  const std::uint64_t positions = body.mesh ? stateOf(*body.mesh).version : 0;
  if (body.mesh && body.is_placed && body.positions == positions) return;
  body.positions = positions;
  body.is_placed = true;
  if (!body.mesh) {
    body.box = boxAround(body, body.tf);
    body.middle = (body.box.low + body.box.high) / 2;
    body.radius = (body.box.high - body.box.low).norm() / 2;
    return;
  }
  const WorldBox box = boxOfMesh(stateOf(*body.mesh), body.tf);
  const double margin = marginOf<S>(box, body.tf);
  body.box = enlarged(box, margin);
  body.middle = body.tf.template cast<double>() * body.mesh->aabb_center.template cast<double>();
  body.radius = double(body.mesh->aabb_radius) + margin;
}

template void requireBodyGeometry(const fcl::CollisionGeometry<float>&);
template void requireBodyGeometry(const fcl::CollisionGeometry<double>&);
template WorldBox boxAround(const Body<float>&, const fcl::Transform3<float>&);
template WorldBox boxAround(const Body<double>&, const fcl::Transform3<double>&);
template void bound(Body<float>&);
template void bound(Body<double>&);

}  // namespace adaptive_bvh
