#include "query/within/tracked_meshes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

/// The unit for the present size of the meshes.
MotionUnit unitOf(const KeptMeshes& meshes) {
  constexpr int kMost = 999;
  const KeptMeshes::Ball ball = meshes.enclosingBall();
  MotionUnit unit;
  unit.origin = ball.centre;
  if (ball.radius > 0)
    unit.scale = std::ldexp(1., -std::clamp(std::ilogb(ball.radius), -kMost, kMost) - 1);
  return unit;
}

}  // namespace

/// Brings positions and motion up to date. Returns false if the tracking must begin anew.
bool TrackedMeshes::follows(const KeptMeshes& meshes) {
  constexpr float kLargestDeformation = 1;  // in the unit, so that sums of two stay precise
  if (meshes.radii() > 2 * radii_) return false;
  if (!read(meshes)) {  // in the same unit, about another origin
    unit_.origin = unitOf(meshes).origin;
    for (int side = 0; side < meshes.sides(); ++side)
      if (!(*this)[side].convert(unit_)) return false;
  }
  return !(measure(meshes) > kLargestDeformation);
}

/// Begins anew, in a unit for the present size of the meshes.
void TrackedMeshes::restart(const KeptMeshes& meshes, double distance) {
  constexpr double kRounding = 0x1p-41;  // docs/bounds.md, 21
  unit_ = unitOf(meshes);
  radii_ = meshes.radii();
  rounding_ = kRounding * (radii_ + (std::isfinite(distance) ? distance : 0));
  for (TrackedTriangles& side : sides_) side.forgetMotion();
  read(meshes);
  measure(meshes);
}

/// Reads all positions. Returns false if some do not fit into the unit.
bool TrackedMeshes::read(const KeptMeshes& meshes) {
  bool fits = true;
  for (int side = 0; side < meshes.sides(); ++side)
    meshes.withMap(side, [&](const auto& map) {
      fits = (*this)[side].read(meshes.mesh(side), map, unit_) && fits;
    });
  return fits;
}

/// Returns the largest deformation.
float TrackedMeshes::measure(const KeptMeshes& meshes) {
  float deformation = 0;
  for (int side = 0; side < meshes.sides(); ++side)
    deformation = std::max(deformation, (*this)[side].measure());
  return deformation;
}

}  // namespace adaptive_bvh
