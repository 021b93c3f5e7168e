#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <fcl/math/bv/AABB.h>

#include "thesis/volumes/volume.h"

// How far a volume or a triangle of a mesh lies from a cell of an octree, all in the octree's
// coordinates. Two bodies are at least as far apart as their projections on any direction. Every
// bound here is one of projections, so it does not matter how well a direction was computed.
//
// Rounding. A point of the mesh is off by less than a third of IntoOctree::error. A few operations
// follow, on the offset of both middles and on both extents. The offset is no larger than both
// extents and the gap between them. So two things cover the errors of offset and extents: the
// extents are enlarged by 32 epsilon of the cell's extent and of the mesh's coordinates (in
// `error`), and a gap is made smaller by 16 epsilon of itself. That leaves the last third of
// `error` for the test of the triangle.
namespace adaptive_bvh {

/// Takes a mesh's coordinates to an octree's.
template <typename S>
class IntoOctree {
 public:
  using Point = fcl::Vector3<S>;

  IntoOctree(const fcl::Transform3<S>& mesh_tf, const fcl::Transform3<S>& octree_tf)
      : tf_(octree_tf.inverse(Eigen::Isometry) * mesh_tf),
        translations_(mesh_tf.translation().template lpNorm<1>() +
                      octree_tf.translation().template lpNorm<1>()) {}

  Point point(const Point& p) const { return tf_ * p; }
  Point direction(const Point& v) const { return tf_.linear() * v; }

  /// By how much a body is enlarged for the rounding of its points, here and in the test of a
  /// triangle: sums of three products with the translations. `coordinate_sum` is at least
  /// |x| + |y| + |z| of its points in the mesh's coordinates.
  S error(S coordinate_sum) const {
    return 32 * rounding::epsilon<S>() * (translations_ + coordinate_sum) + rounding::tiny<S>();
  }

 private:
  fcl::Transform3<S> tf_;
  S translations_;
};

/// A cell of an octree, which is a cube.
template <typename S>
struct CellExtent {
  CellExtent() = default;
  explicit CellExtent(const fcl::AABB<S>& cell)
      : middle((cell.min_ + cell.max_) / 2),
        half((cell.max_ - cell.min_).maxCoeff() * (S(0.5) + 16 * rounding::epsilon<S>())) {}

  fcl::Vector3<S> middle;
  S half;  ///< of a side
};

/// What a body covers along a direction, from a point that is its reference.
template <typename S>
struct Projection {
  fcl::Vector3<S> axis;
  S middle, half;  ///< of what is covered
  S cell;          ///< what half a side of a cell covers, in units of that half

  /// How far the body is from a cell along the axis, `offset` from the reference to its middle.
  S gap(const fcl::Vector3<S>& offset, S half_cell) const {
    return std::abs(axis.dot(offset) - middle) - half - cell * half_cell;
  }
};

/// A lower bound of a distance from the gaps along three directions at right angles.
template <typename S>
S distanceOfGaps(S x, S y, S z) {
  x = std::max(x, S(0)), y = std::max(y, S(0)), z = std::max(z, S(0));
  return std::sqrt(x * x + y * y + z * z) * (1 - 16 * rounding::epsilon<S>());
}

/// All that is within a radius of a parallelepiped, in the coordinates of a mesh.
template <typename S>
struct SweptBox {
  fcl::Vector3<S> middle, half[3];  ///< from the middle to three of its faces
  S radius;
  fcl::Matrix3<S> axes;
  S coordinate_sum;  ///< at least |x| + |y| + |z| of its points
};
template <typename BV, typename S = typename BV::S>
SweptBox<S> sweptBoxOf(const BV& bv) {
  const auto body = Volume<BV>::parallelogram(bv);
  return {body.middle,
          {body.half[0], body.half[1], fcl::Vector3<S>::Zero()},
          body.radius,
          Volume<BV>::axes(bv),
          Volume<BV>::coordinateSum(bv)};
}

/// What a volume or a box covers along the octree's axes and its own.
template <typename S>
class VolumeInOctree {
 public:
  using Point = fcl::Vector3<S>;

  VolumeInOctree(const SweptBox<S>& body, const IntoOctree<S>& into)
      : middle_(into.point(body.middle)) {
    const S radius = body.radius + into.error(body.coordinate_sum);
    half_ = Point::Constant(radius);
    Point half[3];
    for (int k = 0; k < 3; ++k) {
      half[k] = into.direction(body.half[k]);
      half_ += half[k].cwiseAbs();
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Point axis = into.direction(body.axes.col(int(k)));
      own_[k] = {axis, 0, radius, axis.template lpNorm<1>()};
      for (const Point& side : half) own_[k].half += std::abs(axis.dot(side));
    }
  }

  /// True: they have no point in common.
  bool isApart(const CellExtent<S>& cell) const {
    const Point offset = cell.middle - middle_;
    if ((offset.cwiseAbs() - half_).maxCoeff() > cell.half) return true;
    for (const Projection<S>& along : own_)
      if (along.gap(offset, cell.half) > 0) return true;
    return false;
  }

  /// A lower bound of the distance, below 0 when the projections overlap.
  S distance(const CellExtent<S>& cell) const {
    const Point offset = cell.middle - middle_;
    const Point gap = offset.cwiseAbs() - half_ - Point::Constant(cell.half);
    S own = own_[0].gap(offset, cell.half);
    for (std::size_t k : {1, 2}) own = std::max(own, own_[k].gap(offset, cell.half));
    own -= 16 * rounding::epsilon<S>() * std::abs(own);
    const S overlap = std::max(gap.maxCoeff(), own);
    return overlap < 0 ? overlap : std::max(distanceOfGaps(gap[0], gap[1], gap[2]), own);
  }

