#pragma once

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "tree/adaptive_tree.h"
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
