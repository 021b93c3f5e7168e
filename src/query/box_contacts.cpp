#include "query/box_contacts.h"

#include <algorithm>
#include <optional>

#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "query/contact_tasks.h"
#include "query/relative_frame.h"
#include "query/wide_trees.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// Costs are kept in an order of their own: one thread finds them.
template <typename BV>
int threadsFor(const CandidateInput<BV>& input, const ContactNode<BV>& node) {
  if (node.request.enable_cost) return 1;
  return std::max(input.first.tree->query_threads, input.second.tree->query_threads);
}

/// Adds the contacts of all tasks to the query's result, in their order.
template <bool kIsSelf, typename BV, typename Frame>
void runTasks(const CandidateInput<BV>& input, const Frame& frame, const ContactNode<BV>& node,
              const WalkTasks& walks, const TaskPool& pool,
              ContactSearch<kIsSelf, BV, Frame>& search) {
  using Worker = ContactWorker<kIsSelf, BV, Frame>;
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
  tasks.forEachWorker([&](const Worker& worker) { search.add(worker.search()); });
}

/// `kIsSelf`: both are the same, each pair of triangles is to be tested once.
template <bool kIsSelf, typename BV, typename Frame>
void search(const CandidateInput<BV>& input, const Frame& frame, const ContactNode<BV>& node) {
  using Search = ContactSearch<kIsSelf, BV, Frame>;
  static thread_local typename Search::Memory memory;
  Search search(input, frame, node, memory);
  const TaskPool pool(threadsFor(input, node));
  runFromRoots(search, pool, [&](const WalkTasks& walks) {
    runTasks<kIsSelf>(input, frame, node, walks, pool, search);
  });
  search.record(pool);
}

}  // namespace

template <typename BV>
bool collideByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                    const CollisionQuery<typename BV::S>& query) {
  ContactNode<BV> node;
  node.initialize(first, second, query);
  const WideTrees<typename BV::S> trees = wideTreesOf(first, second);
  const RelativeFrame<typename BV::S> frame(trees.first, trees.second, node.R, node.T);
  if (!frame.isPrecise()) return false;
  const CandidateInput<BV> input{first,  second, trees.first,           trees.second,
                                 node.R, node.T, NeighbourFilter::None, nullptr};
  if (frame.isSame())
    search<false>(input, frame.same(), node);
  else
    search<false>(input, frame, node);
  return true;
}

template <typename BV>
void selfCollideByBoxes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                        NeighbourFilter filter) {
  using S = typename BV::S;
  ContactNode<BV> node;
  node.contacts_per_pair = 1;
  node.is_self = true;
  node.initialize(mesh, mesh, query);
  const auto& tree = wideTreeOf(mesh);
  std::optional<FlatPatches<S>> flat;
  if (FlatPatches<S>::kIsPossible && filter == NeighbourFilter::SharedVertex)
    flat.emplace(tree, mesh.tree->contours.current(tree, *mesh.tree), mesh.tree->topology.slots);
  search<true, BV>({mesh, mesh, tree, tree, node.R, node.T, filter, flat ? &*flat : nullptr},
                   SameFrame<S>(), node);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template bool collideByBoxes(const PlacedMesh<BV>&, const PlacedMesh<BV>&,            \
                               const CollisionQuery<BV::S>&);                           \
  template void selfCollideByBoxes(const PlacedMesh<BV>&, const CollisionQuery<BV::S>&, \
                                   NeighbourFilter);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
