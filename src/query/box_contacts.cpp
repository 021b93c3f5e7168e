#include "query/box_contacts.h"

#include <algorithm>

#include "adaptive_bvh/self_collision.h"
#include "base/rigid.h"
#include "query/contact_search.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {
namespace {

/// Costs are kept in an order of their own: one thread finds them.
template <typename S>
int threadsFor(const CandidateInput<S>& input, const ContactNode<S>& node) {
  if (node.request.enable_cost) return 1;
  return std::max(input.first.mesh.query_threads, input.second.mesh.query_threads);
}

/// Adds the contacts of all tasks to the query's result, in their order.
template <typename S, typename Frame>
void runTasks(const CandidateInput<S>& input, const Frame& frame, const ContactNode<S>& node,
              const WalkTasks& walks, const TaskPool& pool) {
  using Worker = ContactWorker<S, Frame>;
  const std::size_t room = node.request.num_max_contacts - node.result->numContacts();
  ContactLimit limit(room, static_cast<std::size_t>(walks.size()), pool.size());
  auto& memory = workersMemory<typename Worker::Memory>(pool);
  SearchTasks<Worker> tasks;
  tasks.run(pool, walks, [&](std::size_t slot) {
    return std::make_unique<Worker>(input, frame, node, room, limit, memory[slot]);
  });
  for (const auto& found : tasks.found())
    for (std::size_t i = found.from; i < found.to && !node.isDone(); ++i)
      node.result->addContact(found.worker->contact(i));
}

template <typename S, typename Frame>
void search(const CandidateInput<S>& input, const Frame& frame, const ContactNode<S>& node) {
  ContactSearch<S, Frame> search(input, frame, node);
  const TaskPool pool(threadsFor(input, node));
  runFromRoots(search, pool,
               [&](const WalkTasks& walks) { runTasks(input, frame, node, walks, pool); });
}

/// Every pair, where single precision cannot express how the meshes lie.
template <typename S>
void testAllPairs(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                  const ContactNode<S>& node) {
  if (areBallsFarther(first, second, node.toFirst(), 0)) return;
  for (int i = 0; i < first.mesh.numTriangles(); ++i)
    for (int j = 0; j < second.mesh.numTriangles() && !node.isDone(); ++j) node.test(i, j);
}

}  // namespace

template <typename S>
void collideMeshes(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                   const CollisionQuery<S>& query) {
  const ContactNode<S> node(first, second, query, false);
  TreePair<S> trees(first, second);
  if (query.request.num_max_contacts > 1) alignIfNear(trees, 0);  // one is found soon
  const CandidateInput<S> input{
      first, second, trees.first(), trees.second(), node.toFirst(), NeighbourFilter::None, nullptr};
  searchInFrame(
      trees, [&](const auto& frame) { search(input, frame, node); },
      [&] { testAllPairs(first, second, node); });
}

template <typename S>
std::size_t selfCollide(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                        const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                        NeighbourFilter filter, const IgnoredPairs& ignored) {
  requireRigid(tf);
  requireSorted(ignored);
  const CollisionQuery<S> query{request, result};
  if (request.num_max_contacts == 0 || query.isSatisfied()) return result.numContacts();
  const PlacedMesh<S> placed(mesh, tf);
  const ContactNode<S> node(placed, placed, query, true, &ignored);
  const FlatPatches flat(placed.tree(), placed.mesh.topology->contours);
  const bool may_skip = filter == NeighbourFilter::SharedVertex;
  search<S>({placed, placed, placed.tree(), placed.tree(), node.toFirst(), filter,
             may_skip ? &flat : nullptr},
            SameFrame(), node);
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template void collideMeshes(const PlacedMesh<S>&, const PlacedMesh<S>&,                     \
                              const CollisionQuery<S>&);                                      \
  template std::size_t selfCollide(const DeformableMesh<S>&, const fcl::Transform3<S>&,       \
                                   const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, \
                                   NeighbourFilter, const IgnoredPairs&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
