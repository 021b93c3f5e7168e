#pragma once

#include <atomic>
#include <limits>
#include <mutex>
#include <vector>

#include <fcl/math/bv/AABB.h>

#include "query/candidate_tests.h"
#include "query/ignored_pairs.h"
#include "query/triangle_contacts.h"
#include "query/triangle_search.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {

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

  const RelativePlacement& toFirst() const { return to_first_; }
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

/// Its output is a ContactNode, which takes the contacts.
template <typename S, typename Frame>
using ContactSearch = TriangleSearch<CandidateTests<S, Frame, const ContactNode<S>>>;

/// Says which tasks need not begin: those after one that has all contacts that are wanted, or after
/// the first few that together have them. While there may be too few for that, threads share
/// nothing that they write.
class ContactLimit {
 public:
  ContactLimit(std::size_t most, std::size_t tasks, int workers)
      : most_(most), few_(most / static_cast<std::size_t>(workers)), counts_(tasks), last_(tasks) {
    for (auto& count : counts_) count.store(kOpen, std::memory_order_relaxed);
  }

  bool needs(std::size_t task) const { return task <= last_.load(std::memory_order_relaxed); }
  /// `contacts`: of the task, and of the worker so far.
  void finish(std::size_t task, std::size_t contacts, std::size_t of_worker) {
    counts_[task].store(contacts, std::memory_order_relaxed);
    if (of_worker < few_) return;
    const std::lock_guard<std::mutex> lock(counting_);
    if (contacts >= most_) endAt(task);
    for (std::size_t count; next_ < counts_.size() && sum_ < most_; ++next_) {
      if ((count = counts_[next_].load(std::memory_order_relaxed)) == kOpen) return;
      sum_ += count;
      if (sum_ >= most_) endAt(next_);
    }
  }

 private:
  static constexpr std::size_t kOpen = ~std::size_t(0);

  void endAt(std::size_t task) {
    if (task < last_.load(std::memory_order_relaxed)) last_.store(task, std::memory_order_relaxed);
  }

  const std::size_t most_, few_;                  ///< wanted; so few of each worker are fewer
  std::vector<std::atomic<std::size_t>> counts_;  ///< by task
  std::mutex counting_;
  std::size_t next_ = 0, sum_ = 0;  ///< the first task that is not counted; contacts before it
  std::atomic<std::size_t> last_;
};

/// One thread's worker of a query for contacts (SearchTasks). It keeps contacts of its own, in each
/// task as many at most as the query has room for.
template <typename S, typename Frame>
class ContactWorker {
 public:
  using Search = ContactSearch<S, Frame>;
  using Mark = std::size_t;
  using Memory = fcl::CollisionResult<S>;  ///< that is kept from query to query

  /// `node`: of the query. `limit` is that of all workers.
  ContactWorker(const CandidateInput<S>& input, const Frame& frame, const ContactNode<S>& node,
                std::size_t room, ContactLimit& limit, Memory& memory)
      : contacts_(memory), node_(node), room_(room), limit_(limit), search_(input, frame, node_) {
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
  Search search_;
};

}  // namespace adaptive_bvh
