#include "solids/box.h"

#include <algorithm>
#include <limits>

#include "solids/around_axis.h"
#include "solids/patches.h"

namespace adaptive_bvh {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

/// If a triangle is apart from a box, the nearest points are on a face of the box beyond whose
/// plane the triangle has a corner. If it crosses the box without a corner inside, it crosses such
/// a face. So only these faces are considered.
TriangleGap BoxSolid::gap(const Triangle& triangle) const {
  for (const Vector& x : triangle)
    if ((x.cwiseAbs().array() <= half_.array()).all()) return {{x, x}, 0};
  TriangleGap nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1., 1.}) {
      const double beyond =
          std::max({side * triangle[0][k], side * triangle[1][k], side * triangle[2][k]});
      if (beyond < half_[k]) continue;
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const auto corner = [&](double u, double v) -> Vector {
        Vector x;
        x[k] = side * half_[k];
        x[i] = u * half_[i];
        x[j] = v * half_[j];
        return x;
      };
      for (const double w : {-1., 1.}) {  // the two triangles of the face
        const TriangleGap gap = gapOf(triangle, {corner(-1, -1), corner(1, 1), corner(w, -w)});
        if (gap.distance < nearest.distance) nearest = gap;
        if (nearest.distance <= 0) return nearest;
      }
    }
  return nearest;
}

Penetration BoxSolid::penetration(const Triangle& triangle) const {
  ShortestTranslation shortest(triangle, [&](const Vector& m) { return half_.dot(m.cwiseAbs()); });
  for (int k = 0; k < 3; ++k) shortest.tryBoth(Vector::Unit(k));
  shortest.tryFaceNormal();
  for (const Vector& edge : edgesOf(triangle))
    for (int k = 0; k < 3; ++k) shortest.tryBoth(acrossEdges(edge, Vector::Unit(k)));
  return shortest.penetration();
}

ShapeSurface BoxSolid::surface(const Vector& x) const {
  const BoxSurface<Vector> found(x, half_);
  return {found.distance, found.nearest, found.outward};
}

LineInterval BoxSolid::lineInside(const Line& line) const {
  return lineInSlab(line, 0, half_[0]) & lineInSlab(line, 1, half_[1]) &
         lineInSlab(line, 2, half_[2]);
}

void BoxSolid::addPatches(std::vector<SurfacePatch>& patches) const {
  PatchList(patches).addBox(half_);
}

}  // namespace adaptive_bvh
