#include "adaptive_bvh/self_collision.h"

#include <array>

#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "model_state.h"
#include "query/fcl/recording_node.h"
#include "query/fcl/self_collision_node.h"
#include "query/placed_mesh.h"
#include "query/search.h"
#include "query/unset_fields.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// Visitor of searchPairs: all pairs of leaves of one box tree whose boxes overlap, from the root
/// against itself. FCL's nodes are not read above the leaves. It does not matter how tight their
/// volumes are, so visits do not count for test D.
template <typename BV>
class SelfCollisionVisitor {
 public:
  using S = typename BV::S;
  struct Pair {
    int node1, node2;
  };
  /// At most three pairs.
  struct Pairs {
    std::array<Pair, 3> pairs;
    int count;
    Pair* begin() { return pairs.data(); }
    Pair* end() { return pairs.data() + count; }
  };

  SelfCollisionVisitor(const PlacedMesh<BV>& mesh, const SelfCollisionNode<BV>& node)
      : nodes_(mesh.tree->boxes->nodes()),
        statistics_(statisticsOf(mesh, mesh)),
        node_(node),
        // Error of the two boxes, and rounding of their difference: docs/bounds.md, 4.
        slack_(
            float4::all(3 * BodyFrame<S>::kError * mesh.tree->boxes->root().largestCoordinate())) {}

  /// A leaf and itself is pruned; an inner node and itself is not.
  bool prune(const Pair& pair) {
    if (pair.node1 == pair.node2) return nodes_.isLeaf(pair.node1);
    ++work_.box_tests;
    const Box a = nodes_.box(pair.node1), b = nodes_.box(pair.node2);
    if (float4::largest(float4::upper<Float4>(a.low - b.high, b.low - a.high) - slack_) > 0)
      return true;
    statistics_.recordVisit(pair.node1, pair.node2);
    return false;
  }

  bool isLeafPair(const Pair& pair) const {
    return nodes_.isLeaf(pair.node1) && nodes_.isLeaf(pair.node2);
  }

  void testLeaves(const Pair& pair) {
    work_.leaf_tests += node_.testUnlessNeighbours(pair.node1, pair.node2);
  }

  /// The larger one is split.
  Pairs split(const Pair& pair) const {
    const auto [i, j] = pair;
    if (i == j) {
      const int left = nodes_.left(i);
      return {{{{left, left}, {left + 1, left + 1}, {left, left + 1}}}, 3};
    }
    if (nodes_.isLeaf(j) || (!nodes_.isLeaf(i) && squaredDiagonal(i) > squaredDiagonal(j)))
      return {{{{nodes_.left(i), j}, {nodes_.left(i) + 1, j}, {}}}, 2};
    return {{{{i, nodes_.left(j)}, {i, nodes_.left(j) + 1}, {}}}, 2};
  }

  bool isDone() const { return node_.canStop(); }

  /// Counts it as a recorded query.
  void finish() const { statistics_.recordQuery(work_); }

 private:
  float squaredDiagonal(int node) const {
    const Box box = nodes_.box(node);
    return float4::sum((box.high - box.low) * (box.high - box.low));
  }

  const BoxNodes<const BoxNode> nodes_;
  const PairStatistics statistics_;
  const SelfCollisionNode<BV>& node_;
  const Float4 slack_;
  QueryWork work_;
};

template <typename BV>
void initialize(SelfCollisionNode<BV>& node, const PlacedMesh<BV>& mesh,
                const CollisionQuery<typename BV::S>& query, NeighbourFilter filter) {
  using Base = typename FclMeshCollision<BV>::Node;
  fcl::detail::initialize(static_cast<Base&>(node), *mesh.model, mesh.tf, *mesh.model, mesh.tf,
                          query.request, query.result);
  node.R.setIdentity();  // tf to tf, exactly
  node.T.setZero();
  node.filter = filter;
}

template <typename BV>
void searchBoxes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                 NeighbourFilter filter) {
  SelfCollisionNode<BV> node;
  initialize(node, mesh, query, filter);
  SelfCollisionVisitor<BV> visitor(mesh, node);
  typename SelfCollisionVisitor<BV>::Pair roots{0, 0};
  searchPairs(visitor, roots);
  visitor.finish();
}

template <typename BV>
void searchVolumes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                   NeighbourFilter filter) {
  using S = typename BV::S;
  RecordingCollisionNode<SelfCollisionNode<BV>, S> node(statisticsOf(mesh, mesh));
  initialize(node, mesh, query, filter);
  fcl::detail::selfCollide(static_cast<fcl::detail::CollisionTraversalNodeBase<S>*>(&node));
}

}  // namespace

template <typename BV>
std::size_t selfCollide(const AdaptiveBVHModel<BV>& model,
                        const fcl::Transform3<typename BV::S>& tf,
                        const fcl::CollisionRequest<typename BV::S>& request,
                        fcl::CollisionResult<typename BV::S>& result, NeighbourFilter filter) {
  using S = typename BV::S;
  detail::ModelAccess<BV>::repairedType(
      model);  // repairs a tree that was changed without our update
  requireTriangles<BV>(model);
  const CollisionQuery<S> query{request, result};
  if (request.num_max_contacts == 0 || query.isSatisfied()) return result.numContacts();
  const std::size_t before = result.numContacts();
  const PlacedMesh<BV> mesh{&model, &detail::ModelAccess<BV>::tree(model), tf};
  if (mesh.hasBoxes())
    searchBoxes(mesh, query, filter);
  else
    searchVolumes(mesh, query, filter);
  if (!request.enable_contact) unsetFields(result, before);
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                           \
  template std::size_t selfCollide(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, \
                                   const fcl::CollisionRequest<BV::S>&,                        \
                                   fcl::CollisionResult<BV::S>&, NeighbourFilter);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
