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
struct ContactNode : MeshCollisionNode<BV> {
  void test(int leaf1, int leaf2) const { this->leafTesting(leaf1, leaf2); }
  void add(int leaf1, int leaf2) const { this->addTouching(leaf1, leaf2); }
  bool isDone() const { return this->canStop(); }
};

template <typename BV>
const WideTree<typename BV::S>& wideTreeOf(const PlacedMesh<BV>& mesh) {
  return mesh.tree->wide.current(*mesh.model, *mesh.tree);
}

template <typename BV>
void initialize(ContactNode<BV>& node, const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                const CollisionQuery<typename BV::S>& query) {
  using Base = typename FclMeshCollision<BV>::Node;
  fcl::detail::initialize(static_cast<Base&>(node), *first.model, first.tf, *second.model,
                          second.tf, query.request, query.result);
}

/// `kIsSelf`: both are the same, each pair of triangles is to be tested once.
template <bool kIsSelf, typename BV, typename Frame>
void search(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second, const Frame& frame,
            NeighbourFilter filter, const ContactNode<BV>& node) {
  using S = typename BV::S;
  using Tests = CandidateTests<BV, Frame, const ContactNode<BV>>;
  static thread_local std::vector<std::uint8_t> memory[2];
  const WideTree<S>&tree1 = wideTreeOf(first), &tree2 = wideTreeOf(second);
  VisitedNodes visited1(memory[0], tree1.size()), visited2(memory[1], kIsSelf ? 0 : tree2.size());
  Tests tests({first, second, tree1, tree2, node.R, node.T, filter}, frame, node);
  WideSearch<Frame, kIsSelf, Tests> walk(tree1.nodes(), tree2.nodes(), frame, tests, visited1,
                                         kIsSelf ? visited1 : visited2);
  walk.run(tree1.depth() + tree2.depth());
  tests.finish();
  visited1.record(tree1.nodes(), first.tree->statistics);
  visited2.record(tree2.nodes(), second.tree->statistics);
  QueryWork work;
  work.box_tests = walk.boxTests();
  work.candidates = tests.candidates();
  work.leaf_tests = tests.fclTests();
  statisticsOf(first, second).recordQuery(work);
}

}  // namespace

template <typename BV>
bool collideByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                    const CollisionQuery<typename BV::S>& query) {
  ContactNode<BV> node;
  initialize(node, first, second, query);
  const RelativeFrame<typename BV::S> frame(wideTreeOf(first), wideTreeOf(second), node.R, node.T);
  if (!frame.isPrecise()) return false;
  search<false>(first, second, frame, NeighbourFilter::None, node);
  return true;
}

template <typename BV>
void selfCollideByBoxes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                        NeighbourFilter filter) {
  ContactNode<BV> node;
  node.contacts_per_pair = 1;
  initialize(node, mesh, mesh, query);
  node.R.setIdentity();  // tf to tf, exactly
  node.T.setZero();
  search<true>(mesh, mesh, SameFrame<typename BV::S>(), filter, node);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template bool collideByBoxes(const PlacedMesh<BV>&, const PlacedMesh<BV>&,            \
                               const CollisionQuery<BV::S>&);                           \
  template void selfCollideByBoxes(const PlacedMesh<BV>&, const CollisionQuery<BV::S>&, \
                                   NeighbourFilter);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
