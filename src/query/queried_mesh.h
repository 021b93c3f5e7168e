#pragma once

#include <stdexcept>

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh {

/// The mesh, if it can be queried: FCL crashes on one without triangles.
template <typename S>
const fcl::BVHModel<fcl::RSS<S>>& withTriangles(const fcl::BVHModel<fcl::RSS<S>>* mesh) {
  if (mesh->getModelType() != fcl::BVH_MODEL_TRIANGLES || mesh->getNumBVs() == 0)
    throw std::invalid_argument(
        "adaptive_bvh: a queried model has no triangles, or was not built by endModel");
  return *mesh;
}

}  // namespace adaptive_bvh
