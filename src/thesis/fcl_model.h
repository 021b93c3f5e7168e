#pragma once

#include <cstddef>
#include <new>

#include <fcl/geometry/bvh/BVH_model.h>

#include "mesh/vertex_summary.h"

// What FCL's model lacks: move operations, and calls that fail with a code and without effect.
namespace adaptive_bvh {

/// Whether the model is under construction: between beginModel and endModel.
template <typename BV>
bool isBegun(const fcl::BVHModel<BV>& model) {
  return model.build_state == fcl::BVH_BUILD_STATE_BEGUN;
}

/// Whether the model has a tree and no step by FCL's calls is open.
template <typename BV>
bool isBuilt(const fcl::BVHModel<BV>& model) {
  return model.build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
         model.build_state == fcl::BVH_BUILD_STATE_UPDATED;
}

/// Whether every triangle's indices are in range, and every coordinate is finite and not too large.
template <typename BV>
bool isUsable(const fcl::BVHModel<BV>& model) {
  const auto count = static_cast<std::size_t>(model.num_vertices);
  for (int t = 0; t < model.num_tris; ++t)
    for (int k = 0; k < 3; ++k)
      if (model.tri_indices[t][k] >= count) return false;
  return usablePositions<typename BV::S>(model.vertices, count);
}

/// Returns call(), one of FCL's codes, or FCL's out-of-memory code after std::bad_alloc.
template <typename Call>
int codeOf(const Call& call) {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    return fcl::BVH_ERR_MODEL_OUT_OF_MEMORY;
  }
}

/// Calls add(), one of FCL's functions, on a model under construction. Adds everything or nothing.
template <typename BV, typename Add>
int addTo(fcl::BVHModel<BV>& model, const Add& add) {
  if (!isBegun(model)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  const int vertices = model.num_vertices, triangles = model.num_tris;
  const int code = codeOf(add);
  if (code == fcl::BVH_OK) return code;
  model.num_vertices = vertices;
  model.num_tris = triangles;
  return code;
}

/// An empty model. Copying it allocates nothing.
template <typename BV>
const fcl::BVHModel<BV>& emptyBase() {
  static const fcl::BVHModel<BV> empty;
  return empty;
}

/// Swaps the FCL parts of two models. Allocates nothing. FCL's model has no move operations, but
/// its assignment is shallow.
template <typename BV>
void swapBases(fcl::BVHModel<BV>& a, fcl::BVHModel<BV>& b) {
  fcl::BVHModel<BV> between(emptyBase<BV>());
  between = a;
  a = b;
  b = between;
  between = emptyBase<BV>();  // its destructor must not free the arrays of `b`
}

}  // namespace adaptive_bvh
