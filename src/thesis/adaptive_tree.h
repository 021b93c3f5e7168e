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
#include "hierarchy/dirty_nodes.h"
#include "hierarchy/vertex_slots.h"
#include "thesis/traversal_statistics.h"
#include "thesis/volumes/volume.h"

// What an AdaptiveBVHModel stores beside FCL's tree (AdaptiveTree), and what an update of a model
// works on (UpdateTarget, StepInput). A node is a number: its index in FCL's array of nodes.
namespace adaptive_bvh {

/// The topology of FCL's tree, in a compact form.
///
/// FCL numbers nodes in preorder of their parents, siblings side by side: the children of the k-th
/// inner node are 2k+1 and 2k+2. So the nodes below a node are a range, and iterating over the
/// pairs of siblings from the last to the first visits children before parents, right subtrees
/// first. A post-order traversal therefore needs only a stack (thesis/post_order.h).
struct Topology {
  /// The vertices of every primitive, in leaf order: the leaves below a node are [first_primitive,
  /// first_primitive + num_primitives).
  VertexSlots slots;
  int depth = 0;  ///< links from the root to the deepest leaf
  /// By node: its left child (the right child is the next number); for a leaf, -1 minus its leaf
  /// index. (FCL's nodes take 136 bytes each.)
  std::vector<std::int32_t> links;

  bool isLeaf(int node) const { return links[static_cast<std::size_t>(node)] < 0; }
  /// The left child of an inner node.
  int left(int node) const { return links[static_cast<std::size_t>(node)]; }
  /// The position of a leaf in leaf order, see `slots`.
  int leafIndex(int node) const { return -1 - links[static_cast<std::size_t>(node)]; }
  /// The index of an inner node among the inner nodes.
  std::size_t innerIndex(int node) const { return static_cast<std::size_t>(left(node) - 1) / 2; }

  template <typename BV>
  void assign(const fcl::BVHModel<BV>& model);

  /// For steps of some vertices. A node of it stands for a pair of siblings: 0 for the root, and
  /// k + 1 for the children of the k-th inner node, 2k+1 and 2k+2.
  DirtyNodes dirtyNodes(std::size_t num_vertices) const;
  /// Calls visit(slot) for every slot of a vertex (see VertexSlots), for some slots more than once.
  /// A vertex without a triangle has none.
  template <typename Visit>
  void forEachSlot(unsigned vertex, const DirtyNodes& pairs, Visit&& visit) const {
    pairs.forEachLeaf(vertex, [&](unsigned pair) {
      for (int node = pair == 0 ? 0 : 2 * int(pair) - 1; node <= 2 * int(pair); ++node)
        if (isLeaf(node))
          for (unsigned slot : slots.slotsOf(static_cast<std::size_t>(leafIndex(node))))
            if (slots.vertices()[slot] == vertex) visit(slot);
    });
  }

  /// The capacity that the stack of a post-order traversal needs.
  std::size_t stackCapacity() const { return static_cast<std::size_t>(depth) + 2; }

  std::size_t bytes() const { return slots.bytes() + links.capacity() * sizeof(links[0]); }
};

/// The inflation of each volume since its last refit, in body units (ScaledFrame), and an upper
/// bound of the coordinates of all volumes, which bounds the rounding error of moving them.
template <typename S>
class Inflations {
 public:
  /// Allocates `nodes` nodes, none inflated.
  void reset(int nodes) { inflations_.assign(static_cast<std::size_t>(nodes), 0.f); }

  /// The volume's current radius minus its radius at the last refit.
  float of(int node) const { return inflations_[static_cast<std::size_t>(node)]; }
  void set(int node, float inflation) { inflations_[static_cast<std::size_t>(node)] = inflation; }
  float* data() { return inflations_.data(); }  ///< the array of all inflations, indexed by node

