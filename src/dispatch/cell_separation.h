#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <fcl/math/bv/AABB.h>

#include "base/rounding.h"

// Lower bounds of the distance of a volume or triangle of a mesh from a cell of an octree, in the
// octree's coordinates. Each bound is the gap of the projections on a direction. It is valid for
// any direction, so the rounding of computed directions does not matter.
//
// Rounding. The error of a mesh's point is less than a third of IntoOctree::error. A few operations
// follow, on the offset between both centres and on both extents; the offset is at most the sum of
// the extents and the gap. The extents are enlarged by 32 epsilon of the cell's extent and of the
// mesh's coordinates (in `error`), and a gap is reduced by 16 epsilon of itself. Both cover the
// rounding of offset and extents. The last third of `error` remains for the test of the triangle.
namespace adaptive_bvh {

/// Transforms a mesh's coordinates to an octree's, and bounds the rounding errors.
class IntoOctree {
 public:
  using Point = fcl::Vector3d;

  IntoOctree(const fcl::Transform3d& mesh_tf, const fcl::Transform3d& octree_tf)
      : tf_(octree_tf.inverse(Eigen::Isometry) * mesh_tf),
        translations_(mesh_tf.translation().lpNorm<1>() + octree_tf.translation().lpNorm<1>()) {}

  Point point(const Point& p) const { return tf_ * p; }
  Point direction(const Point& v) const { return tf_.linear() * v; }

  /// The padding of a body for the rounding of its points, here and in the test of a triangle: sums
  /// of three products with the translations. `coordinate_sum`: upper bound of |x| + |y| + |z| of
  /// its points, in the mesh's coordinates.
  double error(double coordinate_sum) const {
    return 32 * rounding::epsilon<double>() * (translations_ + coordinate_sum) +
           rounding::tiny<double>();
  }

 private:
  fcl::Transform3d tf_;
  double translations_;
};

/// A cell of an octree, which is a cube: its centre, and half its side, rounded up.
struct CellExtent {
  CellExtent() = default;
  explicit CellExtent(const fcl::AABBd& cell)
      : middle((cell.min_ + cell.max_) / 2),
        half((cell.max_ - cell.min_).maxCoeff() * (0.5 + 16 * rounding::epsilon<double>())) {}

  fcl::Vector3d middle;
  double half;
};

/// The projection of a body on an axis, relative to a reference point of the body.
struct Projection {
  fcl::Vector3d axis;
  double middle, half;  ///< of the interval
  double cell;          ///< half the projection of a cell, divided by half its side

  /// Gap to a cell's projection; negative if they overlap. `offset`: of its centre from the point.
  double gap(const fcl::Vector3d& offset, double half_cell) const {
    return std::abs(axis.dot(offset) - middle) - half - cell * half_cell;
  }
};

/// A lower bound of a distance, given the gaps along three orthogonal directions.
inline double distanceOfGaps(double x, double y, double z) {
  x = std::max(x, 0.), y = std::max(y, 0.), z = std::max(z, 0.);
  return std::sqrt(x * x + y * y + z * z) * (1 - 16 * rounding::epsilon<double>());
}

/// All points within a radius of a parallelepiped, in the coordinates of a mesh.
struct SweptBox {
  fcl::Vector3d middle, half[3];  ///< centre, and vectors from it to three faces
  double radius;
  fcl::Matrix3d axes;     ///< columns: the volume's own axes, for separating axis tests
  double coordinate_sum;  ///< upper bound of |x| + |y| + |z| of its points
};

/// A volume in the octree's coordinates, by its projections on the octree's axes and on its own.
class VolumeInOctree {
 public:
  using Point = fcl::Vector3d;

  VolumeInOctree(const SweptBox& body, const IntoOctree& into) : middle_(into.point(body.middle)) {
    const double radius = body.radius + into.error(body.coordinate_sum);
    half_ = Point::Constant(radius);
    Point half[3];
    for (int k = 0; k < 3; ++k) {
      half[k] = into.direction(body.half[k]);
      half_ += half[k].cwiseAbs();
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Point axis = into.direction(body.axes.col(int(k))).normalized();
      own_[k] = {axis, 0, radius, axis.lpNorm<1>()};
      for (const Point& side : half) own_[k].half += std::abs(axis.dot(side));
    }
  }

  /// Whether a projection separates the volume from a cell.
  bool isApart(const CellExtent& cell) const {
    const Point offset = cell.middle - middle_;
    if ((offset.cwiseAbs() - half_).maxCoeff() > cell.half) return true;
    for (const Projection& projection : own_)
      if (projection.gap(offset, cell.half) > 0) return true;
    return false;
  }

  /// A lower bound of the distance, below 0 if all projections overlap.
  double distance(const CellExtent& cell) const {
    const Point offset = cell.middle - middle_;
    const Point gap = offset.cwiseAbs() - half_ - Point::Constant(cell.half);
    double own = own_[0].gap(offset, cell.half);
    for (std::size_t k : {1, 2}) own = std::max(own, own_[k].gap(offset, cell.half));
    own -= 16 * rounding::epsilon<double>() * std::abs(own);
    const double largest = std::max(gap.maxCoeff(), own);
    return largest < 0 ? largest : std::max(distanceOfGaps(gap[0], gap[1], gap[2]), own);
  }

