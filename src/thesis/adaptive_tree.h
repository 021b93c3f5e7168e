#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

#include "base/rounding.h"
#include "hierarchy/vertex_slots.h"
#include "thesis/traversal_statistics.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {

/// What FCL's tree looks like, beyond its nodes.
///
/// FCL numbers nodes in preorder of their parents, siblings side by side: the children of the k-th
/// inner node are 2k+1 and 2k+2. So the nodes below a node are a range, and walking the pairs of
/// siblings from the last to the first visits children before parents, the right subtree first:
/// a stack is all the memory that a post-order traversal needs (thesis/post_order.h).
struct Topology {
  /// The vertices of every primitive, in the order of the leaves: those below a node are
  /// [first_primitive, + num_primitives).
  VertexSlots slots;
  int depth = 0;  ///< links from the root to the deepest leaf
  /// By node: the left child, which the right one follows; of a leaf -1 less its index among the
  /// leaves. (FCL's nodes are 136 bytes each.)
  std::vector<std::int32_t> links;

  bool isLeaf(int node) const { return links[static_cast<std::size_t>(node)] < 0; }
  int left(int node) const { return links[static_cast<std::size_t>(node)]; }
  int leafIndex(int node) const { return -1 - links[static_cast<std::size_t>(node)]; }
  /// The number of an inner node among the inner nodes.
  std::size_t innerIndex(int node) const { return static_cast<std::size_t>(left(node) - 1) / 2; }

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model);

  /// The capacity that the stack of a post-order traversal needs.
  std::size_t stackCapacity() const { return static_cast<std::size_t>(depth) + 2; }

  std::size_t bytes() const { return slots.bytes() + links.capacity() * sizeof(links[0]); }
};

/// By how much each volume was inflated since it was last refitted, in body units, and a bound of
/// all volumes' coordinates. Every sum is rounded up, so that no step is lost in it.
template <typename S>
class Inflations {
 public:
  /// Room for `nodes` nodes, none inflated.
  void reset(int nodes) { inflations_.assign(static_cast<std::size_t>(nodes), 0.f); }

  /// Radius of FCL's volume less its radius when last refitted.
  float of(int node) const { return inflations_[static_cast<std::size_t>(node)]; }
  void set(int node, float inflation) { inflations_[static_cast<std::size_t>(node)] = inflation; }
  /// By node.
  float* data() { return inflations_.data(); }

  /// Bounds Volume::cornerSum of all volumes.
  S coordinateSum() const { return coordinate_sum_; }
  /// A volume has been refitted whose Volume::cornerSum this is.
  void include(S corner_sum) { coordinate_sum_ = std::max(coordinate_sum_, corner_sum); }
  /// Call this before volumes are moved for displacements of at most `largest`. A volume whose
  /// displacements have the middle c and half sides h moves by |c|_1 <= 3 largest - |h|_1 and grows
  /// by |h|_2, by `roundingOfMove` and by single precision's share (of a body unit). Rounded up:
  /// steps too small to change the sum must not be lost.
  void extend(S largest, S body_unit) {
    if (!(largest > 0)) return;
    way_ += largest;
    coordinate_sum_ = (coordinate_sum_ + 4 * largest + body_unit * S(1.f / (1ull << 56))) *
                      (1 + 8 * rounding::epsilon<S>());
  }
  /// What moving a volume in a step may round off, in the mesh's units.
  S roundingOfMove() const {
    return 4 * rounding::epsilon<S>() * coordinate_sum_ + rounding::tiny<S>();
  }

  /// Whether steps have made the coordinate sum so much larger than the volumes' that it should
  /// begin anew. They are some sixty times the body's size long then.
  bool needsRestart(S body_unit) const { return way_ > 64 * body_unit; }
  /// Lets the coordinate sum begin anew; `include` is to follow for every volume.
  void restart() { way_ = coordinate_sum_ = 0; }

  std::size_t bytes() const { return inflations_.capacity() * sizeof(float); }

 private:
  std::vector<float> inflations_;
  S coordinate_sum_ = 0;
  S way_ = 0;  ///< the largest displacements since `restart`, summed
};

/// Which volumes the last update recomputed. A byte a node holds the number of the step that did
/// it; a step clears all marks by raising that number. Several threads may mark different nodes.
class RefitMarks {
 public:
  /// Room for `nodes` nodes, none marked.
  void reset(int nodes) {
    steps_.assign(static_cast<std::size_t>(nodes), 0);
    step_ = 1;
  }
  /// Forgets all marks.
  void clear() {
    if (++step_ != 0) return;
    std::fill(steps_.begin(), steps_.end(), std::uint8_t(0));
    step_ = 1;
  }
  void mark(int node) { steps_[static_cast<std::size_t>(node)] = step_; }
  void markAll() { std::fill(steps_.begin(), steps_.end(), step_); }
  /// In ascending order.
  std::vector<int> marked() const {
    std::vector<int> nodes;
    if (steps_.empty()) return nodes;
    const std::uint8_t *const first = steps_.data(), *const end = first + steps_.size();
    for (const std::uint8_t* at = first; at < end; ++at) {
      at = static_cast<const std::uint8_t*>(
          std::memchr(at, step_, static_cast<std::size_t>(end - at)));
      if (!at) break;
      nodes.push_back(static_cast<int>(at - first));
    }
    return nodes;
  }

  std::size_t bytes() const { return steps_.capacity(); }

