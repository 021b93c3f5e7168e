#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

#include "query/contact_search.h"
#include "threads/task_pool.h"

namespace adaptive_bvh {

/// Says which tasks need not begin: those after one that has all contacts that are wanted, or after
/// the first few that together have them.
class ContactLimit {
 public:
  ContactLimit(std::size_t most, std::size_t tasks)
      : most_(most), counts_(tasks, kOpen), last_(tasks) {}

  bool needs(int task) const {
    return static_cast<std::size_t>(task) <= last_.load(std::memory_order_relaxed);
  }
  void finish(int task, std::size_t contacts) {
    const std::lock_guard<std::mutex> lock(counting_);
    const auto at = static_cast<std::size_t>(task);
    counts_[at] = contacts;
    if (contacts >= most_) endAt(at);
    for (; next_ < counts_.size() && counts_[next_] != kOpen && sum_ < most_; ++next_) {
      sum_ += counts_[next_];
      if (sum_ >= most_) endAt(next_);
    }
  }

 private:
  static constexpr std::size_t kOpen = ~std::size_t(0);

  void endAt(std::size_t task) {
    if (task < last_.load(std::memory_order_relaxed)) last_.store(task, std::memory_order_relaxed);
  }

  const std::size_t most_;
  std::mutex counting_;
  std::vector<std::size_t> counts_;  ///< by task
  std::size_t next_ = 0, sum_ = 0;   ///< the first task that is not finished; contacts before it
  std::atomic<std::size_t> last_;
};

/// A query for contacts on several threads. The walk is cut into many tasks, in the order in which
/// one thread comes to them; each thread collects the contacts of its tasks, and these are put
/// together in that order. So contacts and their order are those of one thread.
template <bool kIsSelf, typename BV, typename Frame>
class ContactTasks {
 public:
  using S = typename BV::S;
  using Search = ContactSearch<kIsSelf, BV, Frame>;

  /// A search of fewer pairs of nodes is not worth threads.
  static constexpr std::size_t kLeastTasks = 512;

  /// `node`: of the query, with its request and its result.
  ContactTasks(const CandidateInput<BV>& input, const Frame& frame, const ContactNode<BV>& node,
               const std::vector<NodePair>& tasks)
      : input_(input),
        frame_(frame),
        node_(node),
        room_(node.request.num_max_contacts - node.result->numContacts()),
        tasks_(tasks),
        limit_(room_, tasks.size()),
        found_(tasks.size()) {}

  /// Throws std::bad_alloc when memory ran out in a task.
  void run(const TaskPool& pool) {
    workers_.resize(static_cast<std::size_t>(pool.size()));
    pool.forEach(static_cast<int>(tasks_.size()), [this](int task, int slot) {
      try {
        if (limit_.needs(task)) run(task, workers_[static_cast<std::size_t>(slot)]);
      } catch (const std::bad_alloc&) {
        out_of_memory_ = true;
      }
    });
    if (out_of_memory_) throw std::bad_alloc();
  }

  /// Adds all contacts to the query's result, and the record of all threads to `search`.
  void collect(Search& search) const {
    for (const Found& found : found_)
      for (std::size_t i = found.begin; i < found.end && !node_.isDone(); ++i)
        node_.result->addContact(found.worker->contacts.getContact(i));
    for (const auto& worker : workers_)
      if (worker) search.add(worker->search);
  }

 private:
  struct Worker {
    explicit Worker(const ContactTasks& t)
        : node(t.node_), search(t.input_, t.frame_, node, memory) {
      node.result = &contacts;
    }
    typename Search::Memory memory;
    fcl::CollisionResult<S> contacts;
    ContactNode<BV> node;
    Search search;
  };
  /// The contacts of a task: some of a worker's.
  struct Found {
    const Worker* worker = nullptr;
    std::size_t begin = 0, end = 0;
  };

  void run(int task, std::unique_ptr<Worker>& worker) {
    if (!worker) worker = std::make_unique<Worker>(*this);
    const auto at = static_cast<std::size_t>(task);
    const std::size_t begin = worker->contacts.numContacts();
    worker->node.request.num_max_contacts =
        room_ > ~std::size_t(0) - begin ? ~std::size_t(0) : begin + room_;
    worker->search.run(tasks_[at]);
    found_[at] = {worker.get(), begin, worker->contacts.numContacts()};
    limit_.finish(task, found_[at].end - begin);
  }

  const CandidateInput<BV>& input_;
  const Frame& frame_;
  const ContactNode<BV>& node_;
  const std::size_t room_;  ///< for so many contacts
  const std::vector<NodePair>& tasks_;
  ContactLimit limit_;
  std::vector<Found> found_;  ///< by task
  std::vector<std::unique_ptr<Worker>> workers_;
  std::atomic<bool> out_of_memory_{false};
};

}  // namespace adaptive_bvh
