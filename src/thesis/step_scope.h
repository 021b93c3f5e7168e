#pragma once

#include <cstring>
#include <utility>

#include "base/task_pool.h"
#include "mesh/local_bounds.h"
#include "mesh/vertex_summary.h"
#include "thesis/refit.h"

// What the phases of a step process: all vertices and nodes, or some. The phases are read, then
// discard or: write, propagate, refit (`run` in step.cpp). `Method` is TranslationPropagation or
// DisplacementPropagation.
namespace adaptive_bvh {

/// A step of all vertices: every phase processes all vertices or all nodes, on a pool's threads.
template <typename BV, typename Method>
class AllVertices {
 public:
  using S = typename BV::S;
  using Summary = typename Method::Summary;

  AllVertices(const UpdateTarget<BV>& target, Method& method, const RefitPolicy& policy,
              const StepInput<S>& input, TaskPool& pool)
      : target_(target),
        method_(method),
        policy_(policy),
        input_(input),
        pool_(pool),
        squared_radius_(pool.size()) {}

  Method& method() const { return method_; }

  /// Reads the new positions; the model is unchanged. Returns their statistics.
  Summary read() {
    method_.begin(target_, input_);
    PerThread<Summary> summaries(pool_.size());
    pool_.forEachPart(Method::readSize(target_), pool_.size(),
                      [&](int first, int last, int thread) {
                        summaries[thread].add(method_.read(target_, input_, first, last));
                      });
    return summaries.sum([](auto& all, const auto& some) { all.add(some); });
  }

  void discard() { method_.discard(); }  ///< undoes `read`
  /// Whether the new positions equal the current ones; ends at the first vertex that differs.
  bool isAtRest() const {
    const auto equal = [&](const fcl::Vector3<S>* own) {
      return std::memcmp(own, input_.positions, input_.count * sizeof(*own)) == 0;
    };
    return input_.kind == StepKind::Replace && !target_.model.prev_vertices &&
           equal(input_.is_same ? target_.model.vertices : target_.tree.positions.data());
  }
  void rest() const { method_.rest(target_); }  ///< takes a step at rest; `refit` may follow
  bool judgesAtRest() const { return adaptive_bvh::judgesAtRest(policy_.criterion); }

  /// Writes the positions and the local bounds.
  void write(const VertexSummary<S>& summary) {
    setLocalBox(target_.model, summary.low, summary.high);
    pool_.forEachPart(
        target_.model.num_vertices, pool_.size(), [&](int first, int last, int thread) {
          const S squared =
              copyPoints(input_.positions + first, static_cast<std::size_t>(last - first),
                         target_.model.aabb_center, target_.model.vertices + first,
                         target_.tree.positions.data() + first);
          squared_radius_[thread] = std::max(squared_radius_[thread], squared);
        });
    setLocalRadius(target_.model,
                   squared_radius_.sum([](S& all, S some) { all = std::max(all, some); }));
  }

  PropagationCounts propagate() { return method_.propagate(target_, policy_, pool_); }

  RefitCounts<S> refit() {
    if (policy_.criterion == FitnessCriterion::RefitNone) return {};
    PerThread<RefitCounts<S>> counts(pool_.size());
    const NodeRange turn = method_.nextTurn(target_);
    const int parts = pool_.size() > 1 ? 512 : 1;  // many parts balance the work of threads
    pool_.forEachPart(target_.nodes(), parts, [&](int first, int last, int thread) {
      Refitter<BV, Method> refitter(target_, method_, policy_, turn);
      refitter.judge(first, last, method_.candidates());
      counts[thread] += refitter.finish();
    });
    const RefitCounts<S> all = counts.sum([](auto& sum, const auto& some) { sum += some; });
    target_.tree.inflations.include(all.corner_sum);
    return all;
  }

 private:
  const UpdateTarget<BV> target_;
  Method& method_;
  const RefitPolicy& policy_;
  const StepInput<S>& input_;
  TaskPool& pool_;
  /// The square of FCL's aabb_radius. A member, so that it is allocated before the first position
  /// is written.
  PerThread<S> squared_radius_;
};

/// A step of a few vertices: every phase processes these vertices or the nodes above them.
template <typename BV, typename Method>
class SomeVertices {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  using Summary = typename Method::Summary;

  SomeVertices(const UpdateTarget<BV>& target, Method& method, const RefitPolicy& policy,
               const StepInput<S>& input, DirtyNodes& nodes)
      : target_(target),
        method_(method),
        policy_(policy),
        input_(input),
        nodes_(nodes),
        box_(target.model.aabb_local) {}

  Method& method() const { return method_; }

  /// Reads the new positions and marks the leaves of their vertices; the model is unchanged.
  /// Returns their statistics.
  Summary read() {
    if (nodes_.isEmpty()) nodes_ = target_.tree.topology.dirtyNodes(target_.tree.positions.size());
    method_.begin(target_, input_);
    return method_.readSome(target_, input_, nodes_, [&](unsigned v, const Point& to) {
      box_.move(target_.tree.positions[v], to);
      nodes_.add(v);
    });
  }

  /// Undoes `read`.
  void discard() {
    method_.discard();
    nodes_.unmarkAll();
  }
  static bool isAtRest() { return false; }  // not checked
  static bool judgesAtRest() { return true; }
  static void rest() {}

  /// Writes the positions and the local bounds.
  void write(const VertexSummary<S>&) {
    std::vector<Point>& positions = target_.tree.positions;
    for (std::size_t i = 0; i < input_.count; ++i) {
      const unsigned v = input_.indices[i];
      target_.model.vertices[v] = positions[v] = input_.positions[i];
    }
    box_.finish(positions.data(), positions.size(), target_.model);
  }

  PropagationCounts propagate() { return method_.propagateDirty(target_, policy_, nodes_); }

  /// Refits unfit volumes of marked nodes; no node is marked any more.
  RefitCounts<S> refit() {
    Refitter<BV, Method> refitter(target_, method_, policy_, NodeRange());
    const bool may_refit = policy_.criterion != FitnessCriterion::RefitNone;
    for (int pair = nodes_.size(); (pair = nodes_.before(pair)) >= 0;) {
      if (may_refit && pair > 0) {
        refitter.judge(2 * pair - 1);
        refitter.judge(2 * pair);
      }
      nodes_.unmark(pair);
    }
    if (may_refit) refitter.judge(0);
    const RefitCounts<S> counts = refitter.finish();
    target_.tree.inflations.include(counts.corner_sum);
    return counts;
  }

 private:
  const UpdateTarget<BV> target_;
  Method& method_;
  const RefitPolicy& policy_;
  const StepInput<S>& input_;
  DirtyNodes& nodes_;
  BoxAfterSome<S> box_;  ///< computes the new local bounds
};

}  // namespace adaptive_bvh
