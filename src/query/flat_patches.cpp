#include "query/flat_patches.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/plane_contour.h"

namespace adaptive_bvh {

bool FlatPatches::contains(int node) const {
  const Patch& patch = contours_.patch(node);
  if (patch.length == 0) return false;
  const View view = viewOf(patch);
  const Shape shape = shapeOf(patch, view);
  const float least = kShare * shape.edge + kLeast;
  return shape.height >= least && contourKeepsApart(patch, view, least);
}

/// Along the sum of the normals, which the contour knows. Any directions will do, while neither is
/// longer than 1 by more than rounding.
auto FlatPatches::viewOf(const Patch& patch) const -> View {
  using float4::all;
  using float4::cross;
  using float4::dot;
  const unsigned* const slots = contours_.slots(patch);
  const Float4 *const positions = tree_.positions(), &origin = positions[slots[0]];
  Float4 normal = all(0), last = normal;
  for (std::uint32_t i = 1; i < patch.length; ++i) {
    const Float4 at = positions[slots[i]] - origin;
    normal += cross(last, at);
    last = at;
  }
  const auto unit = [](const Float4& v) -> Float4 { return v * all(1 / std::sqrt(dot(v, v))); };
  normal = unit(normal);
  const bool along_z = std::fabs(normal[2]) > 0.5f;
  const Float4 right = unit(cross(normal, along_z ? Float4{1, 0, 0, 0} : Float4{0, 0, 1, 0}));
  const Float4 up = unit(cross(normal, right));
  const auto four = [](const Float4& v) -> Vector4x3 { return {all(v[0]), all(v[1]), all(v[2])}; };
  return {four(right), four(up), four(cross(right, up))};
}

void FlatPatches::read(const std::array<std::uint32_t, 4>& triangles,
                       Vector4x3 (&corners)[3]) const {
  const Float4* const positions = tree_.positions();
  VertexIndices at[4];
  for (std::size_t k = 0; k < 4; ++k) at[k] = slots_.slotsOf(triangles[k]);
  for (std::size_t c = 0; c < 3; ++c)
    corners[c] = float4::columns(positions[at[0][c]], positions[at[1][c]], positions[at[2][c]],
                                 positions[at[3][c]]);
}

/// Four at a time, one of each quarter, so that a bend shows early.
auto FlatPatches::shapeOf(const Patch& patch, const View& view) const -> Shape {
  using vectors::cross;
  using vectors::difference;
  using vectors::dot;
  const std::uint32_t quarter = (patch.count + 3) / 4, last = patch.first + patch.count - 1;
  Float4 longest = float4::all(0), lowest = float4::all(std::numeric_limits<float>::max());
  for (std::uint32_t i = patch.first; i < patch.first + quarter; ++i) {
    Vector4x3 corners[3];
    read({i, std::min(i + quarter, last), std::min(i + 2 * quarter, last),
          std::min(i + 3 * quarter, last)},
         corners);
    const Vector4x3 a = difference(corners[1], corners[0]), b = difference(corners[2], corners[0]);
    const Vector4x3 c = difference(corners[2], corners[1]);
    const Float4 edge =
        float4::squareRoot(float4::upper(float4::upper(dot(a, a), dot(b, b)), dot(c, c)));
    longest = float4::upper(longest, edge);
    const Float4 area = dot(cross(a, b), view.ahead);  // twice
    if (float4::bits(area > float4::all(0)) != 15) return {0, -1};
    lowest = float4::lower<Float4>(lowest, area / edge);
  }
  return {packs::largest(longest), packs::smallest(lowest)};
}

bool FlatPatches::contourKeepsApart(const Patch& patch, const View& view, float distance) const {
  const unsigned* const slots = contours_.slots(patch);
  const Float4* const positions = tree_.positions();
  PlaneContour contour(patch.length);
  for (std::uint32_t i = 0; i < patch.length; i += 4) {
    const auto at = [&](std::uint32_t k) -> const Float4& {
      return positions[slots[std::min(i + k, patch.length - 1)]];
    };
    const Vector4x3 four = float4::columns(at(0), at(1), at(2), at(3));
    contour.setCorners(i, vectors::dot(four, view.right), vectors::dot(four, view.up));
  }
  return contour.keepsApart(distance);
}

}  // namespace adaptive_bvh
