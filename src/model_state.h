#pragma once

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "tree/adaptive_tree.h"
#include "update/advance.h"
#include "update/frame_buffer.h"

namespace adaptive_bvh {

/// All that a model holds beyond FCL's.
template <typename BV>
struct AdaptiveBVHModel<BV>::State {
  RefitPolicy policy;
  AdaptiveTree<BV> tree;
  FrameBuffer<S> frame;
  UpdateReport report;
  int threads = 1;

  /// The next positions of a frame.
  int stage(AdaptiveBVHModel& model, FrameKind kind, const Point* positions, std::size_t count) {
    return frame.add(kind, model.build_state, model.num_vertices, positions, count);
  }
  /// Ends the frame; `refit` takes it over.
  int endFrame(AdaptiveBVHModel& model, FrameKind kind, bool refit) {
    const int code = frame.end(kind, model.build_state, model.num_vertices);
    if (code == fcl::BVH_OK && refit) take(model, kind, frame.positions().data());
    return code;
  }
  const UpdateReport& take(AdaptiveBVHModel& model, FrameKind kind, const Point* positions) {
    report = advance<BV>(model, tree, policy, kind, positions, threads);
    return report;
  }
};

namespace detail {

/// The library's own way to the state of a model.
template <typename BV>
struct ModelAccess {
  static const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) {
    return model.state_->tree;
  }
};

}  // namespace detail
}  // namespace adaptive_bvh
