#include "thesis/volumes/volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "base/leased.h"
#include "thesis/volumes/swept_fit.h"

namespace adaptive_bvh {
namespace {

template <typename S>
using Vector3 = fcl::Vector3<S>;
template <typename S>
using Matrix3 = fcl::Matrix3<S>;

/// In every lane.
template <typename S>
Axes<Pack<S>> axesOf(const Matrix3<S>& axes) {
  return {inAllLanes<S>(axes.col(0)), inAllLanes<S>(axes.col(1)), inAllLanes<S>(axes.col(2))};
}

/// The vector to p from a point of the rectangle, the nearest one up to rounding.
template <typename S>
fcl::Vector3<S> vectorFromRectangle(const fcl::RSS<S>& bv, const fcl::Vector3<S>& p) {
  const fcl::Vector3<S> v = p - bv.To;
  const S x = std::min(std::max(bv.axis.col(0).dot(v), S(0)), bv.l[0]);
  const S y = std::min(std::max(bv.axis.col(1).dot(v), S(0)), bv.l[1]);
  return v - bv.axis.col(0) * x - bv.axis.col(1) * y;
}

/// The least radius, error included, with which the volume holds points that are at most this far
/// from its rectangle, squared.
template <typename S>
S radiusFor(const fcl::RSS<S>& bv, S squared) {
  const S distance = std::sqrt(squared);
  return distance + Volume<fcl::RSS<S>>::containmentError(bv, distance);
}

/// The square of the largest `distanceToRectangle`: the same arithmetic, many points at once, so
/// the same bound on its error holds.
template <typename S>
S squaredDistanceToRectangle(const fcl::RSS<S>& bv, const PointArrays<S>& points) {
  const Axes<Pack<S>> axes = axesOf(bv.axis);
  const Vectors<Pack<S>> to = inAllLanes<S>(bv.To);
  const auto clamped = [](const Pack<S>& x, S length) -> Pack<S> {
    return packs::lower(packs::upper(x, Pack<S>{}), packs::all(length));
  };
  Pack<S> squared{};
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& at) {
    using vectors::difference;
    using vectors::scaled;
    const Vectors<Pack<S>> v = difference(at, to);
    const Pack<S> x = clamped(vectors::dot(axes.x, v), bv.l[0]),
                  y = clamped(vectors::dot(axes.y, v), bv.l[1]);
    const Vectors<Pack<S>> w = difference(difference(v, scaled(axes.x, x)), scaled(axes.y, y));
    squared = packs::upper(squared, vectors::dot(w, w));
  });
  return packs::largest(squared);
}

/// The volume along axes, from `first`, of a rectangle in a plane; its radius is not set.
template <typename S>
fcl::RSS<S> rssOf(const BodyVolumes<Pack<S>>& of) {
  const auto vector = [](const Vectors<Pack<S>>& v) -> Vector3<S> {
    return {v.x[0], v.y[0], v.z[0]};
  };
  fcl::RSS<S> bv;
  bv.axis << vector(of.axes.x), vector(of.axes.y), vector(of.axes.z);
  bv.To = vector(of.corner);
  bv.l[0] = of.sides[0][0];
  bv.l[1] = of.sides[1][0];
  return bv;
}

/// One triangle: see triangleVolumes.
template <typename S>
fcl::RSS<S> fitTriangle(const Vector3<S>& p0, const Vector3<S>& p1, const Vector3<S>& p2) {
  fcl::RSS<S> bv =
      rssOf<S>(triangleVolumes(inAllLanes<S>(p0), inAllLanes<S>(p1), inAllLanes<S>(p2)));
  S squared = 0;
  for (const Vector3<S>* p : {&p0, &p1, &p2})
    squared = std::max(squared, vectorFromRectangle(bv, *p).squaredNorm());
  bv.r = radiusFor(bv, squared);
  return bv;
}

template <typename S>
VertexIndices cornersOf(const MeshView<S>& mesh, unsigned primitive) {
  return mesh.verticesOf(primitive);
}
template <typename S>
const VertexIndices& cornersOf(const MeshView<S>&, const VertexIndices& primitive) {
  return primitive;
}

/// The positions of a fit, gathered once: a fit walks them five times, and in the mesh they lie
/// apart. Each vertex is taken once, though about six triangles share it: that is faster, and in
/// the principal axes better than counting it for every triangle (queries on the scenarios needed 5
/// % fewer volume tests).
///
/// The arrays grow to the largest fit that the thread has made, which is the first one of a build,
/// the root's; from then on nothing is allocated.
template <typename S>
class Gathered {
 public:
  template <typename Primitive>
  const PointArrays<S>& from(const MeshView<S>& mesh, const Primitive* primitives, int count) {
    points_.clear();
    ++fit_;
    for (int i = 0; i < count; ++i) {
      points_.makeRoomFor(6);  // three corners in two frames
      for (unsigned v : cornersOf(mesh, primitives[i]))
        if (isNew(v)) mesh.forEachPositionOf(v, [this](const Vector3<S>& p) { points_.add(p); });
    }
    points_.fillUp();
    return points_;
  }

