#pragma once

namespace adaptive_bvh {

/// What the last update of a model did, and how long it took.
struct UpdateReport {
  int nodes = 0;                 ///< bounding volumes in the tree
  int inflated = 0;              ///< volumes whose radius the error propagation changed
  int refitted_leaves = 0;       ///< leaf volumes recomputed from their triangle
  int refitted_inner = 0;        ///< inner volumes recomputed from the triangles below them
  long refitted_primitives = 0;  ///< triangles those refits read, summed: the work of the refits

  /// The largest motion of a vertex since the frame before, in the units of the mesh.
  double largest_displacement = 0;

  /// True when the whole tree was refitted and tracking began anew: after a build, and when the
  /// model was found changed behind our back through a fcl::BVHModel reference.
  bool resynchronised = false;

  double displacement_seconds = 0;  ///< reading positions, measuring displacements, local AABB
  double propagation_seconds = 0;   ///< inflating the volumes, leaf to root
  double refit_seconds = 0;         ///< fitness tests and refits

  /// All volumes that were recomputed.
  int refitted() const { return refitted_leaves + refitted_inner; }
  /// Of all three phases.
  double seconds() const { return displacement_seconds + propagation_seconds + refit_seconds; }
};

/// What recording queries (query.h) did on a model since its last update. A query between two
/// adaptive models counts on both.
struct QueryWork {
  int queries = 0;      ///< that recorded
  long bv_tests = 0;    ///< pairs of volumes or boxes, or of a volume and a shape, that were tested
  long leaf_tests = 0;  ///< pairs of triangles, or of a triangle and a shape
};

}  // namespace adaptive_bvh
