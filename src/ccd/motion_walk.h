#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "ccd/motion_supports.h"
#include "ccd/moving_boxes.h"
#include "query/neighbour_ranges.h"

namespace adaptive_bvh {

/// A part of the motion, as a share of the part for which boxes were made.
struct Share {
  float begin, end;
};

/// A body and its boxes in one part of the motion.
class BoxedBody {
 public:
  BoxedBody(const MovingBody& moving, MovingBoxes& memory) : body(moving), boxes_(memory) {}

  /// Makes the boxes, unless they are there.
  void prepare(double scale, double begin, double end) {
    if (scale == scale_ && begin == begin_ && end == end_) return;
    scale_ = -1;
    boxes_.assign(body, scale, begin, end);
    scale_ = scale, begin_ = begin, end_ = end;
  }
  MovingBoxes& boxes() const { return boxes_; }

  const MovingBody& body;

 private:
  MovingBoxes& boxes_;
  double scale_ = -1, begin_ = 0, end_ = 0;
};

/// By which a walk multiplies coordinates: a power of two that brings the first body's size to
/// about 1.
inline double walkScale(const MovingBody& first) {
  const double size = std::clamp(first.radius(), 1e-200, 1e200);
  return std::ldexp(1., -std::ilogb(size));
}

/// Compares boxes of two nodes, four of each, in a part of the motion.
class NodePairTest {
 public:
  /// Bodies with their boxes in a part of the motion.
  void begin(const BoxedBody& first, const BoxedBody& second, double scale, double begin,
             double end);
  /// Pairs that stay at least `limit` apart, in the unit of the world, need not be found.
  void setLimit(double limit);
  float keyLimit() const { return key_limit_; }

  /// Returns the pairs that may come nearer than the limit: bit 4 j + i for box i of `a` and j of
  /// `b`. Sets their keys: lower bounds of their squared distances, times the scale's square.
  unsigned near(const MovingNode& a, const MovingNode& b, const Share& share, Gaps4x4& keys);
  /// Whether the first boxes of two nodes move by far more than their sizes.
  bool isFast(const MovingNode& a, const MovingNode& b, const Share& share) const;
  /// The same as `near` for the boxes of a node and the plane of the second body: bit i for box i.
  unsigned nearPlane(const MovingNode& a, int count, const Share& share, Gaps4x4& keys) const;

 private:
  void setEnds(const MovingNode& a, const MovingNode& b, const Share& share);
  void beginPlane(const MovingBody& first, double begin, double end);
  double planeGap(const Boxes4 (&ends)[2], int lane, const Share& share) const;

  double scale_ = 1, arcs_ = 0;
  fcl::Vector3d offsets_[2];  ///< from the first to the second origin, scaled
  double sizes_ = 0;
  float key_limit_ = 0, gap_error_ = 0;
  double distance_ = 0;          ///< the limit, scaled, and arcs
  Boxes4 first_[2], second_[2];  ///< boxes at both ends of the share

  const MovingBody* plane_ = nullptr;
  fcl::Vector3d normals_[2], origins_[2];  ///< of the plane; of the first body's boxes
  double plane_offsets_[2] = {0, 0}, plane_arcs_ = 0;
};

/// Walks over pairs of nodes of two bodies, or of one mesh with itself, and parts of the motion:
/// nearest pairs first. A pair is divided in time where its boxes move by more than their sizes,
/// else in space. `Goal` has
///
///   limit()           pairs that stay at least so far apart are left out; it may decrease
///   direction()       a direction in which many pairs may be separated, or zero
///   admits(begin)     whether times from `begin` on matter
///   isDone()          whether the walk may end
///   leaf(i, j, begin, end)   visits two triangles or shapes; triangles by their leaf indices
class MotionWalk {
 public:
  struct Memory {
    struct Entry {
      int first, second;
      float key;
      Share share;
    };
    std::vector<Entry> open;
    MotionSupports supports;
  };

  /// For one mesh with itself, `first` and `second` are the same, and `left_out` are the pairs to
  /// leave out. Screws are divided into parts with arcs that are not longer than `longest_arc`, as
  /// far as that needs few parts.
  MotionWalk(BoxedBody& first, BoxedBody& second, const NeighbourRanges* left_out,
             double longest_arc, Memory& memory)
      : first_(first),
        second_(second),
        left_out_(left_out),
        longest_arc_(longest_arc),
        open_(memory.open),
        supports_(memory.supports) {}

