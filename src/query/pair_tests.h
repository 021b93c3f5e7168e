#pragma once

#include "hierarchy/leaf_slots.h"
#include "triangles/triangle_pairs.h"

// Compiled once for every processor and once for processors with AVX2. Code compiled for AVX2 must
// not share a function with other sources, because the linker would then use it on all processors.
// So no standard library is used here, and everything below is a template of the pack, or always
// inlined.
namespace adaptive_bvh {

/// Two triangles, by their indices in the order of the leaves.
struct LeafIndexPair {
  unsigned first, second;
};

/// The corners of a tree's triangles, in its coordinates.
struct CornerSource {
  const LeafSlots* leaves;
  const Float4 *positions, *residuals;  ///< by slot
};

/// Corners of two trees with the same coordinates.
struct PairSource {
  CornerSource first, second;
};

/// What is certain about two triangles.
enum class PairVerdict : std::uint8_t { Unknown, Apart, Touching };

/// Loads the corners of as many triangles as a pack has numbers.
template <typename P>
struct Gather;

template <>
struct Gather<Float4> {
  static constexpr int kLanes = 4;

  ADAPTIVE_BVH_INLINE static Vectors<Float4> corners(const Float4* from, const unsigned (&at)[4]) {
    return float4::columns(from[at[0]], from[at[1]], from[at[2]], from[at[3]]);
  }
};

/// Tests of pairs of triangles, as many at once as a pack has numbers. The cheap tests come first
/// and leave few pairs. The results do not depend on the pack.
template <typename P>
class PackedPairTests {
 public:
  /// Keeps, in order, the pairs that are not certainly separated along the normal of either
  /// triangle. Returns their number. `pairs` needs room for one more pair at the end. `error`: of
  /// positions.
  static int keepByPlanes(const PairSource& from, LeafIndexPair* pairs, int size,
                          const PairError& error) {
    return keep(
        pairs, size, [&](const LeafIndexPair* group) __attribute__((always_inline)) {
          Vectors<P> p[3], q[3];
          gather(from, from.first.positions, from.second.positions, group, p, q);
          return PackedTrianglePairs<P>(p, q).apartByPlanes(error);
        });
  }
  /// Like keepByPlanes, but also tests directions in the planes of both triangles. `error`: of
  /// positions with residuals.
  static int keepByNormals(const PairSource& from, LeafIndexPair* pairs, int size,
                           const PairError& error) {
    return keep(
        pairs, size, [&](const LeafIndexPair* group) __attribute__((always_inline)) {
          const PackedTrianglePairs<P> triangles = precise(from, group);
          return triangles.apartByPlanes(error) | triangles.apartByEdgeNormals(error);
        });
  }
  /// Sets the verdict of each pair, by all axes that can separate two triangles.
  static void judge(const PairSource& from, const LeafIndexPair* pairs, int size,
                    const PairError& error, PairVerdict* verdicts) {
    for (int i = 0; i < size; i += kLanes) {
      LeafIndexPair group[kLanes];
      copyGroup(pairs, i, size, group);
      const PairVerdicts found = precise(from, group).verdicts(error);
      for (int k = 0; k < kLanes && i + k < size; ++k)
        verdicts[i + k] = found.apart >> k & 1      ? PairVerdict::Apart
                          : found.touching >> k & 1 ? PairVerdict::Touching
                                                    : PairVerdict::Unknown;
    }
  }

 private:
  static constexpr int kLanes = Gather<P>::kLanes;

  /// Copies a group of pairs. The last group repeats the last pair.
  ADAPTIVE_BVH_INLINE static void copyGroup(const LeafIndexPair* pairs, int first, int size,
                                            LeafIndexPair (&group)[kLanes]) {
    for (int k = 0; k < kLanes; ++k) group[k] = pairs[first + k < size ? first + k : size - 1];
  }

  template <typename AreApart>
  ADAPTIVE_BVH_INLINE static int keep(LeafIndexPair* pairs, int size, const AreApart& areApart) {
    int kept = 0;
    for (int i = 0; i < size; i += kLanes) {
      LeafIndexPair group[kLanes];
      copyGroup(pairs, i, size, group);
      const unsigned apart = areApart(group);
      for (int k = 0; k < kLanes; ++k) {
        pairs[kept] = group[k];
        kept += int(!(apart >> k & 1)) & int(i + k < size);
      }
    }
    return kept;
  }

  ADAPTIVE_BVH_INLINE static PackedTrianglePairs<P> precise(const PairSource& from,
                                                            const LeafIndexPair* group) {
    Vectors<P> p[3], q[3], p_residuals[3], q_residuals[3];
    gather(from, from.first.positions, from.second.positions, group, p, q);
    gather(from, from.first.residuals, from.second.residuals, group, p_residuals, q_residuals);
    return PackedTrianglePairs<P>(p, p_residuals, q, q_residuals);
  }

  ADAPTIVE_BVH_INLINE static void gather(const PairSource& from, const Float4* positions1,
                                         const Float4* positions2, const LeafIndexPair* group,
                                         Vectors<P> (&p)[3], Vectors<P> (&q)[3]) {
    for (int c = 0; c < 3; ++c) {
      unsigned at1[kLanes], at2[kLanes];
      for (int k = 0; k < kLanes; ++k) {
        at1[k] = from.first.leaves[group[k].first].slot(c);
        at2[k] = from.second.leaves[group[k].second].slot(c);
      }
      p[c] = Gather<P>::corners(positions1, at1);
      q[c] = Gather<P>::corners(positions2, at2);
    }
  }
};

/// The functions of PackedPairTests for one type of pack.
struct PairTestTable {
  int (*keepByPlanes)(const PairSource&, LeafIndexPair*, int, const PairError&);
  int (*keepByNormals)(const PairSource&, LeafIndexPair*, int, const PairError&);
  void (*judge)(const PairSource&, const LeafIndexPair*, int, const PairError&, PairVerdict*);
};
template <typename P>
constexpr PairTestTable kPairTestTable = {&PackedPairTests<P>::keepByPlanes,
                                          &PackedPairTests<P>::keepByNormals,
                                          &PackedPairTests<P>::judge};

/// Tests for every processor, four pairs at a time.
const PairTestTable& pairTests4();
/// Tests of eight pairs at a time; null if the library was built without AVX2 or the processor has
/// none.
const PairTestTable* pairTests8();
/// The widest tests that the processor supports.
const PairTestTable& pairTests();

}  // namespace adaptive_bvh
