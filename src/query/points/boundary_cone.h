#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/leased.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// Half the solid angle, as a point sees it, of the triangle between an edge from a to b and a
/// distant point in the direction of the third of orthonormal axes; 0 where the point is on the
/// edge. Off by less than 2^-44 where no end is within 2^-10 of the opposite direction.
double halfSolidAngle(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& x,
                      const fcl::Matrix3d& axes);

/// What a mesh that is not closed lacks to be a closed surface, as a point sees it: a cone over its
/// boundary, with the apex infinitely far away.
///
/// Where a ray leaves the point in the opposite direction of the apex, it does not meet the cone.
/// So the crossings of that ray with the mesh are the winding number of mesh and cone together, and
/// that of the mesh is less by the solid angle of the cone (the antipodal method).
class BoundaryCone {
 public:
  /// Copies the boundary's vertices, in their present positions.
  explicit BoundaryCone(const MeshState& mesh);

  /// Adds the winding number of the cone, turned inside out, to `number`; the ray goes along
  /// `ray`. Takes time in proportion to the boundary. Off by at most 2^-52 for each edge. False
  /// where a vertex is within 2^-10 of the ray's direction, or after many `tries`, nearer to it.
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