 private:
  bool isNew(unsigned v) {
    if (v >= taken_in_.size()) taken_in_.resize(v + v / 2 + 1, 0);
    if (taken_in_[v] == fit_) return false;
    taken_in_[v] = fit_;
    return true;
  }

  PointArrays<S> points_;
  std::vector<std::uint64_t> taken_in_;  // by vertex: the last fit that took it
  std::uint64_t fit_ = 0;
};

/// Names the sides so that the first is the longer one: along it FCL's splitter cuts.
template <typename S>
void putLongerSideFirst(fcl::RSS<S>& bv) {
  if (bv.l[0] >= bv.l[1]) return;
  std::swap(bv.l[0], bv.l[1]);
  bv.axis.col(0).swap(bv.axis.col(1));
  bv.axis.col(2) *= -1;
}

/// The volume around points.
template <typename S>
fcl::RSS<S> fitRss(const PointArrays<S>& points) {
  const Leased<FitMemory<S>> memory;
  const Axes<Pack<S>> axes = bestAxes(points, *memory);
  const SlabRectangle<Pack<S>> shape = shapeAlong(axes, points, *memory);
  fcl::RSS<S> bv =
      rssOf<S>({axes, points.first(), shape.low, shape.high, shape.middle, shape.radius, {}, {}});
  putLongerSideFirst(bv);
  bv.r = radiusFor(bv, squaredDistanceToRectangle(bv, points));
  return bv;
}

/// One triangle without a second frame gets a closer look.
template <typename S, typename Primitive>
fcl::RSS<S> fitRss(const MeshView<S>& mesh, const Primitive* primitives, int count) {
  if (count == 1 && mesh.triangles && !mesh.previous) {
    const VertexIndices& t = cornersOf(mesh, primitives[0]);
    return fitTriangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  }
  const Leased<Gathered<S>> gathered;
  return fitRss(gathered->from(mesh, primitives, count));
}

}  // namespace

template <typename S>
S Volume<fcl::RSS<S>>::distanceToRectangle(const BV& bv, const Point& p) {
  return vectorFromRectangle(bv, p).norm();
}

// Any x in [0, l0] and y in [0, l1] name a point q of the rectangle, so |p - q| bounds the distance
// whatever the rounding of x and y. Let w = p - To - a0 x - a1 y exactly. A component of the
// computed w is off by at most 3u (|v_i| + |a0_i x| + |a1_i y|), hence the vector by
// 3u (|v| + 1.01 (x + y)) <= 3u |w| + 6.1u (l0 + l1), with |v| <= |w| + 1.01 (x + y) and axes of
// length at most 1.01. The norm adds 3u and underflow adds tiny. So the exact distance is at most
// d (1 + 6u) + 6.2u (l0 + l1) + tiny; the bound below is twice that, which also covers its own
// evaluation, the caller's sum, and a distance taken as the upper end.
template <typename S>
S Volume<fcl::RSS<S>>::containmentError(const BV& bv, S distance) {
  return 6 * rounding::epsilon<S>() * (distance + bv.l[0] + bv.l[1]) + rounding::tiny<S>();
}

template <typename S>
bool Volume<fcl::RSS<S>>::contains(const BV& bv, const Point& p) {
  const S distance = distanceToRectangle(bv, p);
  return distance <= bv.r + containmentError(bv, distance);
}

template <typename S>
template <typename Primitive>
fcl::RSS<S> Volume<fcl::RSS<S>>::fit(const MeshView<S>& mesh, const Primitive* primitives,
                                     int count) {
  return fitRss(mesh, primitives, count);
}

// Steiner's formula for the points within r of an a x b rectangle.
template <typename S>
double Volume<fcl::RSS<S>>::volume(const BV& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return a * b * 2 * r + M_PI * r * r * (a + b) + 4. / 3 * M_PI * r * r * r;
}

// Its derivative by r.
template <typename S>
double Volume<fcl::RSS<S>>::surfaceArea(const BV& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return 2 * a * b + 2 * M_PI * r * (a + b) + 4 * M_PI * r * r;
}

template <typename S>
double Volume<fcl::RSS<S>>::aspectRatio(const BV& bv) {
  const double a = bv.l[0] + 2 * bv.r, b = bv.l[1] + 2 * bv.r;
  return std::min(a, b) > 0 ? std::max(a, b) / std::min(a, b) : 0;
}