 private:
  Point middle_, half_;
  std::array<Projection<S>, 3> own_;
};

/// The corners of a triangle from the middle of the box around them, and that box.
template <typename S>
class TriangleInOctree {
 public:
  using Point = fcl::Vector3<S>;

  TriangleInOctree(const Point& a, const Point& b, const Point& c, const IntoOctree<S>& into)
      : corners_{into.point(a), into.point(b), into.point(c)},
        error_(into.error(a.cwiseAbs().cwiseMax(b.cwiseAbs()).cwiseMax(c.cwiseAbs()).sum())) {
    const Point low = corners_[0].cwiseMin(corners_[1]).cwiseMin(corners_[2]),
                high = corners_[0].cwiseMax(corners_[1]).cwiseMax(corners_[2]);
    middle_ = (low + high) / 2;
    half_ = (high - low) / 2 + Point::Constant(error_);
    for (Point& corner : corners_) corner -= middle_;
  }

  /// From the middle of the box to that of a cell.
  Point offset(const CellExtent<S>& cell) const { return cell.middle - middle_; }
  /// Gaps along the octree's axes.
  Point gaps(const Point& offset, S half_cell) const {
    return offset.cwiseAbs() - half_ - Point::Constant(half_cell);
  }
  bool hasCornerIn(const Point& offset, S half_cell) const {
    return std::any_of(corners_.begin(), corners_.end(), [&](const Point& corner) {
      return (corner - offset).cwiseAbs().maxCoeff() <= half_cell;
    });
  }
  /// From corner k to the next, in units of the box: products of them neither over- nor underflow.
  Point edge(std::size_t k) const {
    return (corners_[(k + 1) % 3] - corners_[k]) / half_.maxCoeff();
  }
  Point normal() const { return edge(0).cross(edge(1)); }

  Projection<S> along(const Point& axis) const {
    const S x = axis.dot(corners_[0]), y = axis.dot(corners_[1]), z = axis.dot(corners_[2]);
    const S low = std::min({x, y, z}), high = std::max({x, y, z});
    const S length = axis.template lpNorm<1>();
    return {axis, (low + high) / 2, (high - low) / 2 + error_ * length, length};
  }

 private:
  std::array<Point, 3> corners_;
  S error_;
  Point middle_, half_;
};

/// Separating axes of triangles and cells: along the octree's axes, the triangle's normal, and the
/// products of its edges with the axes. Two that are apart are so along one of these.
template <typename S>
class TriangleOverlap : private TriangleInOctree<S> {
 public:
  using Point = fcl::Vector3<S>;

  TriangleOverlap(const Point& a, const Point& b, const Point& c, const IntoOctree<S>& into)
      : TriangleInOctree<S>(a, b, c, into) {}

  bool isApart(const CellExtent<S>& cell) {
    const Point offset = this->offset(cell);
    if (this->gaps(offset, cell.half).maxCoeff() > 0) return true;
    if (!prepared_) {
      if (this->hasCornerIn(offset, cell.half)) return false;
      prepare();
    }
    for (const Projection<S>& along : along_)
      if (along.gap(offset, cell.half) > 0) return true;
    return false;
  }

 private:
  void prepare() {
    prepared_ = true;
    along_[0] = this->along(this->normal());
    for (std::size_t k = 0; k < 3; ++k) {
      const Point edge = this->edge(k);
      for (int axis = 0; axis < 3; ++axis)
        along_[1 + 3 * k + std::size_t(axis)] = this->along(edge.cross(Point::Unit(axis)));
    }
  }

  std::array<Projection<S>, 10> along_;
  bool prepared_ = false;
};

/// Lower bounds of the distance of a triangle and cells: along the octree's axes together, and
/// along the normal together with what stands at right angles to it and to an edge.
template <typename S>
class TriangleDistance : private TriangleInOctree<S> {
 public:
  using Point = fcl::Vector3<S>;

  TriangleDistance(const Point& a, const Point& b, const Point& c, const IntoOctree<S>& into)
      : TriangleInOctree<S>(a, b, c, into) {
    const Point normal = unitOrZero(this->normal());
    normal_ = this->along(normal);
    for (std::size_t k = 0; k < 3; ++k)
      beside_[k] = this->along(unitOrZero(normal.cross(this->edge(k))));
  }

  /// Below 0 when the projections overlap.
  S distance(const CellExtent<S>& cell) const {
    const Point offset = this->offset(cell), gap = this->gaps(offset, cell.half);
    const S above = normal_.gap(offset, cell.half);
    S beside = beside_[0].gap(offset, cell.half);
    for (std::size_t k : {1, 2}) beside = std::max(beside, beside_[k].gap(offset, cell.half));
    const S overlap = std::max({gap.maxCoeff(), above, beside});
    if (overlap < 0) return overlap;
    return std::max(distanceOfGaps(gap[0], gap[1], gap[2]), distanceOfGaps(above, beside, S(0)));
  }

 private:
  /// Zero where the length is lost to underflow; all bodies overlap along that.
  static Point unitOrZero(const Point& v) {
    const S length = v.norm();
    return length > rounding::tiny<S>() ? Point(v / length) : Point::Zero();
  }

  Projection<S> normal_;
  std::array<Projection<S>, 3> beside_;
};

}  // namespace adaptive_bvh
