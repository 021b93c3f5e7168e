#include "volumes/volume.h"

#include <algorithm>

#include "volumes/rss_fit.h"
#include "volumes/swept_rectangle.h"

// Rounding of the box: docs/bounds.md, 12.
namespace adaptive_bvh {
namespace {

/// The middle of the box around points, along some axes.
template <typename S>
fcl::Vector3<S> middleAlong(const fcl::Matrix3<S>& axes, const PointArrays<S>& points) {
  const fcl::Vector3<S> first = points[0];
  Extent<S> along[3];
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
    const Pack<S> x = points.pack(0, i) - first[0], y = points.pack(1, i) - first[1],
                  z = points.pack(2, i) - first[2];
    for (int k = 0; k < 3; ++k) along[k].add(axes(0, k) * x + axes(1, k) * y + axes(2, k) * z);
  }
  fcl::Vector3<S> middle;
  for (int k = 0; k < 3; ++k) {
    const Interval<S> interval = along[k].interval();
    middle[k] = (interval.low + interval.high) / 2;
  }
  return first + axes * middle;
}

/// The largest |a (p - middle)| of points p, as computed, for each of three axes a.
template <typename S>
fcl::Vector3<S> farthestAlong(const fcl::Matrix3<S>& axes, const fcl::Vector3<S>& middle,
                              const PointArrays<S>& points) {
  Pack<S> far[3] = {};
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
    const Pack<S> x = points.pack(0, i) - middle[0], y = points.pack(1, i) - middle[1],
                  z = points.pack(2, i) - middle[2];
    for (int k = 0; k < 3; ++k) {
      const Pack<S> t = axes(0, k) * x + axes(1, k) * y + axes(2, k) * z;
      far[k] = packs::upper(far[k], packs::upper<Pack<S>>(t, -t));
    }
  }
  return {packs::largest(far[0]), packs::largest(far[1]), packs::largest(far[2])};
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

template <typename S, typename Primitive>
fcl::OBBRSS<S> fitBoth(const MeshView<S>& mesh, const Primitive* primitives, int count) {
  fcl::OBBRSS<S> bv;
  const PointArrays<S>& points = gatherPositions(mesh, primitives, count);
  bv.rss = count == 1 ? fitRss(mesh, primitives, count) : fitRss(points);
  bv.obb = boxAround(bv.rss.axis, points);
  return bv;
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
fcl::OBBRSS<S> Volume<fcl::OBBRSS<S>>::fit(const MeshView<S>& mesh, const unsigned* primitives,
                                           int count) {
  return fitBoth(mesh, primitives, count);
}

template <typename S>
fcl::OBBRSS<S> Volume<fcl::OBBRSS<S>>::fit(const MeshView<S>& mesh, const VertexIndices* primitives,
                                           int count) {
  return fitBoth(mesh, primitives, count);
}

template struct Volume<fcl::OBBRSS<float>>;
template struct Volume<fcl::OBBRSS<double>>;

}  // namespace adaptive_bvh
