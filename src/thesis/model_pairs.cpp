#include "thesis/placed_model.h"

#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_distance_traversal_node.h>

#include "mesh/mesh_view.h"
#include "query/placed_mesh.h"
#include "thesis/recording_node.h"
#include "thesis/volumes/volume.h"
#include "triangles/triangle_gap.h"

// Distance and collision of two models: FCL's traversals, with this library's tests of triangles,
// and with recording of statistics (recording_node.h).
namespace adaptive_bvh {
namespace {

/// FCL's collision traversal of two meshes with this type of volume.
template <typename BV>
struct FclMeshCollision;
template <>
struct FclMeshCollision<fcl::RSSd> {
  using Node = fcl::detail::MeshCollisionTraversalNodeRSS<double>;
};

template <>
struct FclMeshCollision<fcl::OBBRSSd> {
  using Node = fcl::detail::MeshCollisionTraversalNodeOBBRSS<double>;
};

/// FCL's collision traversal with this library's triangle test (addContactsOf).
template <typename BV>
class MeshCollisionNode : public FclMeshCollision<BV>::Node {
  using Base = typename FclMeshCollision<BV>::Node;

 public:
  void initialize(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                  const CollisionQuery& query) {
    fcl::detail::initialize(static_cast<Base&>(*this), *first.model, first.tf, *second.model,
                            second.tf, query.request, query.result);
    to_first_ = RelativePlacement(first.tf, second.tf);
    // FCL's tests of volumes use the same transform as the tests of triangles.
    this->R = to_first_.R;
    this->T = to_first_.T;
  }

  void leafTesting(int b1, int b2) const override {
    addContactsOf({this->model1, viewOf(*this->model1), this->tf1},
                  {this->model2, viewOf(*this->model2), this->tf2}, to_first_,
                  this->model1->getBV(b1).primitiveId(), this->model2->getBV(b2).primitiveId(),
                  /*touching=*/false, /*most=*/2, this->request, *this->result);
  }

 private:
  RelativePlacement to_first_;  ///< from the second model's frame to the first model's
};

/// FCL's distance traversal of two meshes with this type of volume.
template <typename BV>
struct FclMeshDistance;
template <>
struct FclMeshDistance<fcl::RSSd> {
  using Node = fcl::detail::MeshDistanceTraversalNodeRSS<double>;
};

template <>
struct FclMeshDistance<fcl::OBBRSSd> {
  using Node = fcl::detail::MeshDistanceTraversalNodeOBBRSS<double>;
};

/// FCL's distance traversal with this library's triangle distance. The points in the result are in
/// the first model's frame until FCL transforms them at the end.
template <typename BV>
class MeshDistanceNode : public FclMeshDistance<BV>::Node {
 public:
  explicit MeshDistanceNode(const RelativePlacement& to_first) : to_first_(to_first) {}

  /// Does nothing, because FCL would start from its own distance of the first triangles.
  void preprocess() override {}

  void leafTesting(int b1, int b2) const override {
    const int first = this->model1->getBV(b1).primitiveId(),
              second = this->model2->getBV(b2).primitiveId();
    const auto corners = [](const fcl::BVHModel<BV>& model, int triangle) -> TrianglePoints {
      const VertexIndices v = viewOf(model).verticesOf(static_cast<unsigned>(triangle));
      const fcl::Vector3d* x = model.vertices;
      return {x[v[0]], x[v[1]], x[v[2]]};
    };
    TrianglePoints placed = corners(*this->model2, second);
    for (fcl::Vector3d& x : placed) x = to_first_(x);
    const TriangleGap gap = gapOf(corners(*this->model1, first), placed);
    this->result->update(gap.distance, this->model1, this->model2, first, second, gap.points.first,
                         gap.points.second);
  }

 private:
  const RelativePlacement to_first_;  ///< from the second model's frame to the first model's
};

}  // namespace

template <typename BV>
double modelModelDistance(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                          const DistanceQuery& query) {
  if (query.isSatisfied()) return query.result.min_distance;
  using Node = MeshDistanceNode<BV>;
  // A separate result: at the end FCL transforms the points to the world, and would also transform
  // points that an older query of the same pair left in the result.
  fcl::DistanceResultd found(query.result.min_distance);
  RecordingDistanceNode<Node> node(statisticsOf(first, second),
                                   RelativePlacement(first.tf, second.tf));
  fcl::detail::initialize(static_cast<typename FclMeshDistance<BV>::Node&>(node), *first.model,
                          first.tf, *second.model, second.tf, query.request, found);
  fcl::detail::distance(&node);
  if (found.o1) {  // a smaller distance was found
    if (!query.request.enable_nearest_points) unsetPoints(found);
    query.result.update(found);
  }
  return query.result.min_distance;
}

template <typename BV>
std::size_t modelModelCollide(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                              const CollisionQuery& query) {
  if (query.isSatisfied()) return query.result.numContacts();
  RecordingCollisionNode<MeshCollisionNode<BV>> node(statisticsOf(first, second));
  node.initialize(first, second, query);
  fcl::detail::collide(&node);
  return query.result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                     \
  template double modelModelDistance(const PlacedModel<BV>&, const PlacedModel<BV>&,     \
                                     const DistanceQuery&);                              \
  template std::size_t modelModelCollide(const PlacedModel<BV>&, const PlacedModel<BV>&, \
                                         const CollisionQuery&);
ADAPTIVE_BVH_FOR_EACH_DOUBLE_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
