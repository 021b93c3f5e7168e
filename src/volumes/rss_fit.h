#pragma once

#include <algorithm>

#include <fcl/math/bv/RSS.h>

#include "mesh/mesh_view.h"
#include "volumes/point_arrays.h"

namespace adaptive_bvh {

/// The positions of some primitives, of each vertex once. Good until the next call on this thread.
template <typename S, typename Primitive>
const PointArrays<S>& gatherPositions(const MeshView<S>& mesh, const Primitive* primitives,
                                      int count);

/// The volume around such points.
template <typename S>
fcl::RSS<S> fitRss(const PointArrays<S>& points);

/// See Volume<fcl::RSS<S>>::fit. One triangle without a second frame gets a closer look.
template <typename S, typename Primitive>
fcl::RSS<S> fitRss(const MeshView<S>& mesh, const Primitive* primitives, int count);

/// The vector to p from a point of the rectangle, the nearest one up to rounding.
template <typename S>
fcl::Vector3<S> vectorFromRectangle(const fcl::RSS<S>& bv, const fcl::Vector3<S>& p) {
  const fcl::Vector3<S> v = p - bv.To;
  const S x = std::min(std::max(bv.axis.col(0).dot(v), S(0)), bv.l[0]);
  const S y = std::min(std::max(bv.axis.col(1).dot(v), S(0)), bv.l[1]);
  return v - bv.axis.col(0) * x - bv.axis.col(1) * y;
}

}  // namespace adaptive_bvh
