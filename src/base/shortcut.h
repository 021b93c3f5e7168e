#pragma once

namespace adaptive_bvh {

/// Parts of the library that save time and do not change answers. A build with the CMake option
/// ADAPTIVE_BVH_SHORTCUT_TESTS can do without each, so that a test can compare the answers.
enum class Shortcut {
  Supports,           ///< bounds along a line between two bodies
  FlatPatches,        ///< parts of a surface that cannot meet themselves
  SinglePrecision,    ///< tests of triangles in single precision, before those in double
  Avx2,               ///< eight triangles at once instead of four
  Coherence,          ///< what a query remembers of its last call
  Alignment,          ///< a second tree with the coordinates of the first
  Threads,            ///< more than one
  RoundedPredicates,  ///< signs of rounded determinants, where an error bound permits
  kCount
};

/// Decisions that use exact arithmetic where rounded arithmetic leaves them open.
enum class ExactDecision {
  Orientation,
  TriangleSides,
  PlanarOrientation,
  RayTriangle,
  CrossingParameter,
  BoundaryAngle,
  kCount
};

#ifdef ADAPTIVE_BVH_SHORTCUT_TESTS

/// Whether a shortcut is taken. At first all are, except the one that the environment variable
/// ADAPTIVE_BVH_WITHOUT names, for example SinglePrecision.
bool isTaken(Shortcut shortcut);
void take(Shortcut shortcut, bool is_taken);
const char* nameOf(Shortcut shortcut);

/// Counts a decision by exact arithmetic.
void countExact(ExactDecision decision);
long exactDecisions(ExactDecision decision);
const char* nameOf(ExactDecision decision);

#else

constexpr bool isTaken(Shortcut) { return true; }
constexpr void countExact(ExactDecision) {}

#endif

}  // namespace adaptive_bvh
