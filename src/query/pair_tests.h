#pragma once

#include "hierarchy/leaf_slots.h"
#include "triangles/triangle_pairs.h"

// Tests of pairs of triangles in single precision, several pairs at once in SIMD registers
// ("packs"). Compiled once for every processor, with packs of four numbers, and once for processors
// with AVX2, with packs of eight. If both instances contained the same inline function, the linker
// could keep the AVX2 version and run it on any processor. So this file uses nothing of the
// standard library, and everything below is a template of the pack type or always inlined.
namespace adaptive_bvh {

/// Two triangles, one of each tree, by their indices in the order of its leaves.
struct LeafIndexPair {
  unsigned first, second;
};

/// The corners of a tree's triangles, in its coordinates: see WideTree.
struct CornerSource {
  const LeafSlots* leaves;              ///< by index in the order of the leaves: slots of corners
  const Float4 *positions, *residuals;  ///< by slot: rounded positions, and their rounding errors
};

/// The corners of two trees that have the same coordinates.
struct PairSource {
  CornerSource first, second;
};

/// What a test has proved about two triangles: farther apart than PairError::distance, or touching.
enum class PairVerdict : std::uint8_t { Unknown, Apart, Touching };

/// Loads kLanes points, as many as the pack P has numbers. Specialised for each pack:
/// corners(points, slots) returns the points at the given slots, as one pack for each coordinate.
template <typename P>
struct Gather;

template <>
struct Gather<Float4> {
  static constexpr int kLanes = 4;

  ADAPTIVE_BVH_INLINE static Vectors<Float4> corners(const Float4* points,
                                                     const unsigned (&slots)[4]) {
    return float4::columns(points[slots[0]], points[slots[1]], points[slots[2]], points[slots[3]]);
  }
};

/// Separating axis tests of pairs of triangles (triangle_pairs.h), as many at once as a pack has
/// numbers. Call the cheap tests first; they leave few pairs. Results do not depend on the pack.
template <typename P>
class PackedPairTests {
 public:
  /// Removes the pairs that are certainly separated along the normal of either triangle. Keeps the
  /// order of the others, and returns their number. `pairs` has `size` pairs, and needs room for
  /// one more. `error`: that of positions without residuals, which are not read.
  static int keepByPlanes(const PairSource& from, LeafIndexPair* pairs, int size,
                          const PairError& error) {
    return keep(
        pairs, size, [&](const LeafIndexPair* group) __attribute__((always_inline)) {
          Vectors<P> p[3], q[3];
          gather(from, from.first.positions, from.second.positions, group, p, q);
          return PackedTrianglePairs<P>(p, q).apartByPlanes(error);
        });
  }
  /// Like keepByPlanes, but also tests the directions in the plane of each triangle perpendicular
  /// to its edges. `error`: that of positions with residuals, which are added here.
  static int keepByNormals(const PairSource& from, LeafIndexPair* pairs, int size,
                           const PairError& error) {
    return keep(
        pairs, size, [&](const LeafIndexPair* group) __attribute__((always_inline)) {
          const PackedTrianglePairs<P> triangles = withResiduals(from, group);
          return triangles.apartByPlanes(error) | triangles.apartByEdgeNormals(error);
        });
  }
  /// Sets verdicts[i] to the verdict about pair i, by all axes that can separate two triangles.
  /// `error`: that of positions with residuals.
  static void judge(const PairSource& from, const LeafIndexPair* pairs, int size,
                    const PairError& error, PairVerdict* verdicts) {
    for (int i = 0; i < size; i += kLanes) {
      LeafIndexPair group[kLanes];
      copyGroup(pairs, i, size, group);
      const PairVerdicts found = withResiduals(from, group).verdicts(error);
      for (int k = 0; k < kLanes && i + k < size; ++k)
        verdicts[i + k] = found.apart >> k & 1      ? PairVerdict::Apart
                          : found.touching >> k & 1 ? PairVerdict::Touching
                                                    : PairVerdict::Unknown;
    }
  }

 private:
  static constexpr int kLanes = Gather<P>::kLanes;

  /// Copies the kLanes pairs from index `first` on. Beyond the end it repeats the last pair.
  ADAPTIVE_BVH_INLINE static void copyGroup(const LeafIndexPair* pairs, int first, int size,
                                            LeafIndexPair (&group)[kLanes]) {
    for (int k = 0; k < kLanes; ++k) group[k] = pairs[first + k < size ? first + k : size - 1];
  }

  /// Removes the pairs whose bit is set in areApart(group), for each group of kLanes pairs. Returns
  /// the number of the others. Without branches: the next pair overwrites a pair that is apart.
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

  /// Returns a group of pairs, from positions with residuals.
  ADAPTIVE_BVH_INLINE static PackedTrianglePairs<P> withResiduals(const PairSource& from,
                                                                  const LeafIndexPair* group) {
    Vectors<P> p[3], q[3], p_residuals[3], q_residuals[3];
    gather(from, from.first.positions, from.second.positions, group, p, q);
    gather(from, from.first.residuals, from.second.residuals, group, p_residuals, q_residuals);
    return PackedTrianglePairs<P>(p, p_residuals, q, q_residuals);
  }

  /// Sets p to the corners of the first triangles of a group, and q to those of the second ones.
  /// `positions1`, `positions2`: positions or residuals of both trees.
  ADAPTIVE_BVH_INLINE static void gather(const PairSource& from, const Float4* positions1,
                                         const Float4* positions2, const LeafIndexPair* group,
                                         Vectors<P> (&p)[3], Vectors<P> (&q)[3]) {
    for (int c = 0; c < 3; ++c) {
      unsigned slots1[kLanes], slots2[kLanes];
      for (int k = 0; k < kLanes; ++k) {
        slots1[k] = from.first.leaves[group[k].first].slot(c);
        slots2[k] = from.second.leaves[group[k].second].slot(c);
      }
      p[c] = Gather<P>::corners(positions1, slots1);
      q[c] = Gather<P>::corners(positions2, slots2);
    }
  }
};

/// Pointers to the functions of PackedPairTests for one pack type.
struct PairTestTable {
  int (*keepByPlanes)(const PairSource&, LeafIndexPair*, int, const PairError&);
  int (*keepByNormals)(const PairSource&, LeafIndexPair*, int, const PairError&);
  void (*judge)(const PairSource&, const LeafIndexPair*, int, const PairError&, PairVerdict*);
};
template <typename P>
constexpr PairTestTable kPairTestTable = {&PackedPairTests<P>::keepByPlanes,
                                          &PackedPairTests<P>::keepByNormals,
                                          &PackedPairTests<P>::judge};

/// Returns the tests of four pairs at a time, which run on every processor.
const PairTestTable& pairTests4();
/// Returns the tests of eight pairs at a time; null if the library or the processor has no AVX2.
const PairTestTable* pairTests8();
/// Returns the widest tests that the processor supports.
const PairTestTable& pairTests();

}  // namespace adaptive_bvh
