#include "query/signed_distance.h"

#include "query/closed_surface.h"
#include "query/depth_meshes.h"
#include "query/nearest_search.h"

namespace adaptive_bvh {
namespace {

/// A point of the first component of a mesh that is inside of another one, whose surface it does
/// not touch.
template <typename S>
DepthBounds componentInside(const PlacedMesh<S>& mesh, const PlacedMesh<S>& other, double least) {
  DepthBounds found = DepthBounds::from(least);
  visitContained(mesh, other, [&](int, const fcl::Vector3d& x, MeshTarget<S>& target) {
    found = depthAt(x, target, least);
    return false;
  });
  return found;
}

template <typename S>
DepthBounds depthOf(const PlacedMesh<S>& mesh, const PlacedMesh<S>& other, double tolerance,
                    const DepthBounds& known) {
  MeshSource<S> source(mesh, RelativePlacement(other.tf, mesh.tf));
  MeshTarget<S> target(other);
  return DepthSearch<MeshSource<S>, MeshTarget<S>>(source, target, tolerance, known).run();
}

template <typename S>
double sizeOf(const PlacedMesh<S>& mesh) {
  return double(mesh.geometry->aabb_center.norm()) + double(mesh.geometry->aabb_radius);
}

/// The nearest triangles, and the outward direction of the second there.
template <typename S>
TriangleGap nearestOf(const PairOfMeshes<S>& meshes, fcl::Vector3d& outward) {
  const fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result;
  NearestPair<S> nearest(meshes.first, meshes.second, {request, result});
  NearestSearch<S>(meshes.first, meshes.second, nearest).run();
  const auto triangle = [](auto number) { return static_cast<unsigned>(number); };
  const TriangleGap gap = meshes.gap({triangle(result.b1), triangle(result.b2)});
  const SurfaceNormals<S> normals(meshes.second.mesh);
  const RelativePlacement to_second(meshes.second.tf, meshes.first.tf);
  outward = meshes.to_first.R *
            normals.at(normals.nearestPlace(to_second(gap.points.second), triangle(result.b2)));
  return gap;
}

}  // namespace

template <typename S>
SignedDistance<S> signedDistance(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                                 const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                                 S tolerance) {
  requireTolerance(tolerance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireClosed(stateOf(first), "signedDistance");
  requireClosed(stateOf(second), "signedDistance");
  const PairOfMeshes<S> meshes(first, tf1, second, tf2);
  const PlacedMesh<S>&one = meshes.first, &two = meshes.second;
  const DepthPrecision precision(tf1, tf2, sizeOf(one) + sizeOf(two) + meshes.to_first.T.norm(),
                                 tolerance);
  const SignedDistanceResult<S> result(tf1, tf2, precision);
  fcl::Vector3d outward;
  const TriangleGap gap = nearestOf(meshes, outward);
  DepthBounds in_second = DepthBounds::from(precision.error()), in_first = in_second;
  if (gap.distance > 0) {
    in_second = componentInside(one, two, precision.error());
    in_first = componentInside(two, one, in_second.lower);
    if (!in_second.is_found && !in_first.is_found) return result.apart(gap, true, outward);
  }
  in_second = depthOf(one, two, precision.tolerance(), in_second);
  if (!(in_first.lower > in_second.lower)) in_first = DepthBounds::from(in_second.lower);
  in_first = depthOf(two, one, precision.tolerance(), in_first);
  SignedDistance<S> found =
      in_second.is_found || in_first.is_found
          ? result.inside(in_second, in_first)
          : result.touching(gap, true, outward, std::max(in_second.upper, in_first.upper));
  found.searches = in_second.searches + in_first.searches;
  return found;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template SignedDistance<S> signedDistance(const DeformableMesh<S>&, const fcl::Transform3<S>&, \
                                            const DeformableMesh<S>&, const fcl::Transform3<S>&, \
                                            S);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
