#include "adaptive_bvh/query.h"

#include <stdexcept>
#include <utility>

#include "model_state.h"
#include "query/mesh_mesh.h"
#include "query/mesh_shape.h"

namespace adaptive_bvh {
namespace {

template <typename S>
using Mesh = fcl::BVHModel<fcl::RSS<S>>;

/// One object of a query, as far as it matters to us.
template <typename S>
struct Side {
  explicit Side(const fcl::CollisionGeometry<S>* geometry) {
    const fcl::NODE_TYPE type = geometry->getNodeType();  // repairs a tree changed behind our back
    is_shape = type >= fcl::GEOM_BOX && type <= fcl::GEOM_HALFSPACE;
    if (geometry->getObjectType() != fcl::OT_BVH) return;
    adaptive = dynamic_cast<const AdaptiveBVHModel<fcl::RSS<S>>*>(geometry);
    mesh = adaptive ? adaptive : dynamic_cast<const Mesh<S>*>(geometry);
  }

  /// What stands beside an adaptive model; null beside another.
  const AdaptiveTree<fcl::RSS<S>>* tree() const {
    return adaptive ? &detail::ModelAccess<fcl::RSS<S>>::tree(*adaptive) : nullptr;
  }
  Evidence* evidence() const { return adaptive ? &tree()->evidence : nullptr; }
  bool hasBoxes() const { return adaptive && tree()->boxes; }

  const AdaptiveBVHModel<fcl::RSS<S>>* adaptive = nullptr;
  const Mesh<S>* mesh = nullptr;
  bool is_shape = false;
};

template <typename S>
const Mesh<S>& withTriangles(const Mesh<S>* mesh) {
  if (mesh->getModelType() != fcl::BVH_MODEL_TRIANGLES || mesh->getNumBVs() == 0)
    throw std::invalid_argument(
        "adaptive_bvh: a queried model has no triangles, or was not built by endModel");
  return *mesh;
}

/// Hands a pair to the recorded query it belongs to, the mesh first. False: none, ask FCL.
template <typename S, typename MeshMesh, typename MeshShape>
bool dispatch(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
              MeshMesh&& mesh_mesh, MeshShape&& mesh_shape) {
  const Side<S> first(o1), second(o2);
  Recorder recorder;
  recorder.side[0] = first.evidence();
  recorder.side[1] = second.evidence();
  if ((first.adaptive && second.mesh) || (first.mesh && second.adaptive)) {
    withTriangles(first.mesh);
    withTriangles(second.mesh);
    mesh_mesh(first, second, recorder);
  } else if (first.adaptive && second.is_shape) {
    mesh_shape(withTriangles(first.mesh), tf1, *o2, tf2, recorder);
  } else if (first.is_shape && second.adaptive) {
    std::swap(recorder.side[0], recorder.side[1]);
    mesh_shape(withTriangles(second.mesh), tf2, *o1, tf1, recorder);
  } else {
    return false;
  }
  return true;
}

}  // namespace

namespace detail {

template <typename S>
bool recordedDistance(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                      const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                      const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                      S& distance) {
  return dispatch(
      o1, tf1, o2, tf2,
      [&](const Side<S>& first, const Side<S>& second, const Recorder& recorder) {
        if (first.hasBoxes() && second.hasBoxes() &&
            boxedMeshDistance<S>({first.mesh, first.tree(), tf1}, {second.mesh, second.tree(), tf2},
                                 request, result))
          distance = result.min_distance;
        else
          distance =
              meshMeshDistance(*first.mesh, tf1, *second.mesh, tf2, request, result, recorder);
      },
      [&](const Mesh<S>& mesh, const fcl::Transform3<S>& mesh_tf,
          const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& shape_tf,
          const Recorder& recorder) {
        distance = meshShapeDistance(mesh, mesh_tf, shape, shape_tf, request, result, recorder);
      });
}

template <typename S>
bool recordedCollide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                     const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                     const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                     std::size_t& contacts) {
  contacts = 0;
  if (request.num_max_contacts == 0) return true;  // as FCL, without its message
  return dispatch(
      o1, tf1, o2, tf2,
      [&](const Side<S>& first, const Side<S>& second, const Recorder& recorder) {
        contacts = meshMeshCollide(*first.mesh, tf1, *second.mesh, tf2, request, result, recorder);
      },
      [&](const Mesh<S>& mesh, const fcl::Transform3<S>& mesh_tf,
          const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& shape_tf,
          const Recorder& recorder) {
        contacts = meshShapeCollide(mesh, mesh_tf, shape, shape_tf, request, result, recorder);
      });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                            \
  template bool recordedDistance(const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,  \
                                 const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,  \
                                 const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&, S&); \
  template bool recordedCollide(const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,   \
                                const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,   \
                                const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&,     \
                                std::size_t&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace detail
}  // namespace adaptive_bvh
