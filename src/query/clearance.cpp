#include <algorithm>

#include "adaptive_bvh/proximity.h"
#include "base/rigid.h"
#include "query/closed_surface.h"
#include "query/point_search.h"
#include "query/winding_number.h"

namespace adaptive_bvh {
namespace {

/// Calls sign(x), for each vertex x where it is in the other's frame, for the sign of its distance.
template <typename S, typename MakeSign>
void findDistances(const MeshState<S>& mesh, const RelativePlacement& to_other,
                   const MeshState<S>& other, S limit, const MakeSign& makeSign,
                   std::vector<S>& result) {
  result.resize(mesh.vertices.size());
  forEachBatch(other.query_threads, result.size(), [&](std::size_t begin, std::size_t end) {
    PointSearch<S> search(other);
    auto sign = makeSign();
    int last = -1;
    for (std::size_t i = begin; i < end; ++i) {
      const fcl::Vector3d x = to_other(mesh.vertices[i]);
      typename PointSearch<S>::Nearest nearest;
      nearest.distance = static_cast<double>(limit);
      if (last >= 0) search.tryTriangle(x, last, nearest);
      search.search(x, nearest);
      if (nearest.triangle >= 0) last = nearest.triangle;
      result[i] = sign(x) * static_cast<S>(nearest.distance);
    }
  });
}

}  // namespace

template <typename S>
void clearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
               const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf, S limit,
               std::vector<S>& result) {
  requireDistance(limit);
  requireRigid(tf);
  requireRigid(other_tf);
  const auto noSign = [] { return [](const fcl::Vector3d&) { return S(1); }; };
  findDistances(stateOf(mesh), RelativePlacement(other_tf, tf), stateOf(other), limit, noSign,
                result);
}

template <typename S>
void signedClearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                     const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf, S limit,
                     std::vector<S>& result) {
  requireDistance(limit);
  requireRigid(tf);
  requireRigid(other_tf);
  const MeshState<S>& closed = stateOf(other);
  requireClosed(closed, "a signed clearance");
  const auto byWinding = [&] {
    return [number = WindingNumber<S>(closed)](const fcl::Vector3d& x) mutable {
      return number.of(x) != 0 ? S(-1) : S(1);
    };
  };
  findDistances(stateOf(mesh), RelativePlacement(other_tf, tf), closed, limit, byWinding, result);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                     \
  template void clearance(const DeformableMesh<S>&, const fcl::Transform3<S>&,          \
                          const DeformableMesh<S>&, const fcl::Transform3<S>&, S,       \
                          std::vector<S>&);                                             \
  template void signedClearance(const DeformableMesh<S>&, const fcl::Transform3<S>&,    \
                                const DeformableMesh<S>&, const fcl::Transform3<S>&, S, \
                                std::vector<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