// The points are the first 64 of the additive recurrence with the powers of 1/g, g^4 = g + 1
// (Roberts 2018), which fills a box evenly from any number of points on.
template <typename S>
double Volume<fcl::RSS<S>>::shareWithin(const BV& inner, const BV& outer) {
  constexpr int kSamples = 64;
  constexpr double kStep[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  const S slack = S(1e-6) * (outer.r + outer.l[0] + outer.l[1]);  // coplanar ones count as touching
  int within = 0;
  for (int i = 0; i < kSamples; ++i) {
    double at[3];
    for (int k = 0; k < 3; ++k) at[k] = std::fmod(0.5 + kStep[k] * (i + 1), 1.);
    const Point p = inner.To + inner.axis.col(0) * (S(at[0]) * inner.l[0]) +
                    inner.axis.col(1) * (S(at[1]) * inner.l[1]) +
                    inner.axis.col(2) * (S(2 * at[2] - 1) * inner.r);
    within += distanceToRectangle(outer, p) <= outer.r + slack;
  }
  return within / double(kSamples);
}

// Rounding of the box: docs/bounds.md, 12.
namespace {

/// The middle of the box around points, along some axes.
template <typename S>
Vector3<S> middleAlong(const Matrix3<S>& axes, const PointArrays<S>& points) {
  const Axes<Pack<S>> along = axesOf(axes);
  Extent<S> x, y, z;
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& at) {
    const Vectors<Pack<S>> c = along.components(vectors::difference(at, points.first()));
    x.add(c.x);
    y.add(c.y);
    z.add(c.z);
  });
  return points[0] + axes * Vector3<S>(x.middle(), y.middle(), z.middle());
}

/// The largest |a (p - middle)| of points p, as computed, for each of three axes a.
template <typename S>
Vector3<S> farthestAlong(const Matrix3<S>& axes, const Vector3<S>& middle,
                         const PointArrays<S>& points) {
  const Axes<Pack<S>> along = axesOf(axes);
  const Vectors<Pack<S>> from = inAllLanes<S>(middle);
  Vectors<Pack<S>> far{};
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& at) {
    const Vectors<Pack<S>> c = along.components(vectors::difference(at, from));
    far = {packs::upper(far.x, packs::absolute<Pack<S>>(c.x)),
           packs::upper(far.y, packs::absolute<Pack<S>>(c.y)),
           packs::upper(far.z, packs::absolute<Pack<S>>(c.z))};
  });
  return {packs::largest(far.x), packs::largest(far.y), packs::largest(far.z)};
}

/// The box with these axes around points. Like the radius of a fit, its extents are measured from
/// the middle as it was rounded.
template <typename S>
fcl::OBB<S> boxAround(const fcl::Matrix3<S>& axes, const PointArrays<S>& points) {
  fcl::OBB<S> box;
  box.axis = axes;
  box.To = middleAlong(axes, points);
  const fcl::Vector3<S> far = farthestAlong(axes, box.To, points);
  box.extent = far.array() + (40 * rounding::epsilon<S>() * far.sum() + rounding::tiny<S>());
  return box;
}

}  // namespace

template <typename S>
void Volume<fcl::OBBRSS<S>>::setRadius(BV& bv, S radius) {
  const S growth = radius - bv.rss.r;
  const S along_axes = growth > 0 ? growth * (1 + 4 * kAxes) : growth;
  constexpr S kRounding = 2 * rounding::epsilon<S>();
  bv.obb.extent =
      (bv.obb.extent.array() + along_axes) * (1 + kRounding) + kRounding * (radius + bv.rss.r);
  RssPart::setRadius(bv.rss, radius);
}

template <typename S>
bool Volume<fcl::OBBRSS<S>>::contains(const BV& bv, const Point& p) {
  const Point along = (bv.obb.axis.transpose() * (p - bv.obb.To)).cwiseAbs();
  const S error = 3 * rounding::epsilon<S>() * along.sum() + rounding::tiny<S>();
  return ((along - bv.obb.extent).array() <= error).all() && RssPart::contains(bv.rss, p);
}

template <typename S>
template <typename Primitive>
fcl::OBBRSS<S> Volume<fcl::OBBRSS<S>>::fit(const MeshView<S>& mesh, const Primitive* primitives,
                                           int count) {
  BV bv;
  const Leased<Gathered<S>> gathered;
  const PointArrays<S>& points = gathered->from(mesh, primitives, count);
  bv.rss = count == 1 ? fitRss(mesh, primitives, count) : fitRss(points);
  bv.obb = boxAround(bv.rss.axis, points);
  return bv;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                              \
  template BV Volume<BV>::fit(const MeshView<BV::S>&, const unsigned*, int);      \
  template BV Volume<BV>::fit(const MeshView<BV::S>&, const VertexIndices*, int); \
  template struct Volume<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
