#pragma once

#include <cstring>
#include <utility>

#include "base/task_pool.h"
#include "mesh/local_bounds.h"
#include "mesh/vertex_summary.h"
#include "thesis/refit.h"
#include "thesis/vertex_leaf_map.h"

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
    const fcl::BVHModel<BV>& model = target_.model;
    return input_.kind == StepKind::Replace && !model.prev_vertices &&
           std::memcmp(model.vertices, input_.positions, input_.count * sizeof(*model.vertices)) ==
               0;
  }

  /// Writes the positions and the local bounds.
  void write(const VertexSummary<S>& summary) {
    setLocalBox(target_.model, summary.low, summary.high);
    pool_.forEachPart(
        target_.model.num_vertices, pool_.size(), [&](int first, int last, int thread) {
          const S squared =
              copyPoints(input_.positions + first, static_cast<std::size_t>(last - first),
                         target_.model.aabb_center, target_.model.vertices + first);
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
    const Candidates* const marked = candidates();
    const int size = marked ? marked->words() : target_.nodes();
    const int parts = pool_.size() > 1 ? 512 : 1;  // many parts balance the work of threads
    pool_.forEachPart(size, parts, [&](int first, int last, int thread) {
      Refitter<BV, Method> refitter(target_, method_, policy_, turn);
      const auto judge = [&](int node) { refitter.judge(node); };
      if (policy_.criterion == FitnessCriterion::RefitAll)
        refitter.refitAll(first, last);
      else if (marked)
        marked->forEach(first, last, judge);
      else
        for (int node = first; node < last; ++node) judge(node);
      counts[thread] += refitter.finish();
    });
    const RefitCounts<S> all = counts.sum([](auto& sum, const auto& some) { sum += some; });
    target_.tree.inflations.include(all.corner_sum);
    return all;
  }

 private:
  /// The candidates for refits; null to judge all nodes.
  const Candidates* candidates() const {
    if constexpr (Method::kTakesSomeVertices)
      if (method_.candidates().isOn()) return &method_.candidates();
    return nullptr;
  }

  const UpdateTarget<BV> target_;
  Method& method_;
  const RefitPolicy& policy_;
  const StepInput<S>& input_;
  TaskPool& pool_;
  /// The square of FCL's aabb_radius. A member, so that it is allocated before the first position
  /// is written.
  PerThread<S> squared_radius_;
};

/// A step of a few vertices: every phase processes these vertices or the dirty nodes above them.
template <typename BV, typename Method>
class SomeVertices {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  using Summary = typename Method::Summary;

  SomeVertices(const UpdateTarget<BV>& target, Method& method, const RefitPolicy& policy,
               const StepInput<S>& input, VertexLeafMap& leaves, DirtyPairs& dirty)
      : target_(target),
        method_(method),
        policy_(policy),
        input_(input),
        leaves_(leaves),
        dirty_(dirty),
        box_(target.model.aabb_local) {}

  Method& method() const { return method_; }

  /// Reads the new positions and marks the nodes above their vertices as dirty; the model is
  /// unchanged. Returns their statistics.
  Summary read() {
    if (leaves_.empty()) {
      VertexLeafMap leaves;
      leaves.assign(target_.tree.topology, target_.model.num_vertices);
      resetDirty();
      leaves_ = std::move(leaves);
    }
    method_.begin(target_, input_);
    return method_.readSome(target_, input_, leaves_, [&](unsigned v, const Point& to) {
      box_.move(target_.model.vertices[v], to);
      leaves_.markAncestors(v, dirty_);
    });
  }

  /// Undoes `read`.
  void discard() {
    method_.discard();
    if (!leaves_.empty()) resetDirty();
  }
  static bool isAtRest() { return false; }  // not checked

  /// Writes the positions and the local bounds.
  void write(const VertexSummary<S>&) {
    for (std::size_t i = 0; i < input_.count; ++i)
      target_.model.vertices[input_.indices[i]] = input_.positions[i];
    box_.finish(target_.model.vertices, static_cast<std::size_t>(target_.model.num_vertices),
                target_.model);
  }

  PropagationCounts propagate() { return method_.propagateDirty(target_, policy_, dirty_); }

  /// Refits unfit volumes of dirty nodes; no node is dirty any more.
  RefitCounts<S> refit() {
    Refitter<BV, Method> refitter(target_, method_, policy_, NodeRange());
    const bool may_refit = policy_.criterion != FitnessCriterion::RefitNone;
    for (int left = target_.nodes(); (left = dirty_.before(left)) > 0;) {
      if (may_refit) {
        refitter.judge(left);
        refitter.judge(left + 1);
      }
      dirty_.unset(left);
    }
    if (may_refit) refitter.judge(0);
    const RefitCounts<S> counts = refitter.finish();
    target_.tree.inflations.include(counts.corner_sum);
    return counts;
  }

 private:
  void resetDirty() { dirty_.reset(target_.tree.topology.slots.leaves() - 1); }

  const UpdateTarget<BV> target_;
  Method& method_;
  const RefitPolicy& policy_;
  const StepInput<S>& input_;
  VertexLeafMap& leaves_;
  DirtyPairs& dirty_;
  BoxAfterSome<S> box_;  ///< computes the new local bounds
};

}  // namespace adaptive_bvh
