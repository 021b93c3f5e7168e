#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/leased.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// Returns half the solid angle, seen from x, of the triangle between the edge from a to b and the
/// apex, a point at infinity along the third of the orthonormal `axes`; positive if x sees a, b and
/// the apex counter-clockwise; 0 if x is on the edge. The error is below 2^-44 if x sees neither
/// end within an angle of 2^-10 of the direction opposite to the apex. For the few edges that x
/// sees under a wide angle; BoundaryKernel sums the others.
double halfSolidAngle(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& x,
                      const fcl::Matrix3d& axes);

/// The cone that closes an open mesh, as a point sees it: a cone over the mesh's boundary, with its
/// apex at infinity.
///
/// A ray from the point in the direction opposite to the apex does not meet the cone. So the ray's
/// crossings with the mesh give the winding number of mesh and cone together, and the mesh's own
/// number is that minus the winding number of the cone (the antipodal method).
class BoundaryCone {
 public:
  /// Copies the boundary's vertices, in their present positions.
  explicit BoundaryCone(const MeshState& mesh);

  /// Adds the winding number of the cone, turned inside out, at x to `winding`. `ray`: direction in
  /// which crossings with the mesh were counted; the apex is opposite. The error is at most 2^-52
  /// for each boundary edge, and 2^-44 for one that x sees under a wide angle. Returns false, and
  /// adds nothing, if x sees a boundary vertex within an angle of 2^-10 of the ray, or if the ray
  /// meets a boundary edge or nearly does: also one of a triangle in whose plane it lies. After 16
  /// `tries` (rays tried before) the angle is smaller, and errors grow as it shrinks.
  bool addTo(double& winding, const fcl::Vector3d& x, const fcl::Vector3d& ray, int tries) const;

 private:
  /// The boundary's curves, one after the other, as BoundaryArrays (boundary_kernel.h).
  struct Memory {
    std::array<std::vector<double>, 3> coordinates;  ///< of vertices, multiplied by scale_
    std::vector<double> weights;                     ///< 1, or 0 for a vertex that separates curves

    void push(const fcl::Vector3d& vertex, double weight);
  };

  const double scale_;  ///< brings the mesh's size to about 1
  /// Number of edges in the arrays: with those of separators, and padded to a multiple of
  /// BoundaryKernel::kStep.
  std::size_t num_edges_ = 0;
  const Leased<Memory> memory_;
};

}  // namespace adaptive_bvh
