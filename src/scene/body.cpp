#include "scene/body.h"

#include <limits>
#include <stdexcept>

namespace adaptive_bvh {
namespace {

using fcl::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The box in the world around the up to 16 boxes of the tree's second level, each rotated.
WorldBox boxOfMesh(const MeshState& mesh, const fcl::Transform3d& tf) {
  const BodyCoordinates& coordinates = mesh.tree.coordinates();
  const fcl::Matrix3d rotation = tf.linear() * coordinates.axes();
  const Vector3d origin = tf.linear() * coordinates.origin + tf.translation();
  WorldBox box = {Vector3d::Constant(kInfinity), Vector3d::Constant(-kInfinity)};
  const auto add = [&](const Boxes4& boxes, int lane) {
    const auto corner = [&](const Float4* sides) -> Vector3d {
      return {double(sides[0][lane]), double(sides[1][lane]), double(sides[2][lane])};
    };
    const Vector3d low = corner(boxes.low), high = corner(boxes.high);
    const Vector3d middle = origin + rotation * (low + high) / (2 * coordinates.scale),
                   half = rotatedHalf(rotation, (high - low) / (2 * coordinates.scale));
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

/// The box in the world around all points within core.radius of the core's box.
WorldBox boxOfCore(const fcl::Transform3d& tf, const ShapeCore& core) {
  if (!core.isBounded()) return {Vector3d::Constant(-kInfinity), Vector3d::Constant(kInfinity)};
  const fcl::Matrix3d rotation = tf.linear() * core.axes;
  const Vector3d middle = rotation * ((core.low + core.high) / 2) + tf.translation();
  const Vector3d half =
      rotatedHalf(rotation, (core.high - core.low) / 2) + Vector3d::Constant(core.radius);
  return {middle - half, middle + half};
}

/// The box around a shape, or around the root cell of an octree.
WorldBox boxOfParts(const ConvexParts& parts) {
#if FCL_HAVE_OCTOMAP
  if (parts.isOctree()) {
    const fcl::AABBd root = parts.cells().rootBox();
    ShapeCore core;
    core.low = root.min_;
    core.high = root.max_;
    return boxOfCore(parts.tf(), core);
  }
#endif
  return boxOfCore(parts.tf(), parts.shape().core());
}

/// The padding of a box for rounding, and for the error of the rotation, whose effect grows with
/// the distance from the body's origin.
double marginOf(const WorldBox& box, const fcl::Transform3d& tf) {
  const Vector3d middle = (box.low + box.high) / 2;
  const double far = (box.high - box.low).norm() / 2 + (middle - tf.translation()).norm();
  return kTurnError * far + 1e-12 * middle.norm();
}

WorldBox enlarged(const WorldBox& box, double margin) {
  return {box.low.array() - margin, box.high.array() + margin};
}

ObjectKind kindOf(const fcl::CollisionGeometryd& geometry) {
  if (dynamic_cast<const DeformableMesh*>(&geometry)) return ObjectKind::Mesh;
  const fcl::NODE_TYPE type = geometry.getNodeType();
  if (isShape(type)) return ObjectKind::Shape;
  if (type != fcl::GEOM_OCTREE)
    throw std::invalid_argument(
        "adaptive_bvh: a scene holds objects of type DeformableMesh, shapes and octrees; make a "
        "DeformableMesh of a BVHModel");
  return ObjectKind::Octree;
}

/// Casts a geometry, which must be a mesh.
const DeformableMesh& meshIn(const fcl::CollisionGeometryd& geometry) {
  return static_cast<const DeformableMesh&>(geometry);
}

/// The box around a body with a given transform; unbounded for a plane or half-space.
WorldBox boxAround(const Body& body, const fcl::Transform3d& tf) {
  const WorldBox box =
      body.isMesh() ? boxOfMesh(body.mesh(), tf) : boxOfParts(body.geometry.at(tf).parts());
  return box.isBounded() ? enlarged(box, marginOf(box, tf)) : box;
}

}  // namespace

BodyGeometry::BodyGeometry(const fcl::CollisionGeometryd& geometry)
    : kind_(kindOf(geometry)), geometry_(&geometry) {}

const MeshState& BodyGeometry::mesh() const { return stateOf(meshIn(*geometry_)); }
QueryObject BodyGeometry::at(const fcl::Transform3d& tf) const {
  return isMesh() ? QueryObject(meshIn(*geometry_), tf) : QueryObject(*geometry_, tf);
}

FrameBoxes::FrameBoxes(const FrameMotion& motion)
    : motion_(motion), parts_(motion.isScrew() ? kParts : 1) {
  for (int i = 0; i <= parts_; ++i) at_[i] = motion.at(double(i) / parts_);
}

WorldBox FrameBoxes::around(const Vector3d& middle, const Vector3d& half, double radius) const {
  const double size = half.norm();
  const double arc = motion_.acceleration(at_[0](middle), size, 0) / (8 * kParts * kParts);
  const double margin = radius + arc + 1e-12 * (middle.norm() + size + radius + motion_.reach());
  WorldBox box;
  for (int i = 0; i <= parts_; ++i) {
    const Vector3d center = at_[i](middle),
                   sides = rotatedHalf(at_[i].linear, half) + Vector3d::Constant(margin);
    const WorldBox now = {center - sides, center + sides};
    box = i == 0 ? now : aroundBoth(box, now);
  }
  return box;
}

WorldBox sweptBox(const Body& body, FramePath path) {
  const bool is_deformed = body.isMesh() && !body.mesh().previous.empty();
  if (!body.box.isBounded() || (!is_deformed && body.start_tf.matrix() == body.tf.matrix()))
    return body.box;
  // Previous positions are near the present ones. Transforms may be off a rotation by 1e-3.
  const double change = is_deformed ? 1.01 * body.mesh().report.largest_displacement : 0;
  const FrameMotion frame(body.start_tf, body.tf, path);
  if (!frame.isScrew())
    return aroundBoth(body.box, enlarged(boxAround(body, body.start_tf), change));
  constexpr double kScrewError = 1e-5;  // exceeds the error of a rotation, and that of its inverse
  const Vector3d arm = body.middle - body.tf.translation();
  return FrameBoxes(frame).around(
      body.tf.linear().transpose() * arm, Vector3d::Zero(),
      body.radius + change + kScrewError * (body.radius + change + arm.norm()));
}

void updateBounds(Body& body) {
  const std::uint64_t version = body.isMesh() ? body.mesh().version : 0;
  if (body.isMesh() && body.has_current_bounds && body.mesh_version == version) return;
  body.mesh_version = version;
  body.has_current_bounds = true;
  body.box = boxAround(body, body.tf);
  body.middle = (body.box.low + body.box.high) / 2;
  body.radius = (body.box.high - body.box.low).norm() / 2;
  if (!body.isMesh()) return;
  body.middle = body.tf * body.mesh().bounds.aabb_center;
  body.radius = body.mesh().bounds.aabb_radius + marginOf(body.box, body.tf);
}

}  // namespace adaptive_bvh