  /// An upper bound of Volume::cornerSum over all volumes, in the mesh's units.
  S coordinateSum() const { return coordinate_sum_; }
  /// Includes a refitted volume with this Volume::cornerSum in the bound.
  void include(S corner_sum) { coordinate_sum_ = std::max(coordinate_sum_, corner_sum); }
  /// Enlarges the bound. Call this before a step whose displacements have lengths of at most
  /// `largest` moves the volumes. If the bounding box of a volume's displacements has the centre c
  /// and half sides h, the volume moves by c and grows by |h|_2. Since |c|_1 + |h|_1 <= 3 largest,
  /// its cornerSum grows by at most 3 largest; the rest covers `roundingOfMove` and the error of
  /// single precision (a share of a body unit). The factor rounds up: a step that is too small to
  /// change the sum still enlarges it.
  void extend(S largest, S body_unit) {
    if (!(largest > 0)) return;
    displacement_sum_ += largest;
    coordinate_sum_ = (coordinate_sum_ + 4 * largest + body_unit * S(1.f / (1ull << 56))) *
                      (1 + 8 * rounding::epsilon<S>());
  }
  /// The largest rounding error of moving a volume in a step, in the mesh's units.
  S roundingOfMove() const {
    return 4 * rounding::epsilon<S>() * coordinate_sum_ + rounding::tiny<S>();
  }

  /// Whether the coordinate bound should be recomputed, because the steps since `restart` add up to
  /// about sixty times the body's size, and the bound may be as much too large.
  bool needsRestart(S body_unit) const { return displacement_sum_ > 64 * body_unit; }
  /// Resets the coordinate bound; `include` must follow for every volume.
  void restart() { displacement_sum_ = coordinate_sum_ = 0; }

  std::size_t bytes() const { return inflations_.capacity() * sizeof(float); }

 private:
  std::vector<float> inflations_;  ///< by node
  S coordinate_sum_ = 0;
  S displacement_sum_ = 0;  ///< sum of the largest displacements since `restart`
};

/// Marks the volumes that the last update recomputed. One byte per node holds the number of the
/// step that recomputed it; a step clears all marks by incrementing that number. Several threads
/// may mark different nodes.
class RefitMarks {
 public:
  /// Allocates `nodes` nodes, none marked.
  void reset(int nodes) {
    steps_.assign(static_cast<std::size_t>(nodes), 0);
    step_ = 1;
  }
  /// Clears all marks.
  void clear() {
    if (++step_ != 0) return;
    std::fill(steps_.begin(), steps_.end(), std::uint8_t(0));
    step_ = 1;
  }
  void mark(int node) { steps_[static_cast<std::size_t>(node)] = step_; }
  void markAll() { std::fill(steps_.begin(), steps_.end(), step_); }
  /// The marked nodes in ascending order.
  std::vector<int> marked() const {
    std::vector<int> nodes;
    if (steps_.empty()) return nodes;
    const std::uint8_t *const first = steps_.data(), *const end = first + steps_.size();
    for (const std::uint8_t* byte = first; byte < end; ++byte) {
      byte = static_cast<const std::uint8_t*>(
          std::memchr(byte, step_, static_cast<std::size_t>(end - byte)));
      if (!byte) break;
      nodes.push_back(static_cast<int>(byte - first));
    }
    return nodes;
  }

  std::size_t bytes() const { return steps_.capacity(); }

 private:
  std::vector<std::uint8_t> steps_;  ///< by node; 0 is never the number of a step
  std::uint8_t step_ = 1;            ///< number of the last step
};

/// Detects that FCL changed a tree without our update. FCL's mutators are not virtual: code that
/// holds a fcl::BVHModel& can refit or rebuild the nodes (FCL's own polynomial continuous collision
/// does). Every such path rewrites the root, so the root's numbers are compared with a copy.
///
/// `record` increases the root's radius to the next floating-point number, which is conservative. A
/// fit of the same positions, which yields the same other numbers, therefore never equals the
/// recorded root.
///
/// `matches` may run on many threads while one of them, having found a change, repairs the model
/// and records it. Therefore the numbers are written and read as atomics. The repair precedes the
/// recording, so a thread that sees the new root also sees the repaired tree.
template <typename BV>
class ChangeDetector {
 public:
  using S = typename BV::S;
  using V = Volume<BV>;

  /// Whether the root equals the one recorded last.
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

