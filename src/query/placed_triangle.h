#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

#include "geometry/triangle_contact.h"

namespace adaptive_bvh {

/// A triangle of a mesh, placed.
template <typename BV, typename S = typename BV::S>
TrianglePoints<S> triangleInWorld(const fcl::BVHModel<BV>& mesh, int triangle,
                                  const fcl::Transform3<S>& tf) {
  const fcl::Triangle& corners = mesh.tri_indices[triangle];
  const auto corner = [&](int k) -> fcl::Vector3<S> { return tf * mesh.vertices[corners[k]]; };
  return {corner(0), corner(1), corner(2)};
}

}  // namespace adaptive_bvh
