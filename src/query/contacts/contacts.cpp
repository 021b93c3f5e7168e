// Contacts of two meshes, and of a mesh with itself: a TriangleSearch with CandidateTests.
#include "query/contacts/contacts.h"

#include <algorithm>

#include "base/shortcut.h"
#include "boxes/flat_patches.h"
#include "query/contacts/candidate_tests.h"
#include "query/pair_filter.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {
namespace {

/// The sink of CandidateTests: tests two triangles and adds their contacts to the result.
class ContactSink {
 public:
  /// `is_self`: both meshes are the same mesh in the same pose. Then the triangle with the smaller
  /// index comes first, and a pair has one contact. `ignored`: pairs to leave out, or null.
  ContactSink(const ContactMesh& first, const ContactMesh& second, const CollisionQuery& query,
              bool is_self, const IgnoredPairs* ignored = nullptr)
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

  /// Adds the contacts of two triangles that touch, neither of which is thin.
  void add(int triangle1, int triangle2) const { test(triangle1, triangle2, true); }
  /// Adds the contacts of two triangles if the exact test finds that they touch.
  void test(int triangle1, int triangle2) const { test(triangle1, triangle2, false); }
  bool isDone() const { return request.isSatisfied(*result); }
  /// Whether so few contacts are wanted that the search is likely to end early.
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

/// The part of a contact query that runs on one thread, as a worker of SearchTasks. It collects the
/// contacts of its tasks; each task adds at most `room`.
template <typename Frame>
class ContactWorker {
 public:
  using Mark = std::size_t;              ///< number of contacts collected so far
  using Memory = fcl::CollisionResultd;  ///< kept from query to query

  /// `sink`: of the query. `room`: of the query's result, in contacts. `limit`: of all workers.
  ContactWorker(const PairInput& input, const Frame& frame, const ContactSink& sink,
                std::size_t room, ContactLimit& limit, Memory& memory)
      : contacts_(memory),
        sink_(sink),
        room_(room),
        limit_(limit),
        search_(input.trees(frame), sink_, input, frame) {
    contacts_.clear();
    sink_.result = &contacts_;
  }

  Mark mark() const { return contacts_.numContacts(); }
  /// Runs a task, unless earlier tasks have all contacts wanted.
  void run(const NodePairs& pairs, std::size_t task) {
    if (!limit_.needs(task)) return;
    const std::size_t before = mark();
    sink_.request.num_max_contacts =  // before + room_, at most the largest number
        room_ > ~std::size_t(0) - before ? ~std::size_t(0) : before + room_;
    search_.run(pairs);
    limit_.finish(task, mark() - before, mark());
  }

  const fcl::Contactd& contact(std::size_t i) const { return contacts_.getContact(i); }

 private:
  fcl::CollisionResultd& contacts_;
  ContactSink sink_;
  const std::size_t room_;
  ContactLimit& limit_;
  CandidateSearch<Frame, const ContactSink> search_;
};

/// Number of threads of the query. One with cost sources, which are not merged from workers.
int threadsFor(const PairInput& input, const ContactSink& sink) {
  if (sink.request.enable_cost) return 1;
  return queryThreads(input.first.mesh, input.second.mesh);
}

/// Runs the tasks on the pool, then adds their contacts to the query's result, in their order.
template <typename Frame>
void runTasks(const PairInput& input, const Frame& frame, const ContactSink& sink,
              const WalkTasks& walks, const TaskPool& pool) {
  using Worker = ContactWorker<Frame>;
  const std::size_t room = sink.request.num_max_contacts - sink.result->numContacts();
  ContactLimit limit(room, static_cast<std::size_t>(walks.size()), pool.size());
  const WorkersMemory<typename Worker::Memory> memory(pool);
  SearchTasks<Worker> tasks;
  tasks.run(pool, walks, [&](std::size_t slot) {
    return std::make_unique<Worker>(input, frame, sink, room, limit, memory[slot]);
  });
  for (const auto& found : tasks.found())
    for (std::size_t i = found.from; i < found.to && !sink.isDone(); ++i)
      sink.result->addContact(found.worker->contact(i));
}

/// Runs the query on one or several threads.
template <typename Frame>
void search(const PairInput& input, const Frame& frame, const ContactSink& sink) {
  CandidateSearch<Frame, const ContactSink> search(input.trees(frame), sink, input, frame);
  const TaskPool pool(threadsFor(input, sink));
  std::vector<NodePair> pairs;
  if (search.splitRoots(pool, pairs)) return runTasks(input, frame, sink, WalkTasks(pairs), pool);
  search.runFromRoots();
}

}  // namespace

void collideMeshes(const ContactMesh& first, const ContactMesh& second,
                   const CollisionQuery& query) {
  const ContactSink sink(first, second, query, false);
  TreePair trees(first.placed, second.placed);
  if (query.request.num_max_contacts > 1) alignIfNear(trees, 0);  // does not pay for one contact
  const PairInput input(trees);
  searchInFrame(
      trees, [&](const auto& frame) { search(input, frame, sink); },
      [&] { testAllCandidates(input, sink); });
}

void collideWithItself(const ContactMesh& mesh, const Ignored& ignored,
                       const CollisionQuery& query) {
  const ContactSink sink(mesh, mesh, query, true, &ignored.triangles);
  const FlatPatches flat(mesh.placed.tree(), mesh.placed.mesh.topology->contours);
  const NeighbourFilter filter = ignored.neighbours;
  PairInput input(mesh.placed, {filter, surfaceOf(ignored, mesh.placed.mesh)});
  const bool may_skip =
      filter == NeighbourFilter::SharedVertex || filter == NeighbourFilter::BeyondShared;
  if (may_skip && isTaken(Shortcut::FlatPatches)) input.flat = &flat;
  search(input, SameFrame(), sink);
}

std::size_t selfCollide(const DeformableMesh& mesh, const fcl::Transform3d& tf,
                        const Ignored& ignored, const fcl::CollisionRequestd& request,
                        fcl::CollisionResultd& result) {
  requireRigid(tf);
  requireSorted(ignored, true);
  const CollisionQuery query{request, result};
  if (request.num_max_contacts == 0 || query.isSatisfied()) return result.numContacts();
  collideWithItself({mesh, PlacedMesh(mesh, tf)}, ignored, query);
  return result.numContacts();
}

}  // namespace adaptive_bvh
