#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/leased.h"
#include "thesis/volumes/swept_fit.h"
#include "thesis/volumes/volume.h"

// Volume::fit: volumes around triangles, in the model's precision. Axes and rectangle are chosen
// first (swept_fit.h), with rounding errors. Then the radius and the box are measured from the
// result as it is stored, so they enclose the triangles whatever was chosen.
namespace adaptive_bvh {
namespace {

template <typename S>
using Vector3 = fcl::Vector3<S>;
template <typename S>
using Matrix3 = fcl::Matrix3<S>;

/// The columns of a matrix as axes, the same in every lane.
template <typename S>
Axes<Pack<S>> axesOf(const Matrix3<S>& axes) {
  return {inAllLanes<S>(axes.col(0)), inAllLanes<S>(axes.col(1)), inAllLanes<S>(axes.col(2))};
}

/// The smallest radius, error included, that encloses points whose squared distance from the
/// rectangle is at most `squared`.
template <typename S>
S radiusFor(const fcl::RSS<S>& bv, S squared) {
  const S distance = std::sqrt(squared);
  return distance + Volume<fcl::RSS<S>>::containmentError(bv, distance);
}

/// The square of the largest Volume::distanceToRectangle of the points. It has the same arithmetic,
/// for several points at once, so that the same error bound applies.
template <typename S>
S squaredDistanceToRectangle(const fcl::RSS<S>& bv, const PointArrays<S>& points) {
  const Axes<Pack<S>> axes = axesOf(bv.axis);
  const Vectors<Pack<S>> corner = inAllLanes<S>(bv.To);
  const auto clamped = [](const Pack<S>& x, S length) -> Pack<S> {
    return packs::lower(packs::upper(x, Pack<S>{}), packs::all(length));
  };
  Pack<S> squared{};
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& p) {
    using vectors::difference;
    using vectors::scaled;
    const Vectors<Pack<S>> v = difference(p, corner);
    const Pack<S> x = clamped(vectors::dot(axes.x, v), bv.l[0]),
                  y = clamped(vectors::dot(axes.y, v), bv.l[1]);
    const Vectors<Pack<S>> w = difference(difference(v, scaled(axes.x, x)), scaled(axes.y, y));
    squared = packs::upper(squared, vectors::dot(w, w));
  });
  return packs::largest(squared);
}

/// The rectangle of the volume in lane 0 as an RSS whose radius is not set.
template <typename S>
fcl::RSS<S> rssOf(const BodyVolumes<Pack<S>>& volume) {
  const auto vector = [](const Vectors<Pack<S>>& v) -> Vector3<S> {
    return {v.x[0], v.y[0], v.z[0]};
  };
  fcl::RSS<S> bv;
  bv.axis << vector(volume.axes.x), vector(volume.axes.y), vector(volume.axes.z);
  bv.To = vector(volume.corner);
  bv.l[0] = volume.sides[0][0];
  bv.l[1] = volume.sides[1][0];
  return bv;
}

/// The volume of one triangle: see triangleVolumes.
template <typename S>
fcl::RSS<S> fitTriangle(const Vector3<S>& p0, const Vector3<S>& p1, const Vector3<S>& p2) {
  fcl::RSS<S> bv =
      rssOf<S>(triangleVolumes(inAllLanes<S>(p0), inAllLanes<S>(p1), inAllLanes<S>(p2)));
  S squared = 0;
  for (const Vector3<S>* p : {&p0, &p1, &p2})
    squared = std::max(squared, Volume<fcl::RSS<S>>::vectorFromRectangle(bv, *p).squaredNorm());
  bv.r = radiusFor(bv, squared);
  return bv;
}

/// The vertices of a primitive, which is given by its index or by its vertices.
template <typename S>
VertexIndices cornersOf(const MeshView<S>& mesh, unsigned primitive) {
  return mesh.verticesOf(primitive);
}
template <typename S>
const VertexIndices& cornersOf(const MeshView<S>&, const VertexIndices& primitive) {
  return primitive;
}

