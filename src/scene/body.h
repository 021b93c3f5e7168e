#pragma once

#include <cstdint>
#include <memory>

#include "adaptive_bvh/scene.h"
#include "dispatch/query_object.h"

namespace adaptive_bvh {

/// All points between two corners, along the axes of the world.
struct WorldBox {
  fcl::Vector3d low = fcl::Vector3d::Zero(), high = fcl::Vector3d::Zero();

  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// The gap of two boxes, a lower bound of the distance of what is in them.
inline double gapOf(const WorldBox& a, const WorldBox& b) {
  const fcl::Vector3d gap = (a.low - b.high).cwiseMax(b.low - a.high).cwiseMax(0);
  return gap.norm() * (1 - 1e-14);
}

/// A body of a scene.
template <typename S>
struct Body {
  BodyId id = 0;
  std::shared_ptr<const fcl::CollisionGeometry<S>> owned;  ///< null of one that is referenced
  const fcl::CollisionGeometry<S>* geometry = nullptr;
  const DeformableMesh<S>* mesh = nullptr;  ///< null of a shape and of an octree
  fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  fcl::Transform3<S> start_tf = tf;  ///< where the step began
  BodyOptions options;

  // State of the last update.
  WorldBox box;
  fcl::Vector3d middle = fcl::Vector3d::Zero();  ///< of a ball around it, in the world
  double radius = 0;
  bool is_placed = false;       ///< whether a mesh's are of the present transform
  std::uint64_t positions = 0;  ///< MeshState::version

  /// The body that was nearest last, with the nearest elements.
  struct Witness {
    bool exists = false;
    BodyId other = 0;
    std::array<int, 2> elements = {-1, -1};
  } witness;
};

/// The body as an object of a query.
template <typename S>
QueryObject objectOf(const Body<S>& body) {
  return body.mesh ? QueryObject(*body.mesh, body.tf) : QueryObject(*body.geometry, body.tf);
}

/// Throws std::invalid_argument on geometry that a scene cannot hold.
template <typename S>
void requireBodyGeometry(const fcl::CollisionGeometry<S>& geometry);

/// A box around a body, other than a mesh, placed by a transform; unbounded of a plane and a
/// half-space.
template <typename S>
WorldBox boxAround(const Body<S>& body, const fcl::Transform3<S>& tf);

/// Computes the box and the ball of a body in its present state: of a mesh where it or its
/// transform has changed, of others, which have no version, always. They are unbounded of a plane
/// and a half-space.
template <typename S>
void bound(Body<S>& body);

}  // namespace adaptive_bvh
