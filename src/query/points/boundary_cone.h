#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/leased.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// Returns half the solid angle, seen from x, of the triangle between the edge from a to b and a
/// point at infinity along the third of the orthonormal `axes`; 0 if x is on the edge. The error is
/// below 2^-44 if no end is within 2^-10 of the opposite direction.
double halfSolidAngle(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& x,
                      const fcl::Matrix3d& axes);

/// The cone that closes an open mesh, as a point sees it: a cone over the mesh's boundary, with its
/// apex at infinity.
///
/// A ray from the point in the direction opposite to the apex does not meet the cone. So the ray's
/// crossings with the mesh give the winding number of mesh and cone together, and the mesh's own
/// number is that minus the solid angle of the cone (the antipodal method).
class BoundaryCone {
 public:
  /// Copies the boundary's vertices, in their present positions.
  explicit BoundaryCone(const MeshState& mesh);

  /// Adds the winding number of the cone, turned inside out, to `number`. `ray`: direction of the
  /// ray. Takes time in proportion to the boundary. The error is at most 2^-52 for each edge.
  /// Returns false if a vertex is within 2^-10 of the ray's direction; after many `tries` that
  /// limit is smaller.
  bool addTo(double& number, const fcl::Vector3d& x, const fcl::Vector3d& ray, int tries) const;

 private:
  struct Memory {
    std::array<std::vector<double>, 3> coordinates;
    std::vector<double> weights;

    void push(const fcl::Vector3d& vertex, double weight);
  };

  const double scale_;
  std::size_t num_edges_ = 0;
  const Leased<Memory> memory_;
};

}  // namespace adaptive_bvh