  template <typename Goal>
  void run(Goal& goal) {
    const int parts = numParts();
    for (int part = 0; part < parts && !goal.isDone(); ++part) {
      begin_ = double(part) / parts;
      length_ = 1. / parts;
      if (goal.admits(begin_)) runPart(goal);
    }
  }
  std::size_t boxTests() const { return box_tests_; }

 private:
  using Entry = Memory::Entry;

  void setSupports(const fcl::Vector3d& direction);
  int numParts() const;
  double scale() const { return walkScale(first_.body); }
  bool isSelf() const { return &first_ == &second_; }

  template <typename Goal>
  void runPart(Goal& goal) {
    first_.prepare(scale(), begin_, begin_ + length_);
    if (!isSelf()) second_.prepare(scale(), begin_, begin_ + length_);
    test_.begin(first_, second_, scale(), begin_, begin_ + length_);
    open_.assign(1, {0, 0, 0, {0, 1}});
    supports_.clear();
    next_supports_ = box_tests_ + MotionSupports::cost(first_.body, second_.body);
    limit_ = -1;
    while (!open_.empty() && !goal.isDone()) {
      const Entry next = open_.back();
      open_.pop_back();
      if (goal.limit() != limit_) test_.setLimit(limit_ = goal.limit());
      if (box_tests_ >= next_supports_) setSupports(goal.direction());
      if (next.key > test_.keyLimit() || !goal.admits(timeOf(next.share.begin))) continue;
      visit(next, goal);
    }
  }
  double timeOf(float share) const {
    return share == 1 ? begin_ + length_ : begin_ + double(share) * length_;
  }

  template <typename Goal>
  void visit(const Entry& entry, Goal& goal) {
    ++box_tests_;
    const WideNode &a = first_.boxes().links()[entry.first],
                   &b = second_.boxes().links()[entry.second];
    const MovingNode& boxes1 = first_.boxes()[entry.first];
    Gaps4x4 keys;
    unsigned pairs;
    if (second_.body.flat()) {
      pairs = test_.nearPlane(boxes1, int(a.count), entry.share, keys);
    } else {
      const MovingNode& boxes2 = second_.boxes()[entry.second];
      pairs = test_.near(boxes1, boxes2, entry.share, keys) & lanesOf(a, b);
      if (pairs && supports_.isSet())
        pairs &= ~supports_.apart(entry.first, entry.second, double(entry.share.begin),
                                  double(entry.share.end), limit_);
      if (pairs && isSplitInTime(entry, boxes1, boxes2)) return;
    }
    if (isSelf()) pairs = withoutNeighbours(entry, pairs);
    if (a.isLeaf() && b.isLeaf())
      visitLeaves(entry, a, b, pairs, keys, goal);
    else
      push(entry, a, b, pairs, keys);
  }

  /// A bit for each pair of used boxes.
  static unsigned lanesOf(const WideNode& a, const WideNode& b) {
    const unsigned of_a = (1u << a.count) - 1;
    return (of_a * 0x1111) & ((1u << (4 * b.count)) - 1);
  }

  /// Visits pairs of triangles, the nearest ones first.
  template <typename Goal>
  void visitLeaves(const Entry& entry, const WideNode& a, const WideNode& b, unsigned pairs,
                   const Gaps4x4& keys, Goal& goal) {
    const double begin = timeOf(entry.share.begin), end = timeOf(entry.share.end);
    while (pairs && !goal.isDone()) {
      const int bit = nearestOf(pairs, keys);
      pairs &= ~(1u << bit);
      if (goal.limit() != limit_) test_.setLimit(limit_ = goal.limit());
      if (keys(bit & 3, bit >> 2) > test_.keyLimit()) return;
      goal.leaf(static_cast<unsigned>(a.first + (bit & 3)),
                static_cast<unsigned>(b.first + (bit >> 2)), begin, end);
    }
  }
  static int nearestOf(unsigned pairs, const Gaps4x4& keys);
  bool isSplitInTime(const Entry& entry, const MovingNode& a, const MovingNode& b);
  unsigned withoutNeighbours(const Entry& entry, unsigned pairs) const;
  void push(const Entry& entry, const WideNode& a, const WideNode& b, unsigned pairs,
            const Gaps4x4& keys);

  BoxedBody &first_, &second_;
  const NeighbourRanges* const left_out_;
  const double longest_arc_;
  std::vector<Entry>& open_;  ///< a stack
  MotionSupports& supports_;
  fcl::Vector3d direction_ = fcl::Vector3d::Zero();  ///< of the supports
  NodePairTest test_;
  double begin_ = 0, length_ = 1, limit_ = -1;
  std::size_t box_tests_ = 0, next_supports_ = 0;
};

}  // namespace adaptive_bvh
