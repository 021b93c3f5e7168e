#include "update/parallel.h"

#include "update/box_propagation.h"
#include "update/local_bounds.h"
#include "update/team.h"

namespace adaptive_bvh {
namespace {

/// Share `i` of [0, size) cut in `shares`.
int cut(int size, int shares, int i) {
  return static_cast<int>(static_cast<long long>(size) * i / shares);
}

template <typename BV>
class ParallelUpdate {
 public:
  using S = typename BV::S;

  ParallelUpdate(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                 const fcl::Vector3<S>* positions, int threads)
      : model_(model),
        tree_(tree),
        policy_(policy),
        positions_(positions),
        team_(threads),
        subtrees_(subtreesOf(model, 8 * threads)),
        subtree_tasks_(static_cast<int>(subtrees_.size())),
        refit_tasks_(kRefitTasks),
        members_(static_cast<std::size_t>(threads)) {}

  S run(Stopwatch& watch, UpdateReport& report) {
    beginStaging(model_, *tree_.boxes, positions_);
    team_.run([&](int member) { work(member, watch, report); });
    for (const Member& member : members_) {
      report.moved += member.propagated.moved;
      report.inflated += member.propagated.inflated;
      report.refitted_leaves += member.report.refitted_leaves;
      report.refitted_inner += member.report.refitted_inner;
      report.refitted_primitives += member.report.refitted_primitives;
      tree_.widenReach(member.reach);
    }
    report.refit_seconds = watch.lap();
    return largest_;
  }

 private:
  /// What one thread finds. On a cache line of its own.
  struct alignas(64) Member {
    StagedRange<S> staged;
    S squared_radius = 0;
    Propagated propagated;
    UpdateReport report;
    S reach = 0;
  };

  void work(int index, Stopwatch& watch, UpdateReport& report) {
    Member& mine = members_[static_cast<std::size_t>(index)];
    Boxes<S>& boxes = *tree_.boxes;
    const int first = cut(model_.num_vertices, team_.size(), index);
    const int last = cut(model_.num_vertices, team_.size(), index + 1);

    mine.staged = stageRange(model_, boxes, positions_, first, last);
    team_.meet();
    if (index == 0) {
      StagedRange<S> all;
      for (const Member& member : members_) all.add(member.staged);
      largest_ = finishStaging(model_, boxes, all);
      report.displacement_seconds = watch.lap();
    }
    team_.meet();
    mine.squared_radius = squaredRadius(model_, first, last);
    const bool finite = std::isfinite(largest_);
    if (finite) mine.propagated = sweepSubtrees(boxes);
    team_.meet();
    if (index == 0) {
      S squared = 0;
      for (const Member& member : members_) squared = std::max(squared, member.squared_radius);
      model_.aabb_radius = std::sqrt(squared);
      if (finite) mine.propagated += propagateAbove(model_, tree_.topology, boxes, subtrees_);
      report.propagation_seconds = watch.lap();
    }
    team_.meet();
    if (finite) refitSome(mine);
  }

  Propagated sweepSubtrees(Boxes<S>& boxes) {
    std::vector<Swept> stack(tree_.topology.stackPlaces());
    Propagated propagated;
    for (int task; (task = subtree_tasks_.next()) >= 0;)
      propagated += propagateWithin(model_, tree_.topology, boxes,
                                    subtrees_[static_cast<std::size_t>(task)], stack.data());
    return propagated;
  }

  void refitSome(Member& mine) {
    const int nodes = model_.getNumBVs();
    for (int task; (task = refit_tasks_.next()) >= 0;)
      mine.reach =
          std::max(mine.reach, refitUnfit(model_, tree_, policy_, cut(nodes, kRefitTasks, task),
                                          cut(nodes, kRefitTasks, task + 1), mine.report));
  }

  static constexpr int kRefitTasks = 512;

  fcl::BVHModel<BV>& model_;
  AdaptiveTree<BV>& tree_;
  const RefitPolicy& policy_;
  const fcl::Vector3<S>* const positions_;
  Team team_;
  std::vector<Subtree> subtrees_;
  TaskList subtree_tasks_, refit_tasks_;
  std::vector<Member> members_;
  S largest_ = 0;
};

}  // namespace

template <typename BV>
typename BV::S stagePropagateRefit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree,
                                   const RefitPolicy& policy,
                                   const fcl::Vector3<typename BV::S>* positions, int threads,
                                   Stopwatch& watch, UpdateReport& report) {
  return ParallelUpdate<BV>(model, tree, policy, positions, threads).run(watch, report);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template S stagePropagateRefit(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&,     \
                                 const RefitPolicy&, const fcl::Vector3<S>*, int, Stopwatch&, \
                                 UpdateReport&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
