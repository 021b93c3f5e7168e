#pragma once

#include <algorithm>

#include "base/rigid.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Two placed meshes, or one with itself, in its own frame.
struct KeptMeshes {
  explicit KeptMeshes(const MeshState& mesh)
      : first(mesh, fcl::Transform3d::Identity()), second(first), is_self(true) {}
  KeptMeshes(const PlacedMesh& one, const PlacedMesh& other)
      : first(one), second(other), to_first(one.tf, other.tf), is_self(false) {}

  const PlacedMesh first, second;
  const RelativePlacement to_first;  ///< maps the second mesh's frame to the first's
  const bool is_self;

  /// The sum of both meshes' radii.
  double radii() const { return first.bounds().aabb_radius + second.bounds().aabb_radius; }
  /// A ball around both meshes, in the frame of the first.
  struct Ball {
    fcl::Vector3d centre;
    double radius;
  };
  Ball enclosingBall() const {
    const LocalBounds &a = first.bounds(), &b = second.bounds();
    if (is_self) return {a.aabb_center, a.aabb_radius};
    const fcl::Vector3d one = a.aabb_center, other = to_first(b.aabb_center);
    return {(one + other) / 2, (one - other).norm() / 2 + std::max(a.aabb_radius, b.aabb_radius)};
  }

  int sides() const { return is_self ? 1 : 2; }
  const MeshState& mesh(int side) const { return side == 0 ? first.mesh : second.mesh; }
  /// Calls act(f) with the map f of a mesh's frame to the first's.
  template <typename Act>
  auto withMap(int side, const Act& act) const {
    if (side == 0) return act([](const fcl::Vector3d& x) -> const fcl::Vector3d& { return x; });
    return act([this](const fcl::Vector3d& x) -> fcl::Vector3d { return to_first(x); });
  }
};

}  // namespace adaptive_bvh
