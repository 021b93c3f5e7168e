#pragma once

#include <cstring>

#include "adaptive_bvh/self_collision.h"
#include "geometry/triangle_rejection.h"
#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// Tests pairs of triangles whose boxes overlap: collects some hundred, leaves out neighbours, then
/// those that surely are apart, four at a time, and hands the rest to the exact test.
///
///   frame(points)             points of the second tree in the coordinates of the first
///   exact(leaf1, leaf2)       FCL's test, of two of FCL's leaves
///   isDone()                  whether there are contacts enough
template <typename S, typename Frame, typename Exact>
class CandidateTests {
 public:
  /// One mesh of a query.
  struct Side {
    const WideTree<S>& tree;
    const VertexSlots& slots;
  };

  CandidateTests(const Side& first, const Side& second, const Frame& frame,
                 const RejectionError& error, NeighbourFilter filter, Exact& exact)
      : first_(first),
        second_(second),
        frame_(frame),
        error_(error),
        filter_(filter),
        exact_(exact) {}

  ADAPTIVE_BVH_INLINE void found(unsigned triangle1, unsigned triangle2) {
    pairs_[size_++] = {triangle1, triangle2};
    if (size_ == kSize) testAll();
  }
  bool isDone() const { return exact_.isDone(); }
  /// What was found and not yet tested.
  void finish() { testAll(); }

  long candidates() const { return candidates_; }
  long exactTests() const { return exact_tests_; }

 private:
  static constexpr int kSize = 256;
  struct Pair {
    unsigned first, second;
  };
  using Int4 = std::int32_t __attribute__((vector_size(16)));

  /// Corners of four triangles, and their vertices.
  struct Corners4 {
    Triangles4 triangles;
    Int4 vertices[3];
  };

  void testAll() {
    pad();
    const int left = keep([](const TriangleRejection& test) { return test.byPlanes(); }, true);
    candidates_ += size_;
    size_ = left;
    pad();
    size_ = keep([](const TriangleRejection& test) { return test.byEdgeNormals(); }, false);
    pad();
    size_ = keep([](const TriangleRejection& test) { return test.byEdges(); }, false);
    for (int i = 0; i < size_ && !exact_.isDone(); ++i) {
      ++exact_tests_;
      exact_(first_.tree.leaf(pairs_[i].first), second_.tree.leaf(pairs_[i].second));
    }
    size_ = 0;
  }

  /// Lets groups of four be whole: the pairs added count for nothing.
  void pad() {
    for (int i = size_; i % 4; ++i) pairs_[i] = pairs_[size_ - 1];
  }

  /// Keeps the pairs that `rejected` does not name, in order; returns how many.
  template <typename Rejected>
  ADAPTIVE_BVH_INLINE int keep(const Rejected& rejected, bool leave_out_neighbours) {
    int kept = 0;
    for (int i = 0; i < size_; i += 4) {
      unsigned first[4], second[4];
      for (int k = 0; k < 4; ++k) {
        first[k] = pairs_[i + k].first;
        second[k] = pairs_[i + k].second;
      }
      const Corners4 p = gather(first_, first);
      Corners4 q = gather(second_, second);
      for (Vector4x3& corner : q.triangles.corners) corner = frame_(corner);
      const TriangleRejection test(p.triangles, q.triangles, error_);
      unsigned out = rejected(test);
      if (leave_out_neighbours) out |= neighbours(p, q);
      for (int k = 0; k < 4 && i + k < size_; ++k) {
        pairs_[kept] = {first[k], second[k]};
        kept += ~out >> k & 1;
      }
    }
    return kept;
  }

  ADAPTIVE_BVH_INLINE static Corners4 gather(const Side& side, const unsigned (&triangles)[4]) {
    VertexIndices slots[4];
    for (int k = 0; k < 4; ++k) slots[k] = side.slots.slotsOf(triangles[k]);
    const Float4* const positions = side.tree.positions();
    Corners4 corners;
    for (std::size_t c = 0; c < 3; ++c) {
      const float4::Rows rows =
          float4::transposed(positions[slots[0][c]], positions[slots[1][c]],
                             positions[slots[2][c]], positions[slots[3][c]]);
      corners.triangles.corners[c] = {rows.x, rows.y, rows.z};
      std::memcpy(&corners.vertices[c], &rows.w, sizeof(rows.w));
    }
    return corners;
  }

  ADAPTIVE_BVH_INLINE unsigned neighbours(const Corners4& p, const Corners4& q) const {
    if (filter_ == NeighbourFilter::None) return 0;
    Int4 shared = {0, 0, 0, 0};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) shared -= p.vertices[i] == q.vertices[j];
    const int least = filter_ == NeighbourFilter::SharedEdge ? 2 : 1;
    return float4::bits(shared >= Int4{least, least, least, least});
  }

  const Side first_, second_;
  const Frame& frame_;
  const RejectionError error_;
  const NeighbourFilter filter_;
  Exact& exact_;
  Pair pairs_[kSize + 3];
  int size_ = 0;
  long candidates_ = 0, exact_tests_ = 0;
};

}  // namespace adaptive_bvh
