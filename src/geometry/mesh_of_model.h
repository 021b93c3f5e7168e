#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

#include "mesh/mesh_view.h"

namespace adaptive_bvh {

template <typename BV>
MeshView<typename BV::S> viewOf(const fcl::BVHModel<BV>& model) {
  MeshView<typename BV::S> view;
  view.vertices = model.vertices;
  view.previous = model.prev_vertices;
  view.triangles = model.num_tris > 0 ? model.tri_indices : nullptr;
  return view;
}

}  // namespace adaptive_bvh
