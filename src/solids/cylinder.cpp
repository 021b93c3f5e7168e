#include "solids/cylinder.h"

#include <cmath>

#include "solids/around_axis.h"
#include "solids/patches.h"

namespace adaptive_bvh {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

Vector CylinderSolid::support(const Vector& direction) const {
  return onCircle(direction, radius_, direction[2] < 0 ? -half_ : half_);
}

Penetration CylinderSolid::penetration(const Triangle& triangle) const {
  ShortestTranslation shortest(triangle, [this](const Vector& m) {
    return half_ * std::abs(m[2]) + radius_ * axisDistance(m);
  });
  shortest.tryBoth(Vector::UnitZ());
  shortest.tryFaceNormal();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& v = triangle[k];
    shortest.tryDirection({-v[0], -v[1], 0});  // past the corner, by the lateral surface
    RimAndEdge{radius_, half_}.tryDirections(v, triangle[(k + 1) % 3] - v, shortest);
  }
  shortest.tryDirection(Vector::UnitX());  // for a triangle on the axis
  return shortest.penetration();
}

ShapeSurface CylinderSolid::surface(const Vector& x) const {
  const AroundAxis around(x);
  const BoxSurface<Profile> found(around.profile(), Profile(radius_, half_));
  return {found.distance, around(found.nearest), around(found.outward)};
}

LineInterval CylinderSolid::lineInside(const Line& line) const {
  return fromNearest(line, [&](const Line& x) -> LineInterval {
    return lineInBall<Eigen::Vector2d>(x.origin.head<2>(), x.direction.head<2>(), radius_) &
           lineInSlab(x, 2, half_);
  });
}

void CylinderSolid::addPatches(std::vector<SurfacePatch>& to) const {
  const PatchList patches(to);
  patches.addDisk(radius_, -half_);
  patches.addTurned(radius_, -half_, radius_, half_);
  patches.addDisk(radius_, half_);
}

}  // namespace adaptive_bvh