 private:
  Point middle_, half_;  ///< of the projections on the octree's axes
  std::array<Projection, 3> own_;
};

/// A triangle in the octree's coordinates: its box, and its corners relative to the box's centre.
class TriangleInOctree {
 public:
  using Point = fcl::Vector3d;

  TriangleInOctree(const Point& a, const Point& b, const Point& c, const IntoOctree& into)
      : corners_{into.point(a), into.point(b), into.point(c)},
        error_(into.error(a.cwiseAbs().cwiseMax(b.cwiseAbs()).cwiseMax(c.cwiseAbs()).sum())) {
    const Point low = corners_[0].cwiseMin(corners_[1]).cwiseMin(corners_[2]),
                high = corners_[0].cwiseMax(corners_[1]).cwiseMax(corners_[2]);
    middle_ = (low + high) / 2;
    half_ = (high - low) / 2 + Point::Constant(error_);
    for (Point& corner : corners_) corner -= middle_;
  }

  /// From the centre of the box to that of a cell.
  Point offset(const CellExtent& cell) const { return cell.middle - middle_; }
  /// Gaps along the octree's axes.
  Point gaps(const Point& offset, double half_cell) const {
    return offset.cwiseAbs() - half_ - Point::Constant(half_cell);
  }
  bool hasCornerIn(const Point& offset, double half_cell) const {
    return std::any_of(corners_.begin(), corners_.end(), [&](const Point& corner) {
      return (corner - offset).cwiseAbs().maxCoeff() <= half_cell;
    });
  }
  /// From corner k to the next, in units of the box: products of edges do not over- or underflow.
  Point edge(std::size_t k) const {
    return (corners_[(k + 1) % 3] - corners_[k]) / half_.maxCoeff();
  }
  Point normal() const { return edge(0).cross(edge(1)); }

  Projection projectionOn(const Point& axis) const {
    const double x = axis.dot(corners_[0]), y = axis.dot(corners_[1]), z = axis.dot(corners_[2]);
    const double low = std::min({x, y, z}), high = std::max({x, y, z});
    const double length = axis.lpNorm<1>();
    return {axis, (low + high) / 2, (high - low) / 2 + error_ * length, length};
  }

 private:
  std::array<Point, 3> corners_;
  double error_;
  Point middle_, half_;
};

/// Separating axis test of a triangle and cells. If both are disjoint, one of these axes separates
/// them: the octree's axes, the triangle's normal, and the products of its edges and the axes.
class TriangleOverlap : private TriangleInOctree {
 public:
  using Point = fcl::Vector3d;

  TriangleOverlap(const Point& a, const Point& b, const Point& c, const IntoOctree& into)
      : TriangleInOctree(a, b, c, into) {}

  bool isApart(const CellExtent& cell) {
    const Point offset = this->offset(cell);
    if (this->gaps(offset, cell.half).maxCoeff() > 0) return true;
    if (!prepared_) {
      if (this->hasCornerIn(offset, cell.half)) return false;
      prepare();
    }
    for (const Projection& projection : projections_)
      if (projection.gap(offset, cell.half) > 0) return true;
    return false;
  }

 private:
  /// Computes the projections, for cells that the boxes do not separate.
  void prepare() {
    prepared_ = true;
    projections_[0] = this->projectionOn(this->normal());
    for (std::size_t k = 0; k < 3; ++k) {
      const Point edge = this->edge(k);
      for (int axis = 0; axis < 3; ++axis)
        projections_[1 + 3 * k + std::size_t(axis)] =
            this->projectionOn(edge.cross(Point::Unit(axis)));
    }
  }

  std::array<Projection, 10> projections_;
  bool prepared_ = false;
};

/// Lower bounds of the distance of a triangle and cells: from the gaps along the octree's axes, and
/// from the gaps along the normal and across an edge in the triangle's plane.
class TriangleDistance : private TriangleInOctree {
 public:
  using Point = fcl::Vector3d;

  TriangleDistance(const Point& a, const Point& b, const Point& c, const IntoOctree& into)
      : TriangleInOctree(a, b, c, into) {
    const Point normal = unitOrZero(this->normal());
    normal_ = this->projectionOn(normal);
    for (std::size_t k = 0; k < 3; ++k)
      beside_[k] = this->projectionOn(unitOrZero(normal.cross(this->edge(k))));
  }

  /// Below 0 if all projections overlap.
  double distance(const CellExtent& cell) const {
    const Point offset = this->offset(cell), gap = this->gaps(offset, cell.half);
    const double above = normal_.gap(offset, cell.half);
    double beside = beside_[0].gap(offset, cell.half);
    for (std::size_t k : {1, 2}) beside = std::max(beside, beside_[k].gap(offset, cell.half));
    const double largest = std::max({gap.maxCoeff(), above, beside});
    if (largest < 0) return largest;
    return std::max(distanceOfGaps(gap[0], gap[1], gap[2]), distanceOfGaps(above, beside, 0.));
  }

 private:
  /// The direction of v; zero, along which all bodies overlap, if its length underflows.
  static Point unitOrZero(const Point& v) {
    const double length = v.norm();
    return length > rounding::tiny<double>() ? Point(v / length) : Point::Zero();
  }

  Projection normal_;
  std::array<Projection, 3> beside_;  ///< in the triangle's plane, across each edge
};

}  // namespace adaptive_bvh
