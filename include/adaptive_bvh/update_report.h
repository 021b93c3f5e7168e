#pragma once

namespace adaptive_bvh {

/// Report of an update of a model: counts and durations.
struct UpdateReport {
  int nodes = 0;  ///< bounding volumes in the tree
  /// Volumes that moved along with their triangles. With Propagation::Displacements none does, nor
  /// with FitnessCriterion::RefitAll, which refits them in the same step.
  int moved = 0;
  /// Volumes whose radius the propagation changed, by more than the rounding of positions.
  int inflated = 0;
  int refitted_leaves = 0;       ///< leaf volumes recomputed from their triangle
  int refitted_inner = 0;        ///< inner volumes recomputed from the triangles below them
  long refitted_primitives = 0;  ///< triangles those refits read, summed: the work of the refits

  /// The largest motion of a vertex since the step before, in the units of the mesh.
  double largest_displacement = 0;

  /// Whether the whole tree was refitted and all tracking was reset: after a build, after a step
  /// too large to be followed, and after a change through a fcl::BVHModel reference.
  bool resynchronised = false;

  double displacement_seconds = 0;  ///< reading positions, measuring displacements, local AABB
  double propagation_seconds = 0;   ///< inflating the volumes, leaf to root
  double refit_seconds = 0;         ///< fitness tests and refits

  /// Volumes that the propagation wrote; its cost is proportional to them.
  int propagated() const { return moved > inflated ? moved : inflated; }
  /// Volumes that were recomputed.
  int refitted() const { return refitted_leaves + refitted_inner; }
  /// Duration of all three phases.
  double seconds() const { return displacement_seconds + propagation_seconds + refit_seconds; }
};

/// Work of the recording queries (query.h) of a model since its last update. A query of two
/// adaptive models counts for both.
struct QueryWork {
  int queries = 0;      ///< queries that recorded
  long box_tests = 0;   ///< pairs of a box and a shape or cell
  long bv_tests = 0;    ///< pairs of FCL's volumes, or of one and a shape or cell, by FCL's test
  long leaf_tests = 0;  ///< pairs of triangles, or of a triangle and a shape or cell
};

}  // namespace adaptive_bvh