/// The positions of a fit, gathered once, because a fit reads them five times and they are
/// scattered in the mesh. Each vertex is taken once, though about six triangles share it: that is
/// faster, and better for the principal axes than counting it for every triangle (queries on the
/// scenarios needed 5 % fewer volume tests).
///
/// The arrays grow to the size of the thread's largest fit. In a build that is the first one, the
/// root's; after that nothing is allocated.
template <typename S>
class Gathered {
 public:
  /// The positions of all corners of some primitives, in both frames. Valid until the next call.
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
  /// Whether this is the first call for vertex v in this fit.
  bool isNew(unsigned v) {
    if (v >= taken_in_.size()) taken_in_.resize(v + v / 2 + 1, 0);
    if (taken_in_[v] == fit_) return false;
    taken_in_[v] = fit_;
    return true;
  }

  PointArrays<S> points_;
  std::vector<std::uint64_t> taken_in_;  ///< by vertex: number of the last fit that included it
  std::uint64_t fit_ = 0;                ///< number of the current fit
};

/// Orders the sides so that the first is the longer one: FCL's splitter divides along it.
template <typename S>
void putLongerSideFirst(fcl::RSS<S>& bv) {
  if (bv.l[0] >= bv.l[1]) return;
  std::swap(bv.l[0], bv.l[1]);
  bv.axis.col(0).swap(bv.axis.col(1));
  bv.axis.col(2) *= -1;
}

/// Fits a volume to points.
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

/// Fits a volume to primitives; uses fitTriangle for a single triangle in one frame.
template <typename S, typename Primitive>
fcl::RSS<S> fitRss(const MeshView<S>& mesh, const Primitive* primitives, int count) {
  if (count == 1 && mesh.triangles && !mesh.previous) {
    const VertexIndices& t = cornersOf(mesh, primitives[0]);
    return fitTriangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  }
  const Leased<Gathered<S>> gathered;
  return fitRss(gathered->from(mesh, primitives, count));
}

// Rounding of the box: docs/bounds.md, 12.

/// The centre of the points' bounding box along some axes.
template <typename S>
Vector3<S> middleAlong(const Matrix3<S>& axes, const PointArrays<S>& points) {
  const Axes<Pack<S>> axis_packs = axesOf(axes);
  Extent<S> x, y, z;
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& p) {
    const Vectors<Pack<S>> c = axis_packs.components(vectors::difference(p, points.first()));
    x.add(c.x);
    y.add(c.y);
    z.add(c.z);
  });
  return points[0] + axes * Vector3<S>(x.middle(), y.middle(), z.middle());
}

/// The largest computed |a (p - middle)| over points p, for each of three axes a.
template <typename S>
Vector3<S> farthestAlong(const Matrix3<S>& axes, const Vector3<S>& middle,
                         const PointArrays<S>& points) {
  const Axes<Pack<S>> axis_packs = axesOf(axes);
  const Vectors<Pack<S>> middles = inAllLanes<S>(middle);
  Vectors<Pack<S>> far{};
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& p) {
    const Vectors<Pack<S>> c = axis_packs.components(vectors::difference(p, middles));
    far = {packs::upper(far.x, packs::absolute<Pack<S>>(c.x)),
           packs::upper(far.y, packs::absolute<Pack<S>>(c.y)),
           packs::upper(far.z, packs::absolute<Pack<S>>(c.z))};
  });
  return {packs::largest(far.x), packs::largest(far.y), packs::largest(far.z)};
}

/// The box with these axes around points. Its extents are measured from the stored, rounded centre.
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
template <typename Primitive>
fcl::RSS<S> Volume<fcl::RSS<S>>::fit(const MeshView<S>& mesh, const Primitive* primitives,
                                     int count) {
  return fitRss(mesh, primitives, count);
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

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                         \
  template BV Volume<BV>::fit(const MeshView<BV::S>&, const unsigned*, int); \
  template BV Volume<BV>::fit(const MeshView<BV::S>&, const VertexIndices*, int);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
