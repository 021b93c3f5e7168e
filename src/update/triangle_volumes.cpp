#include "update/triangle_volumes.h"

#include "geometry/vectors.h"

namespace adaptive_bvh {
namespace {

using float4::Columns;
using vectors::cross;
using vectors::difference;
using vectors::dot;

ADAPTIVE_BVH_INLINE Columns times(const Columns& v, const Float4& by) {
  return {v.x * by, v.y * by, v.z * by};
}
template <typename Mask>
ADAPTIVE_BVH_INLINE Columns select(const Mask& mask, const Columns& a, const Columns& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

/// Four rows again.
ADAPTIVE_BVH_INLINE void scatter(const Columns& v, Float4 (&rows)[kLanes]) {
  const Float4 none = float4::all(0);
  const Columns low = float4::columns(v.x, v.y, v.z, none);  // lanes 0, 1 and 2
  rows[0] = low.x;
  rows[1] = low.y;
  rows[2] = low.z;
  rows[3] = Float4{v.x[3], v.y[3], v.z[3], 0};
}

/// As axesAlong, of four pairs.
struct AxesOfFour {
  ADAPTIVE_BVH_INLINE AxesOfFour(const Columns& a, const Columns& b) {
    const Float4 one = float4::all(1), none = float4::all(0);
    const Columns normal = cross(a, b);
    const Float4 squares = dot(a, a), squares_of_normal = dot(normal, normal);
    x = times(a, one / float4::squareRoot(squares));
    const auto is_point = !(squares > float4::all(kTiny));
    x = select(is_point, Columns{one, none, none}, x);
    y = cross(times(normal, one / float4::squareRoot(squares_of_normal)), x);
    const Float4 excess = dot(y, y) - one;
    const auto is_plane =
        (squares_of_normal > float4::all(kTiny)) & (excess > float4::all(-kNoise));
    y = times(y, one - excess * (float4::all(0.5f) - float4::all(0.375f) * excess));
    if (packs::bits(is_plane) != 15) y = select(is_plane, y, orthogonal());
    y = select(is_point, Columns{none, one, none}, y);
    z = cross(x, y);
  }

  Columns x, y, z;

 private:
  static constexpr float kTiny = 1e-30f, kNoise = 0.005f;

  /// To x, as anyOrthogonal.
  ADAPTIVE_BVH_INLINE Columns orthogonal() const {
    const Float4 one = float4::all(1), none = float4::all(0);
    const auto leans = float4::absolute(x.x) < float4::all(0.6f);
    const Columns other = {leans ? one : none, leans ? none : one, none};
    const Columns across = cross(x, other);
    return times(across, one / float4::squareRoot(dot(across, across)));
  }
};

}  // namespace

/// The axes of a needle are off, so what they leave of a height is measured as well.
void fitTriangles(const CornersOf4& triangles, BodyVolume (&volumes)[kLanes]) {
  const auto& [p, q, r] = triangles;
  const Columns pq = difference(q, p), qr = difference(r, q), rp = difference(p, r);
  const Float4 none = float4::all(0), squares = dot(pq, pq), squares1 = dot(qr, qr),
               squares2 = dot(rp, rp);
  const auto second = squares1 > squares, third = squares2 > float4::upper(squares, squares1);
  const Columns along = select(third, rp, select(second, qr, pq));
  const Columns back = select(third, qr, select(second, pq, rp));  // to where `along` begins
  const Columns apex = {-back.x, -back.y, -back.z};
  const AxesOfFour axes(along, apex);

  Float4 x[kLanes], y[kLanes], z[kLanes], corners[kLanes];
  scatter(axes.x, x);
  scatter(axes.y, y);
  scatter(axes.z, z);
  scatter(select(third, r, select(second, q, p)), corners);
  Float4 low[3], high[3];
  const Columns* const directions[3] = {&axes.x, &axes.y, &axes.z};
  for (int k = 0; k < 3; ++k) {
    const Float4 a = dot(*directions[k], along), b = dot(*directions[k], apex);
    low[k] = float4::lower(float4::lower(a, b), none);
    high[k] = float4::upper(float4::upper(a, b), none);
  }
  const Float4 middle = (low[2] + high[2]) / 2, half = (high[2] - low[2]) / 2;
  for (int i = 0; i < kLanes; ++i) {
    BodyVolume& to = volumes[i];
    to.axes = {x[i], y[i], z[i]};
    to.corner = corners[i] + to.axes.combine(low[0][i], low[1][i], middle[i]);
    to.extents = {{low[0][i], low[1][i], middle[i]},
                  {high[0][i] - low[0][i], high[1][i] - low[1][i]},
                  half[i],
                  {{low[0][i], high[0][i]}, {low[1][i], high[1][i]}, {low[2][i], high[2][i]}}};
  }
}

}  // namespace adaptive_bvh
