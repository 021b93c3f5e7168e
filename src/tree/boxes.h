#pragma once

#include <vector>

#include "tree/body_frame.h"
#include "tree/topology.h"

namespace adaptive_bvh {

/// What stands beside one of FCL's nodes: the box of its triangles, in body coordinates, and two
/// lengths in body units. 32 bytes; siblings share a cache line.
struct alignas(32) NodeBounds {
  float low[3] = {0, 0, 0};
  /// Bounds how far any point below the node has moved since the start, summed over the frames. It
  /// only grows: between two frames, by at least the motion between them.
  float travel = 0;
  float high[3] = {0, 0, 0};
  /// Current radius of FCL's volume - its radius when last refitted.
  float inflation = 0;

  Box box() const { return {Eigen::Map<const Lanes>(low), Eigen::Map<const Lanes>(high)}; }
  void setBox(const Box& box) {
    for (int k = 0; k < 3; ++k) {
      low[k] = box.low[k];
      high[k] = box.high[k];
    }
  }
};

/// A vertex in the present frame: where it is, in body coordinates, and how it came there, in the
/// model's axes and body units.
struct StagedVertex {
  float at[3];
  float motion[3];
};

/// What a node hands to its parent in the sweep.
struct Swept {
  Box box;     ///< of its triangles, in body coordinates
  Box motion;  ///< of the displacements of its vertices in this frame, model axes, body units
};

/// The companions of FCL's volumes: one tight box a node, renewed in every frame. Cheap to keep and
/// to test, they answer most of what a distance query asks, and tell how a node moved.
template <typename S>
class Boxes {
 public:
  BodyFrame<S> frame;
  std::vector<Swept> pending;  ///< the stack of the sweep

  bool empty() const { return pairs_.empty(); }
  NodeBounds& operator[](int node) { return pairs_[(node + 1) >> 1].node[(node + 1) & 1]; }
  const NodeBounds& operator[](int node) const {
    return pairs_[(node + 1) >> 1].node[(node + 1) & 1];
  }

  void resize(int nodes, int vertices, int depth) {
    pending.clear();
    pending.reserve(static_cast<std::size_t>(depth) + 1);
    pairs_.assign(static_cast<std::size_t>(nodes + 2) / 2, Pair());
    staged_.resize(static_cast<std::size_t>(vertices) + 1);  // one more, see `motionOf`
  }

  StagedVertex& staged(unsigned v) { return staged_[v]; }
  const StagedVertex& staged(unsigned v) const { return staged_[v]; }

  /// The fourth lane is what lies behind in memory.
  Lanes positionOf(unsigned v) const { return Eigen::Map<const Lanes>(staged_[v].at); }
  Lanes motionOf(unsigned v) const { return Eigen::Map<const Lanes>(staged_[v].motion); }

  /// A bound on the error of every coordinate of every box.
  float error() const {
    const Box root = (*this)[0].box();
    return BodyFrame<S>::kError * largestOf(root.low.abs().max(root.high.abs()));
  }

  std::size_t bytes() const {
    return pairs_.capacity() * sizeof(Pair) + staged_.capacity() * sizeof(StagedVertex) +
           pending.capacity() * sizeof(Swept);
  }

 private:
  struct alignas(64) Pair {
    NodeBounds node[2];
  };

  std::vector<Pair> pairs_;  // node 0 is the second of the first pair, so that siblings are one
  std::vector<StagedVertex> staged_;
};

}  // namespace adaptive_bvh
