#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "tree/attitude.h"
#include "tree/body_frame.h"
#include "tree/topology.h"
#include "volume/rounding.h"

namespace adaptive_bvh {

/// The box of a node's triangles, in body coordinates, and the node's place in the tree, so that
/// walks need no more of FCL's nodes, which are 136 bytes each. Siblings share a cache line.
class alignas(32) NodeBox {
 public:
  Box box() const { return {lanes::load(low_), lanes::load(high_)}; }
  ADAPTIVE_BVH_INLINE void setBox(const Box& box) {
    const float link = low_[3];
    lanes::store(box.low, low_);
    lanes::store(box.high, high_);
    low_[3] = link;
  }

  bool isLeaf() const { return link() < kFirst; }
  /// Of an inner node: the left child, which the right one follows.
  int left() const { return link() - kFirst; }
  /// Of a leaf: its place among the leaves.
  int leaf() const { return kFirst - 1 - link(); }

  void setLeft(int node) { setLink(kFirst + node); }
  void setLeaf(int leaf) { setLink(kFirst - 1 - leaf); }

 private:
  /// The bits of 1.f. As the fourth lane of arithmetic, a link is then an ordinary number near 1;
  /// small integers would be denormal ones, with which processors are slow.
  static constexpr std::int32_t kFirst = 0x3f800000;

  std::int32_t link() const {
    std::int32_t bits;
    std::memcpy(&bits, low_ + 3, sizeof(bits));
    return bits;
  }
  void setLink(std::int32_t bits) { std::memcpy(low_ + 3, &bits, sizeof(bits)); }

  float low_[4] = {0, 0, 0, 1};  ///< the fourth: the bits of a link
  float high_[4] = {0, 0, 0, 0};
};

/// A vertex in the present frame: where it is, in body coordinates, and how it came there beyond
/// the common translation (Boxes::common), in the model's axes and body units.
struct alignas(32) StagedVertex {
  float at[4];
  float motion[4];
};

/// What a node hands to its parent in the sweep.
struct Swept {
  Box box;     ///< of its triangles, in body coordinates
  Box motion;  ///< of its vertices' StagedVertex::motion
};

/// The companions of FCL's volumes: one tight box a node, renewed in every frame. Cheap to keep and
/// to test, they answer most of what a distance query asks, and tell how a node moved.
template <typename S>
struct Boxes {
  BodyFrame<S> frame;
  Attitude<S> attitude;
  /// By node + 1, so that siblings share a cache line.
  std::vector<NodeBox> box;
  /// Likewise, two lengths a node in body units: inflation, then travel.
  std::vector<float> growth;
  std::vector<StagedVertex> staged;  ///< by vertex
  std::vector<Swept> pending;        ///< the stack of the sweep

  /// By vertex, in swept mode: where it was in the frame before, in body coordinates.
  std::vector<std::array<float, 4>> before;
  /// The vertices whose motions are not 0: all, or those listed.
  bool all_moving = true;
  std::vector<unsigned> moving;
  /// A motion that most of the body shares in this frame, of whatever size. What is left of each
  /// vertex's is small where the body hardly deforms, and so are the errors of single precision.
  fcl::Vector3<S> common = fcl::Vector3<S>::Zero();
  /// Bounds |x| + |y| + |z| of FCL's volumes' corners, and their radii: what moving them rounds.
  S reach = 0;
  /// Where the next update goes on looking for decayed volumes (refit.h).
  int next_decayed = 0;

  const NodeBox& operator[](int node) const { return box[static_cast<std::size_t>(node) + 1]; }

  /// Current radius of FCL's volume - its radius when last refitted.
  float& inflationOf(int node) { return growth[2 * static_cast<std::size_t>(node) + 2]; }
  float inflationOf(int node) const { return growth[2 * static_cast<std::size_t>(node) + 2]; }
  /// Bounds how far any point below the node has moved since the start, summed over the frames. It
  /// only grows: between two frames, by at least the motion between them.
  float& travelOf(int node) { return growth[2 * static_cast<std::size_t>(node) + 3]; }
  float travelOf(int node) const { return growth[2 * static_cast<std::size_t>(node) + 3]; }

  /// What moving a volume in a frame may round off, in the mesh's units.
  S rounding() const { return 4 * rounding::epsilon<S>() * reach + rounding::tiny<S>(); }

  /// To be called before volumes are moved for displacements of at most `largest`. A volume whose
  /// displacements have the middle c and half sides h moves by |c|_1 <= 3 largest - |h|_1 and grows
  /// by |h|_2, by `rounding` and by single precision's share. Rounded up: steps too small to change
  /// the sum must not be lost.
  void extendReach(S largest) {
    if (!(largest > 0)) return;
    reach = (reach + 4 * largest + frame.unit() * S(1.f / (1ull << 56))) *
            (1 + 8 * rounding::epsilon<S>());
  }

  /// Whether single precision can tell a motion of at most `largest`. False for what is no number.
  bool canFollow(S largest) const { return largest * frame.scale() < S(kMost); }
  /// Whether it can still tell the body's parts: not when that has grown or shrunk out of all
  /// proportion to what it was when the frame was laid.
  bool areInRange() const {
    const float reach = box[1].box().reach();
    return reach < kMost && reach > 1 / kMost;
  }

  /// The middle of all triangles, in the model's coordinates.
  fcl::Vector3<S> middle() const {
    const Box root = box[1].box();
    const Lanes center = (root.low + root.high) * lanes::all(0.5f);
    return frame.origin() +
           (frame.axes() * fcl::Vector3d(double(center[0]), double(center[1]), double(center[2])))
                   .template cast<S>() *
               frame.unit();
  }

  /// Room and links; the boxes themselves come with the next sweep.
  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model, const Topology& topology) {
    const auto nodes = static_cast<std::size_t>(model.getNumBVs());
    box.assign(nodes + 1, NodeBox());
    growth.assign(2 * nodes + 2, 0.f);
    staged.resize(static_cast<std::size_t>(model.num_vertices));
    pending.resize(topology.stackPlaces());
    for (std::size_t i = 0; i < nodes; ++i) {
      const auto& node = model.getBV(static_cast<int>(i));
      if (node.isLeaf())
        box[i + 1].setLeaf(node.first_primitive);
      else
        box[i + 1].setLeft(node.leftChild());
    }
  }

  static constexpr float kMost = 1 << 30;

  std::size_t bytes() const {
    const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return size(box) + size(growth) + size(staged) + size(before) + size(moving) + size(pending) +
           attitude.bytes();
  }
};

}  // namespace adaptive_bvh
