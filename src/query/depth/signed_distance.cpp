// Signed distance of two closed meshes: the distance, or the larger depth by DepthSearch.
#include "query/depth/signed_distance.h"

#include "base/rounding.h"
#include "query/closed_surface.h"
#include "query/depth/depth_meshes.h"
#include "query/nearest/nearest_search.h"

namespace adaptive_bvh {
namespace {

/// Returns depth bounds by one point of the first component of `mesh` that is inside `other`, if
/// the point is deeper than `least`. The surfaces must not touch.
DepthBounds componentInside(const PlacedMesh& mesh, const PlacedMesh& other, double least) {
  DepthBounds found = DepthBounds::from(least);
  visitContained(mesh, other, [&](int, const fcl::Vector3d& x, MeshTarget& target) {
    found = depthAt(x, target, least);
    return false;
  });
  return found;
}

/// Returns bounds of the depth of `mesh` in `other`. `known`: see DepthSearch.
DepthBounds depthOf(const PlacedMesh& mesh, const PlacedMesh& other, double tolerance,
                    const DepthBounds& known) {
  MeshSource source(mesh, RelativePlacement(other.tf, mesh.tf));
  MeshTarget target(other);
  return DepthSearch<MeshSource, MeshTarget>(source, target, tolerance, known).run();
}

/// Upper bound of the distance of the mesh's points to the origin of its frame.
double sizeOf(const PlacedMesh& mesh) {
  return mesh.bounds().aabb_center.stableNorm() + mesh.bounds().aabb_radius;
}

/// Returns the gap of the nearest triangles and sets the second surface's outward normal there,
/// both in the frame of the first mesh.
TriangleGap nearestOf(const PairOfMeshes& meshes, fcl::Vector3d& outward) {
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
  NearestPair nearest(meshes.first, meshes.second, {request, result});
  NearestSearch(meshes.first, meshes.second, nearest).run();
  const auto triangle = [](auto number) { return static_cast<unsigned>(number); };
  const TriangleGap gap = meshes.gap({triangle(result.b1), triangle(result.b2)});
  const SurfaceNormals normals(meshes.second.mesh);
  const RelativePlacement to_second(meshes.second.tf, meshes.first.tf);
  outward = meshes.to_first.R *
            normals.at(normals.nearestPlace(to_second(gap.points.second), triangle(result.b2)));
  return gap;
}

/// Returns a copy whose positions are multiplied by `unit`.
DeformableMesh enlarged(const DeformableMesh& mesh, double unit) {
  std::vector<fcl::Vector3d> positions = mesh.vertices();
  for (fcl::Vector3d& x : positions) x *= unit;
  DeformableMesh large(mesh);
  large.update(positions);
  return large;
}

/// Signed distance of bodies so small that squares of their lengths underflow: computed from
/// enlarged bodies, in the frame of the first.
SignedDistance signedDistanceOfSmall(const DeformableMesh& first, const fcl::Transform3d& tf,
                                     const DeformableMesh& second,
                                     const RelativePlacement& to_first, double tolerance,
                                     double unit) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  fcl::Transform3d placed = fcl::Transform3d::Identity();
  placed.linear() = to_first.R;
  placed.translation() = to_first.T * unit;
  SignedDistance found = signedDistance(enlarged(first, unit), fcl::Transform3d::Identity(),
                                        enlarged(second, unit), placed, tolerance * unit);
  for (fcl::Vector3d& x : found.points) x = tf * fcl::Vector3d(x / unit);
  found.normal = tf.linear() * found.normal;
  const auto reduced = [&](double bound, double direction) -> double {  // rounds toward `direction`
    const double rounded = bound / unit;
    return rounded * unit == bound ? rounded : std::nextafter(rounded, direction);
  };
  found.lower = reduced(found.lower, -kInfinity);
  found.upper = found.upper == 0 ? 0. : reduced(found.upper, kInfinity);
  return found;
}

/// Signed distance of meshes whose squared lengths do not underflow.
SignedDistance signedDistanceOf(const PairOfMeshes& meshes, double size, double tolerance) {
  const PlacedMesh &one = meshes.first, &two = meshes.second;
  const DepthPrecision precision(one.tf, two.tf, size, tolerance);
  const SignedDistanceResult result(one.tf, two.tf, precision);
  fcl::Vector3d outward;
  const TriangleGap gap = nearestOf(meshes, outward);
  // Bounds of the depth of the first mesh in the second, and of the second in the first. Depths
  // within the rounding error do not count.
  DepthBounds in_second = DepthBounds::from(precision.error()), in_first = in_second;
  if (gap.distance > 0) {
    in_second = componentInside(one, two, precision.error());
    in_first = componentInside(two, one, in_second.lower);
    if (!in_second.is_found && !in_first.is_found) return result.apart(gap, true, outward);
  }
  in_second = depthOf(one, two, precision.tolerance(), in_second);
  if (!(in_first.lower > in_second.lower)) in_first = DepthBounds::from(in_second.lower);
  in_first = depthOf(two, one, precision.tolerance(), in_first);
  SignedDistance found =
      in_second.is_found || in_first.is_found
          ? result.inside(in_second, in_first)
          : result.touching(gap, true, outward, std::max(in_second.upper, in_first.upper));
  found.searches = in_second.searches + in_first.searches;
  return found;
}

}  // namespace

SignedDistance signedDistance(const DeformableMesh& first, const fcl::Transform3d& tf1,
                              const DeformableMesh& second, const fcl::Transform3d& tf2,
                              double tolerance) {
  requireTolerance(tolerance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireClosed(stateOf(first), "signedDistance");
  requireClosed(stateOf(second), "signedDistance");
  const PairOfMeshes meshes(first, tf1, second, tf2);
  const double size = sizeOf(meshes.first) + sizeOf(meshes.second) + meshes.to_first.T.stableNorm();
  const double unit = rounding::enlargement(size);
  return unit == 1 ? signedDistanceOf(meshes, size, tolerance)
                   : signedDistanceOfSmall(first, tf1, second, meshes.to_first, tolerance, unit);
}

}  // namespace adaptive_bvh
