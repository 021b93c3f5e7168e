#include "volumes/rss_fit.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "volumes/swept_fit.h"
#include "volumes/volume.h"

namespace adaptive_bvh {
namespace {

template <typename S>
using Vector3 = fcl::Vector3<S>;
template <typename S>
using Matrix3 = fcl::Matrix3<S>;

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
  const Matrix3<S>& a = bv.axis;
  const Vector3<S>& to = bv.To;
  Pack<S> squared{};
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
    Pack<S> v[3];
    for (int k = 0; k < 3; ++k) v[k] = points.pack(k, i) - to[k];
    Pack<S> along[2];
    for (int j = 0; j < 2; ++j) {
      const Pack<S> dot = a(0, j) * v[0] + a(1, j) * v[1] + a(2, j) * v[2];
      along[j] = packs::lower(packs::upper(dot, Pack<S>{}), packs::all(bv.l[j]));
    }
    for (int k = 0; k < 3; ++k) v[k] = v[k] - a(k, 0) * along[0] - a(k, 1) * along[1];
    squared = packs::upper(squared, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  return packs::largest(squared);
}

/// One triangle: the rectangle on its longest edge, twice its area, the least any rectangle can do.
template <typename S>
fcl::RSS<S> fitTriangle(const Vector3<S>& p0, const Vector3<S>& p1, const Vector3<S>& p2) {
  const Vector3<S>* corner[3] = {&p0, &p1, &p2};
  const S edge[3] = {(p1 - p0).squaredNorm(), (p2 - p1).squaredNorm(), (p0 - p2).squaredNorm()};
  const int longest = static_cast<int>(std::max_element(edge, edge + 3) - edge);
  const Vector3<S>& base = *corner[longest];
  const Vector3<S> along = *corner[(longest + 1) % 3] - base;
  const Vector3<S> apex = *corner[(longest + 2) % 3] - base;

  fcl::RSS<S> bv;
  bv.axis = frameAlong<S>(along, apex);
  // The apex projects into the longest edge, but for rounding; `radiusFor` pays for that.
  bv.To = base;
  bv.l[0] = along.norm();
  bv.l[1] = std::max(S(0), bv.axis.col(1).dot(apex));
  S squared = 0;
  for (const Vector3<S>* p : corner)
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

}  // namespace

template <typename S>
fcl::RSS<S> fitRss(const PointArrays<S>& points) {
  static thread_local PointArrays<S> few, local;
  fcl::RSS<S> bv;
  bv.axis = bestAxes(points, few, local);
  const Shape<S> shape = shapeAlong(bv.axis, points, few, local);
  const auto& [along, across] = shape.rectangle;
  bv.To = points[0] + bv.axis * Vector3<S>(along.low, across.low, shape.slab.middle);
  bv.l[0] = along.length();
  bv.l[1] = across.length();
  putLongerSideFirst(bv);
  bv.r = radiusFor(bv, squaredDistanceToRectangle(bv, points));
  return bv;
}

template <typename S, typename Primitive>
const PointArrays<S>& gatherPositions(const MeshView<S>& mesh, const Primitive* primitives,
                                      int count) {
  static thread_local Gathered<S> gathered;
  return gathered.from(mesh, primitives, count);
}

template <typename S, typename Primitive>
fcl::RSS<S> fitRss(const MeshView<S>& mesh, const Primitive* primitives, int count) {
  if (count == 1 && mesh.triangles && !mesh.previous) {
    const VertexIndices& t = cornersOf(mesh, primitives[0]);
    return fitTriangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  }
  return fitRss(gatherPositions(mesh, primitives, count));
}

#define ADAPTIVE_BVH_INSTANTIATE(S, Primitive)                            \
  template fcl::RSS<S> fitRss(const MeshView<S>&, const Primitive*, int); \
  template const PointArrays<S>& gatherPositions(const MeshView<S>&, const Primitive*, int);
ADAPTIVE_BVH_INSTANTIATE(float, unsigned)
ADAPTIVE_BVH_INSTANTIATE(float, VertexIndices)
ADAPTIVE_BVH_INSTANTIATE(double, unsigned)
ADAPTIVE_BVH_INSTANTIATE(double, VertexIndices)
#undef ADAPTIVE_BVH_INSTANTIATE
template fcl::RSS<float> fitRss(const PointArrays<float>&);
template fcl::RSS<double> fitRss(const PointArrays<double>&);

}  // namespace adaptive_bvh
