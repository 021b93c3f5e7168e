#include "query/signed_distance.h"

#include "base/rounding.h"
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
  return double(mesh.geometry->aabb_center.stableNorm()) + double(mesh.geometry->aabb_radius);
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

/// A copy `unit` times as large.
template <typename S>
DeformableMesh<S> enlarged(const DeformableMesh<S>& mesh, S unit) {
  std::vector<fcl::Vector3<S>> positions = mesh.vertices();
  for (fcl::Vector3<S>& x : positions) x *= unit;
  DeformableMesh<S> large(mesh);
  large.update(positions);
  return large;
}

/// That of bodies so small that squares of their lengths underflow: by larger ones, in the frame of
/// the first.
template <typename S>
SignedDistance<S> signedDistanceOfSmall(const DeformableMesh<S>& first,
                                        const fcl::Transform3<S>& tf,
                                        const DeformableMesh<S>& second,
                                        const RelativePlacement& to_first, S tolerance, S unit) {
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  fcl::Transform3<S> placed = fcl::Transform3<S>::Identity();
  placed.linear() = to_first.R.template cast<S>();
  placed.translation() = to_first.T.template cast<S>() * unit;
  SignedDistance<S> found =
      signedDistance(enlarged(first, unit), fcl::Transform3<S>(fcl::Transform3<S>::Identity()),
                     enlarged(second, unit), placed, tolerance * unit);
  for (fcl::Vector3<S>& x : found.points) x = tf * fcl::Vector3<S>(x / unit);
  found.normal = tf.linear() * found.normal;
  const auto reduced = [&](S length, S outward) -> S {
    const S rounded = length / unit;
    return rounded * unit == length ? rounded : std::nextafter(rounded, outward);
  };
  found.lower = reduced(found.lower, -kInfinity);
  found.upper = found.upper == 0 ? S(0) : reduced(found.upper, kInfinity);
  return found;
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
  const double size = sizeOf(one) + sizeOf(two) + meshes.to_first.T.stableNorm();
  if (const double unit = rounding::enlargement(size); unit != 1)
    return signedDistanceOfSmall(first, tf1, second, meshes.to_first, tolerance,
                                 static_cast<S>(unit));
  const DepthPrecision precision(tf1, tf2, size, tolerance);
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
