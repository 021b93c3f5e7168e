#include "query/contacts/contacts.h"

#include <algorithm>

#include "boxes/flat_patches.h"
#include "query/contacts/candidate_tests.h"
#include "query/pair_filter.h"
#include "query/single_precision.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {
namespace {

/// The test of two triangles of a query, which adds their contacts.
class ContactNode {
 public:
  /// `is_self`: both meshes are the same in the same place: the triangle with the smaller index is
  /// tested as the first, and a pair has one contact. `ignored`: pairs to leave out, or null.
  ContactNode(const ContactMesh& first, const ContactMesh& second,
              const CollisionQuery<double>& query, bool is_self,
              const IgnoredPairs* ignored = nullptr)
      : request(query.request),
        result(&query.result),
        first_(first),
        second_(second),
        to_first_(is_self ? RelativePlacement()
                          : RelativePlacement(first.placed.tf, second.placed.tf)),
        is_self_(is_self),
        ignored_(ignored) {}

  fcl::CollisionRequestd request;
  fcl::CollisionResultd* result;

  /// Two triangles that touch, neither of them thin.
  void add(int triangle1, int triangle2) const { test(triangle1, triangle2, true); }
  void test(int triangle1, int triangle2) const { test(triangle1, triangle2, false); }
  bool isDone() const { return request.isSatisfied(*result); }
  bool needsFew() const { return request.num_max_contacts <= 8; }

 private:
  void test(int triangle1, int triangle2, bool touching) const {
    if (is_self_ && triangle2 < triangle1) std::swap(triangle1, triangle2);
    if (ignored_ && isIgnored(*ignored_, unsigned(triangle1), unsigned(triangle2))) return;
    addContactsOf(first_.triangles(), second_.triangles(), to_first_, triangle1, triangle2,
                  touching, is_self_ ? 1 : 2, request, *result);
  }

  const ContactMesh &first_, &second_;
  const RelativePlacement to_first_;
  const bool is_self_;
  const IgnoredPairs* const ignored_;
};

/// One thread's worker of a query for contacts (SearchTasks). It keeps contacts of its own, in each
/// task as many at most as the query has room for.
template <typename Frame>
class ContactWorker {
 public:
  using Mark = std::size_t;
  using Memory = fcl::CollisionResultd;  ///< that is kept from query to query

  /// `node`: of the query. `limit` is that of all workers.
  ContactWorker(const PairInput& input, const Frame& frame, const ContactNode& node,
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

  const fcl::Contactd& contact(std::size_t i) const { return contacts_.getContact(i); }

 private:
  fcl::CollisionResultd& contacts_;
  ContactNode node_;
  const std::size_t room_;
  ContactLimit& limit_;
  CandidateSearch<Frame, const ContactNode> search_;
};

/// Costs are kept in an order of their own: one thread finds them.
int threadsFor(const PairInput& input, const ContactNode& node) {
  if (node.request.enable_cost) return 1;
  return std::max(input.first.mesh.query_threads, input.second.mesh.query_threads);
}

/// Adds the contacts of all tasks to the query's result, in their order.
template <typename Frame>
void runTasks(const PairInput& input, const Frame& frame, const ContactNode& node,
              const WalkTasks& walks, const TaskPool& pool) {
  using Worker = ContactWorker<Frame>;
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

template <typename Frame>
void search(const PairInput& input, const Frame& frame, const ContactNode& node) {
  CandidateSearch<Frame, const ContactNode> search(input.trees(frame), node, input, frame);
  const TaskPool pool(threadsFor(input, node));
  std::vector<NodePair> pairs;
  if (search.splitRoots(pool, pairs)) return runTasks(input, frame, node, WalkTasks(pairs), pool);
  search.runFromRoots();
}

}  // namespace

void collideMeshes(const ContactMesh& first, const ContactMesh& second,
                   const CollisionQuery<double>& query) {
  const ContactNode node(first, second, query, false);
  TreePair trees(first.placed, second.placed);
  if (query.request.num_max_contacts > 1) alignIfNear(trees, 0);  // one is found soon
  const PairInput input(trees);
  searchInFrame(
      trees, [&](const auto& frame) { search(input, frame, node); },
      [&] { testAllCandidates(input, node); });
}

void collideWithItself(const ContactMesh& mesh, NeighbourFilter filter, const IgnoredPairs& ignored,
                       const CollisionQuery<double>& query) {
  const ContactNode node(mesh, mesh, query, true, &ignored);
  const FlatPatches flat(mesh.placed.tree(), mesh.placed.mesh.topology->contours);
  PairInput input(mesh.placed, filter);
  if (filter == NeighbourFilter::SharedVertex) input.flat = &flat;
  search(input, SameFrame(), node);
}

template <typename S>
std::size_t selfCollide(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                        const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                        NeighbourFilter filter, const IgnoredPairs& ignored) {
  requireRigid(tf);
  requireSortedOfSelf(ignored);
  const CollisionQuery<S> asked{request, result};
  if (request.num_max_contacts == 0 || asked.isSatisfied()) return result.numContacts();
  const PlacedMesh placed(mesh, tf);
  answerInDouble(asked, &mesh, &mesh,
                 [&](const fcl::CollisionGeometryd& object, const fcl::CollisionGeometryd&,
                     const CollisionQuery<double>& query) {
                   collideWithItself({object, placed}, filter, ignored, query);
                 });
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template std::size_t selfCollide(const DeformableMesh<S>&, const fcl::Transform3<S>&,       \
                                   const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, \
                                   NeighbourFilter, const IgnoredPairs&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