 private:
  std::vector<std::uint8_t> steps_;  // 0 is no step
  std::uint8_t step_ = 1;
};

/// Detects that FCL changed a tree without our update. FCL's mutators are not virtual: code that
/// holds a fcl::BVHModel& can refit or rebuild the nodes (FCL's own polynomial continuous collision
/// does). Every such path rewrites the root, so the root's numbers are compared with a copy.
///
/// `record` raises the root's radius by one step of floating point, which is conservative. A fit of
/// the same positions that leaves all other numbers alike thus never looks like the recorded root.
///
/// `matches` may run on many threads while one of them, having found a change, repairs the model
/// and records it. The numbers are therefore written and read as atomics; the repair comes first,
/// so a thread that sees the new root sees the repaired tree.
template <typename BV>
class ChangeDetector {
 public:
  using S = typename BV::S;
  using V = Volume<BV>;

  /// Is this the root that was recorded last?
  bool matches(const BV& root) const {
    if (!load(recorded_)) return false;
    for (int i = 0; i < V::kNumbers; ++i) {
      const S a = load(number(root, i));
      const S b = load(number(copy_, i));
      // Bits, not values: NaN equals itself here, and 0 differs from -0.
      if (std::memcmp(&a, &b, sizeof(S)) != 0)  // NOLINT(bugprone-suspicious-memory-comparison)
        return false;
    }
    return true;
  }

  /// Writes `volume`, with its radius one step up, to the root and remembers it. Returns that
  /// radius.
  S record(BV& root, BV volume) {
    V::raiseRadius(volume);
    for (BV* target : {&copy_, &root})
      for (int i = 0; i < V::kNumbers; ++i) store(V::number(*target, i), V::number(volume, i));
    store(recorded_, true);
    return V::radius(volume);
  }

  /// From now on no root matches, until the next `record`.
  void invalidate() { store(recorded_, false); }
  bool isInvalidated() const { return !load(recorded_); }

 private:
  static const S& number(const BV& bv, int i) { return V::number(const_cast<BV&>(bv), i); }
  template <typename T>
  static T load(const T& source) {
    T value;
    __atomic_load(&source, &value, __ATOMIC_ACQUIRE);
    return value;
  }
  template <typename T>
  static void store(T& target, T value) {
    __atomic_store(&target, &value, __ATOMIC_RELEASE);
  }

  bool recorded_ = false;
  BV copy_;
};

/// What is kept beside FCL's tree of one model: its shape, the inflations that an update works
/// with, what queries recorded, and a detector of changes that were not ours.
template <typename BV>
struct AdaptiveTree {
  using S = typename BV::S;

  AdaptiveTree() = default;
  AdaptiveTree(const AdaptiveTree& other)
      : adoptions(other.adoptions),
        topology(other.topology),
        inflations(other.inflations),
        statistics(other.statistics),
        refits(other.refits),
        detector(other.detector) {}

  /// Number of times that all that is kept began anew: by builds, repairs, and steps that could not
  /// be followed.
  int adoptions = 0;
  Topology topology;
  Inflations<S> inflations;                ///< with Propagation::TranslationCompensated
  mutable TraversalStatistics statistics;  ///< written by queries, which hold the model const
  RefitMarks refits;                       ///< of the last step
  ChangeDetector<BV> detector;
  std::mutex repairing;  ///< held by the one thread that repairs a changed tree

  /// Takes over FCL's tree as it stands. Statistics begin anew; inflations are not set.
  void adopt(const fcl::BVHModel<BV>& model);

  /// Lets the bound of all volumes' coordinates begin anew, so that it does not lose digits.
  void restartCoordinateSum(const fcl::BVHModel<BV>& model);

  std::size_t bytes() const {
    return topology.bytes() + inflations.bytes() + statistics.bytes() + refits.bytes();
  }
};

/// The links of the tree and the invariant, see AdaptiveBVHModel::validate. Judges the nodes as
/// they stand, by nothing but FCL's own data.
template <typename BV>
bool checkTree(const fcl::BVHModel<BV>& model, std::string* reason);

/// The model of an update: FCL's part of it, and what stands beside.
template <typename BV>
struct UpdateTarget {
  fcl::BVHModel<BV>& model;
  AdaptiveTree<BV>& tree;

  int nodes() const { return model.getNumBVs(); }
  BV& volume(int node) const { return model.getBV(node).bv; }
  /// The volume around a node's triangles as they stand.
  BV fitted(int node) const;
};

/// The nodes in [first, last).
struct NodeRange {
  int first = 0, last = 0;
  bool contains(int node) const { return first <= node && node < last; }
};

/// How many volumes a propagation changed: see UpdateReport.
struct PropagationCounts {
  int moved = 0, inflated = 0;
  void operator+=(const PropagationCounts& other) {
    moved += other.moved;
    inflated += other.inflated;
  }
};

/// The two ways FCL brings in new positions: replace*, and update*, which keeps those of the step
/// before: volumes then hold both frames.
enum class StepKind { Replace, TwoFrames };

/// The new positions of a step.
template <typename S>
struct StepInput {
  StepKind kind = StepKind::Replace;
  const fcl::Vector3<S>* positions = nullptr;  ///< not in the model's own arrays
  std::size_t count = 0;
  const unsigned* indices = nullptr;  ///< whose positions they are; null: every vertex's, in order
};

#define ADAPTIVE_BVH_INSTANTIATE(BV)       \
  extern template struct AdaptiveTree<BV>; \
  extern template struct UpdateTarget<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
