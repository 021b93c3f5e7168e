#include "query/contacts.h"

#include <algorithm>

#include "adaptive_bvh/self_collision.h"
#include "boxes/flat_patches.h"
#include "query/candidate_tests.h"
#include "query/pair_filter.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {
namespace {

/// The test of two triangles of a query, which adds their contacts.
template <typename S>
class ContactNode {
 public:
  /// `is_self`: both meshes are the same in the same place: the triangle with the smaller index is
  /// tested as the first, and a pair has one contact. `ignored`: pairs to leave out, or null.
  ContactNode(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
              const CollisionQuery<S>& query, bool is_self, const IgnoredPairs* ignored = nullptr)
      : request(query.request),
        result(&query.result),
        first_(first),
        second_(second),
        to_first_(is_self ? RelativePlacement() : RelativePlacement(first.tf, second.tf)),
        is_self_(is_self),
        ignored_(ignored) {}

  fcl::CollisionRequest<S> request;
  fcl::CollisionResult<S>* result;

  /// Two triangles that touch, neither of them thin.
  void add(int triangle1, int triangle2) const { test(triangle1, triangle2, true); }
  void test(int triangle1, int triangle2) const { test(triangle1, triangle2, false); }
  bool isDone() const { return request.isSatisfied(*result); }
  bool needsFew() const { return request.num_max_contacts <= 8; }

 private:
  void test(int triangle1, int triangle2, bool touching) const {
    if (is_self_ && triangle2 < triangle1) std::swap(triangle1, triangle2);
    if (ignored_ && isIgnored(*ignored_, unsigned(triangle1), unsigned(triangle2))) return;
    addContactsOf<S>({first_.geometry, first_.mesh.view(), first_.tf},
                     {second_.geometry, second_.mesh.view(), second_.tf}, to_first_, triangle1,
                     triangle2, touching, is_self_ ? 1 : 2, request, *result);
  }

  const PlacedMesh<S>&first_, &second_;
  const RelativePlacement to_first_;
  const bool is_self_;
  const IgnoredPairs* const ignored_;
};

/// One thread's worker of a query for contacts (SearchTasks). It keeps contacts of its own, in each
/// task as many at most as the query has room for.
template <typename S, typename Frame>
class ContactWorker {
 public:
  using Mark = std::size_t;
  using Memory = fcl::CollisionResult<S>;  ///< that is kept from query to query

  /// `node`: of the query. `limit` is that of all workers.
  ContactWorker(const PairInput<S>& input, const Frame& frame, const ContactNode<S>& node,
                std::size_t room, ContactLimit& limit, Memory& memory)
      : contacts_(memory),
        node_(node),
        room_(room),
        limit_(limit),
        search_(input.trees(frame), node_, input, frame) {
    contacts_.clear();
    node_.result = &contacts_;
  }

  Mark mark() const { return contacts_.numContacts(); }
  void run(const NodePairs& pairs, std::size_t task) {
    if (!limit_.needs(task)) return;
    const std::size_t before = mark();
    node_.request.num_max_contacts =
        room_ > ~std::size_t(0) - before ? ~std::size_t(0) : before + room_;
    search_.run(pairs);
    limit_.finish(task, mark() - before, mark());
  }

  const fcl::Contact<S>& contact(std::size_t i) const { return contacts_.getContact(i); }

 private:
  fcl::CollisionResult<S>& contacts_;
  ContactNode<S> node_;
  const std::size_t room_;
  ContactLimit& limit_;
  CandidateSearch<S, Frame, const ContactNode<S>> search_;
};

/// Costs are kept in an order of their own: one thread finds them.
template <typename S>
int threadsFor(const PairInput<S>& input, const ContactNode<S>& node) {
  if (node.request.enable_cost) return 1;
  return std::max(input.first.mesh.query_threads, input.second.mesh.query_threads);
}

/// Adds the contacts of all tasks to the query's result, in their order.
template <typename S, typename Frame>
void runTasks(const PairInput<S>& input, const Frame& frame, const ContactNode<S>& node,
              const WalkTasks& walks, const TaskPool& pool) {
  using Worker = ContactWorker<S, Frame>;
  const std::size_t room = node.request.num_max_contacts - node.result->numContacts();
  ContactLimit limit(room, static_cast<std::size_t>(walks.size()), pool.size());
  const WorkersMemory<typename Worker::Memory> memory(pool);
  SearchTasks<Worker> tasks;
  tasks.run(pool, walks, [&](std::size_t slot) {
    return std::make_unique<Worker>(input, frame, node, room, limit, memory[slot]);
  });
  for (const auto& found : tasks.found())
    for (std::size_t i = found.from; i < found.to && !node.isDone(); ++i)
      node.result->addContact(found.worker->contact(i));
}

template <typename S, typename Frame>
void search(const PairInput<S>& input, const Frame& frame, const ContactNode<S>& node) {
  CandidateSearch<S, Frame, const ContactNode<S>> search(input.trees(frame), node, input, frame);
  const TaskPool pool(threadsFor(input, node));
  std::vector<NodePair> pairs;
  if (search.splitRoots(pool, pairs)) return runTasks(input, frame, node, WalkTasks(pairs), pool);
  search.runFromRoots();
}

}  // namespace

template <typename S>
void collideMeshes(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                   const CollisionQuery<S>& query) {
  const ContactNode<S> node(first, second, query, false);
  TreePair<S> trees(first, second);
  if (query.request.num_max_contacts > 1) alignIfNear(trees, 0);  // one is found soon
  const PairInput<S> input(trees);
  searchInFrame(
      trees, [&](const auto& frame) { search(input, frame, node); },
      [&] { testAllCandidates(input, node); });
}

template <typename S>
std::size_t selfCollide(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                        const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                        NeighbourFilter filter, const IgnoredPairs& ignored) {
  requireRigid(tf);
  requireSortedOfSelf(ignored);
  const CollisionQuery<S> query{request, result};
  if (request.num_max_contacts == 0 || query.isSatisfied()) return result.numContacts();
  const PlacedMesh<S> placed(mesh, tf);
  const ContactNode<S> node(placed, placed, query, true, &ignored);
  const FlatPatches flat(placed.tree(), placed.mesh.topology->contours);
  PairInput<S> input(placed, filter);
  if (filter == NeighbourFilter::SharedVertex) input.flat = &flat;
  search(input, SameFrame(), node);
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