  /// Writes `volume`, with its radius increased to the next number, to the root and stores a copy.
  /// Returns that radius.
  S record(BV& root, BV volume) {
    V::raiseRadius(volume);
    for (BV* target : {&copy_, &root})
      for (int i = 0; i < V::kNumbers; ++i) store(V::number(*target, i), V::number(volume, i));
    store(recorded_, true);
    return V::radius(volume);
  }

  /// Makes `matches` return false until the next `record`.
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

  bool recorded_ = false;  ///< whether `copy_` holds a recorded root
  BV copy_;
};

/// A mutex that every object has for itself, also a copy.
struct OwnMutex : std::mutex {
  OwnMutex() = default;
  OwnMutex(const OwnMutex&) {}
};

/// The data stored beside FCL's tree of one model: its topology, the inflations that an update
/// works with, the statistics that queries recorded, and a detector of changes by others.
template <typename BV>
struct AdaptiveTree {
  using S = typename BV::S;

  /// The number of times that this data was reset: by builds and repairs.
  int resets = 0;
  Topology topology;
  /// By vertex: the position that the volumes enclose, of the last step. FCL's users may write into
  /// the model's `vertices` at any time, so a step's displacements count from these.
  std::vector<fcl::Vector3<S>> positions;
  Inflations<S> inflations;                ///< used with Propagation::TranslationCompensated
  mutable TraversalStatistics statistics;  ///< written by queries, which hold the model const
  RefitMarks refits;                       ///< refits of the last step
  ChangeDetector<BV> detector;
  OwnMutex repairing;  ///< locked while a thread repairs a changed tree, or validates it

  /// Resets to FCL's current tree and clears statistics; does not set inflations.
  void assign(const fcl::BVHModel<BV>& model);

  /// Recomputes the bound of all volumes' coordinates, so that it does not lose precision.
  void restartCoordinateSum(const fcl::BVHModel<BV>& model);

  std::size_t bytes() const {
    return topology.bytes() + positions.capacity() * sizeof(positions[0]) + inflations.bytes() +
           statistics.bytes() + refits.bytes();
  }
};

/// Whether the links of the tree are right and every volume contains its primitives. If not, sets
/// `reason` unless it is null. Uses nothing but FCL's own data.
template <typename BV>
bool checkTree(const fcl::BVHModel<BV>& model, std::string* reason);

/// The model that an update changes: FCL's part and the data beside it.
template <typename BV>
struct UpdateTarget {
  fcl::BVHModel<BV>& model;
  AdaptiveTree<BV>& tree;

  int nodes() const { return model.getNumBVs(); }  ///< the number of nodes
  BV& volume(int node) const { return model.getBV(node).bv; }
  BV fitted(int node) const;  ///< a volume fitted to the current positions of a node's triangles
  /// Undoes what FCL's users have written into the model's `vertices` since the last step.
  void restorePositions() const {
    std::copy(tree.positions.begin(), tree.positions.end(), model.vertices);
  }
};

/// The nodes in [first, last).
struct NodeRange {
  int first = 0, last = 0;
  bool contains(int node) const { return first <= node && node < last; }
};

/// The numbers of volumes that a propagation moved and inflated: see UpdateReport.
struct PropagationCounts {
  int moved = 0, inflated = 0;
  void operator+=(const PropagationCounts& other) {
    moved += other.moved;
    inflated += other.inflated;
  }
};

/// FCL's two kinds of position updates: replace*, and update*, which keeps the previous positions,
/// so that volumes enclose both frames.
enum class StepKind { Replace, TwoFrames };

/// The new positions of a step.
template <typename S>
struct StepInput {
  StepKind kind = StepKind::Replace;
  const fcl::Vector3<S>* positions = nullptr;  ///< must not lie in the model's own arrays
  std::size_t count = 0;
  const unsigned* indices = nullptr;  ///< vertex of each position; null: every vertex in order
  /// Whether FCL's calls found that the positions are those of the last step. Users may have
  /// written into the model's `vertices` between these calls.
  bool is_same = false;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV)       \
  extern template struct AdaptiveTree<BV>; \
  extern template struct UpdateTarget<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
