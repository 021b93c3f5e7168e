#include "query/box_contacts.h"

#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "query/candidate_tests.h"
#include "query/fcl/mesh_collision_node.h"
#include "query/relative_frame.h"
#include "query/wide_search.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// FCL's test of two triangles, which adds their contacts.
template <typename BV>
struct ExactTest {
  const MeshCollisionNode<BV>& node;

  void operator()(int leaf1, int leaf2) const { node.leafTesting(leaf1, leaf2); }
  bool isDone() const { return node.canStop(); }
};

template <typename BV>
const WideTree<typename BV::S>& wideTreeOf(const PlacedMesh<BV>& mesh) {
  return mesh.tree->wide.current(*mesh.model, *mesh.tree);
}

/// FCL's products of three and four lengths must not underflow: docs/bounds.md, 13. Else nothing is
/// rejected.
template <typename S>
RejectionError rejectionError(float position, double scale) {
  constexpr bool kIsDouble = sizeof(S) == sizeof(double);
  constexpr double kForThree = kIsDouble ? 1e90 : 1 << 17;
  constexpr double kForFour = kIsDouble ? 1e60 : 1 << 8;
  constexpr float kNever = std::numeric_limits<float>::infinity();
  return {scale < kForThree ? position : kNever, scale < kForFour ? position : kNever};
}

template <typename BV>
void initialize(MeshCollisionNode<BV>& node, const PlacedMesh<BV>& first,
                const PlacedMesh<BV>& second, const CollisionQuery<typename BV::S>& query) {
  using Base = typename FclMeshCollision<BV>::Node;
  fcl::detail::initialize(static_cast<Base&>(node), *first.model, first.tf, *second.model,
                          second.tf, query.request, query.result);
}

template <typename BV, typename Frame>
void search(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second, const Frame& frame,
            float error, NeighbourFilter filter, const MeshCollisionNode<BV>& node) {
  using S = typename BV::S;
  static thread_local std::vector<std::uint8_t> memory[2];
  const WideTree<S>&tree1 = wideTreeOf(first), &tree2 = wideTreeOf(second);
  constexpr bool kIsSelf = std::is_same<Frame, SameFrame>::value;
  VisitedNodes visited1(memory[0], tree1.size()), visited2(memory[1], kIsSelf ? 0 : tree2.size());
  ExactTest<BV> exact{node};
  CandidateTests<S, Frame, ExactTest<BV>> tests(
      {tree1, first.tree->topology.slots}, {tree2, second.tree->topology.slots}, frame,
      rejectionError<S>(error, tree1.scale()), filter, exact);
  WideSearch<Frame, decltype(tests)> walk(tree1.nodes(), tree2.nodes(), frame, tests, visited1,
                                          kIsSelf ? visited1 : visited2);
  walk.run(tree1.depth() + tree2.depth());
  tests.finish();
  visited1.record(tree1.nodes(), first.tree->statistics);
  visited2.record(tree2.nodes(), second.tree->statistics);
  QueryWork work;
  work.box_tests = walk.boxTests();
  work.candidates = tests.candidates();
  work.leaf_tests = tests.exactTests();
  statisticsOf(first, second).recordQuery(work);
}

}  // namespace

template <typename BV>
bool collideByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                    const CollisionQuery<typename BV::S>& query) {
  MeshCollisionNode<BV> node;
  initialize(node, first, second, query);
  const RelativeFrame frame(wideTreeOf(first), wideTreeOf(second), node.R, node.T);
  if (!frame.isPrecise()) return false;
  const float error = std::max(frame.error(), WideTree<typename BV::S>::kPositionError);
  search(first, second, frame, error, NeighbourFilter::None, node);
  return true;
}

template <typename BV>
void selfCollideByBoxes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                        NeighbourFilter filter) {
  MeshCollisionNode<BV> node;
  node.contacts_per_pair = 1;
  initialize(node, mesh, mesh, query);
  node.R.setIdentity();  // tf to tf, exactly
  node.T.setZero();
  search(mesh, mesh, SameFrame(), WideTree<typename BV::S>::kPositionError, filter, node);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                \
  template bool collideByBoxes(const PlacedMesh<BV>&, const PlacedMesh<BV>&,        \
                               const CollisionQuery<BV::S>&);                       \
  template void selfCollideByBoxes(const PlacedMesh<BV>&, const CollisionQuery<BV::S>&, \
                                   NeighbourFilter);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
