#pragma once

#include "triangles/convex_distance.h"
#include "triangles/shape_rays.h"
#include "triangles/shape_surface.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// Where a triangle and a shape touch.
struct ShapeContact {
  fcl::Vector3d position;  ///< a common point, up to rounding
  fcl::Vector3d normal;    ///< from the triangle to the shape, of length 1
  double depth;            ///< the shape moved so far along the normal is apart from the triangle
};

class FlatShape;
class RoundedSegment;

/// A shape, in its own frame, as the triangles of a mesh, points, rays and other shapes
/// (shape_pair.h) meet it.
class TriangleShape {
 public:
  virtual ~TriangleShape() = default;

  /// The nearest points, of the triangle and of the shape. 0 where they touch, also where the
  /// triangle is inside.
  virtual TriangleGap gap(const TrianglePoints<double>& triangle) const = 0;
  /// Whether the triangle touches the shape, and where. The depth is the least of all motions that
  /// separate.
  virtual bool touches(const TrianglePoints<double>& triangle, ShapeContact& contact) const = 0;
  /// The point of the surface that is nearest to x.
  virtual ShapeSurface surface(const fcl::Vector3d& x) const = 0;
  /// The part of a line that is in the shape.
  virtual LineInterval along(const Line& line) const = 0;
  /// A point of the shape that is farthest along a direction, of any length > 0. Infinite of a
  /// plane and a half-space.
  virtual fcl::Vector3d support(const fcl::Vector3d& direction) const = 0;

  /// The shape as one of these types, or null.
  virtual const RoundedSegment* roundedSegment() const { return nullptr; }
  virtual const FlatShape* flat() const { return nullptr; }
};

/// All that is at most `radius` from a segment on the z axis, from -half to half: a capsule, or a
/// sphere where half is 0.
class RoundedSegment final : public TriangleShape {
 public:
  RoundedSegment(double radius, double half) : radius_(radius), half_(half) {}
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  bool touches(const TrianglePoints<double>& triangle, ShapeContact& contact) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override {
    return surfaceOfRoundedSegment(x, radius_, half_);
  }
  LineInterval along(const Line& line) const override {
    return lineInRoundedSegment(line, radius_, half_);
  }
  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return fcl::Vector3d(0, 0, direction[2] < 0 ? -half_ : half_) +
           radius_ * direction.stableNormalized();
  }
  const RoundedSegment* roundedSegment() const override { return this; }
  double radius() const { return radius_; }
  /// The upper end of the segment; the lower one is its opposite.
  fcl::Vector3d end() const { return {0, 0, half_}; }

 private:
  TriangleGap coreGap(const TrianglePoints<double>& triangle) const;

  const double radius_, half_;
};

/// A box around the origin.
class BoxShape final : public TriangleShape {
 public:
  explicit BoxShape(const fcl::Vector3d& half) : half_(half) {}
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  bool touches(const TrianglePoints<double>& triangle, ShapeContact& contact) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override { return surfaceOfBox(x, half_); }
  LineInterval along(const Line& line) const override { return lineInBox(line, half_); }
  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return direction.unaryExpr([](double c) { return c < 0 ? -1. : 1.; }).cwiseProduct(half_);
  }

 private:
  const fcl::Vector3d half_;
};

/// All x with n x <= d, or with n x = d. n has length 1.
class FlatShape final : public TriangleShape {
 public:
  FlatShape(const fcl::Vector3d& n, double d, bool is_solid) : n_(n), d_(d), is_solid_(is_solid) {}
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  bool touches(const TrianglePoints<double>& triangle, ShapeContact& contact) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override {
    return is_solid_ ? surfaceOfHalfSpace(x, n_, d_) : surfaceOfPlane(x, n_, d_);
  }
  LineInterval along(const Line& line) const override {
    return is_solid_ ? lineInHalfSpace(line, n_, d_) : lineInPlane(line, n_, d_);
  }
  fcl::Vector3d support(const fcl::Vector3d& direction) const override {
    return direction * std::numeric_limits<double>::infinity();
  }
  const FlatShape* flat() const override { return this; }
  const fcl::Vector3d& normal() const { return n_; }
  double offset() const { return d_; }
  bool isSolid() const { return is_solid_; }

 private:
  /// Which corners are the lowest and the highest above the plane n x = d, and how high.
  struct Extremes {
    std::size_t lowest, highest;
    double low, high;
  };
  Extremes extremes(const TrianglePoints<double>& triangle) const;

  const fcl::Vector3d n_;
  const double d_;
  const bool is_solid_;
};

/// A convex set with a volume, to which it refers. Depths are those of ConvexSet::penetration.
class ConvexShape : public TriangleShape {
 public:
  explicit ConvexShape(const ConvexSet& set) : set_(set) {}
  bool touches(const TrianglePoints<double>& triangle, ShapeContact& contact) const final;
  fcl::Vector3d support(const fcl::Vector3d& direction) const final {
    return set_.support(direction);
  }

 protected:
  const ConvexSet& set() const { return set_; }

 private:
  const ConvexSet& set_;
};

/// A convex set with a volume whose surface is known.
class RoundSet : public ConvexSet {
 public:
  /// The point of the surface that is nearest to x.
  virtual ShapeSurface surface(const fcl::Vector3d& x) const = 0;
  /// The part of a line that is in the set.
  virtual LineInterval along(const Line& line) const = 0;

 protected:
  ~RoundSet() = default;
};

class RoundShape final : public ConvexShape {
 public:
  explicit RoundShape(const RoundSet& set) : ConvexShape(set), round_set_(set) {}
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override { return round_set_.surface(x); }
  LineInterval along(const Line& line) const override { return round_set_.along(line); }

 private:
  /// The nearest point of an edge; false where it is inside.
  bool considerEdge(const fcl::Vector3d& from, const fcl::Vector3d& to, TriangleGap& best) const;
  /// The part of the set that is nearest to the triangle's plane; false where it meets the
  /// triangle.
  bool considerFace(const TrianglePoints<double>& triangle, TriangleGap& best) const;

  const RoundSet& round_set_;
};

/// The hull of points, by its farthest points: up to the errors of convex_distance.h.
class HullShape final : public ConvexShape {
 public:
  explicit HullShape(const ConvexSet& set) : ConvexShape(set) {}
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  ShapeSurface surface(const fcl::Vector3d& x) const override {
    return surfaceOfConvexSet(x, set());
  }
  LineInterval along(const Line& line) const override { return lineInConvexSet(line, set()); }
};

}  // namespace adaptive_bvh
