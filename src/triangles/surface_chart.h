#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// Bounds how far a curved patch bulges beyond the triangle with the same corners: every point of
/// the patch is the sum of a point of the triangle and a point of the convex hull of 0 and these
/// vectors.
struct Bulge {
  std::array<fcl::Vector3d, 3> offsets;
  int count = 0;      ///< number of vectors
  double height = 0;  ///< length of the longest vector

  void add(const fcl::Vector3d& offset) {
    offsets[static_cast<std::size_t>(count++)] = offset;
    height = std::max(height, offset.norm());
  }
};

/// A part of a shape's surface as the image of a planar parameter domain, which is divided into
/// triangles.
class SurfaceChart {
 public:
  using Vector = fcl::Vector3d;

  /// Flat surface: a parameter is the surface point itself.
  static SurfaceChart flat() { return {Kind::Flat, Vector::Zero(), Vector::Zero()}; }
  /// Ellipsoid: a parameter is a point of the unit sphere. It is scaled by the radii and translated
  /// by the center.
  static SurfaceChart round(const Vector& center, const Vector& radii) {
    return {Kind::Round, center, radii};
  }
  /// A disk around the z axis. A parameter is (x, y, w) with w = 1 on the rim, else 0. The patch of
  /// a triangle with two corners on the rim extends to the rim.
  static SurfaceChart disk(double radius, double z) {
    return {Kind::Disk, Vector(radius, 0, z), Vector::Zero()};
  }
  /// A surface of revolution: the line between two points (radius, z), rotated around the z axis. A
  /// parameter is the position on the line, from 0 to 1, and an angle.
  static SurfaceChart turned(double radius0, double z0, double radius1, double z1) {
    return {Kind::Turned, Vector(radius0, 0, z0), Vector(radius1, 0, z1)};
  }

  bool operator==(const SurfaceChart& other) const {
    return kind_ == other.kind_ && a_ == other.a_ && b_ == other.b_;
  }

  /// The surface point of a parameter.
  Vector operator()(const Vector& parameter) const {
    if (kind_ == Kind::Flat) return parameter;
    if (kind_ == Kind::Disk) return {parameter[0], parameter[1], a_[2]};
    if (kind_ == Kind::Round) return a_ + b_.cwiseProduct(parameter);
    const Vector p = a_ + parameter[0] * (b_ - a_);
    return {p[0] * std::cos(parameter[1]), p[0] * std::sin(parameter[1]), p[2]};
  }
  /// The parameter that divides the edge from p to q at `share`. If a triangle is divided there,
  /// the patches of both parts cover its patch.
  Vector between(const Vector& p, const Vector& q, double share) const {
    Vector linear = p + share * (q - p);
    if (kind_ == Kind::Round) return linear.normalized();
    if (kind_ == Kind::Disk) {
      const bool is_rim = p[2] + q[2] == 2;  // both ends are on the rim: so is the new point
      const double stretch = is_rim ? a_[0] / std::hypot(linear[0], linear[1]) : 1;
      return {stretch * linear[0], stretch * linear[1], is_rim ? 1. : 0.};
    }
    if (kind_ == Kind::Turned) {  // angles are weighted by the radii
      const double weight_p = (1 - share) * radiusAt(p), weight_q = share * radiusAt(q);
      if (weight_p + weight_q > 0)
        linear[1] = p[1] + weight_q / (weight_p + weight_q) * (q[1] - p[1]);
    }
    return linear;
  }
  /// The number of patches into which to divide a full turn around the axis; 0 for a flat surface.
  int patchesOfTurn() const {
    if (kind_ == Kind::Flat) return 0;
    return kind_ == Kind::Round ? 4 : 8;
  }
  /// A length of the edge from p to q, for choosing which edge of a triangle to divide.
  double length(const Vector& p, const Vector& q) const {
    if (kind_ == Kind::Round) return b_.maxCoeff() * (q - p).norm();
    return ((*this)(q) - (*this)(p)).norm();
  }
  /// The bulge of the patch over a triangle of parameters: docs/bounds.md, 19.
  Bulge bulge(const Vector& p, const Vector& q, const Vector& r) const {
    if (kind_ == Kind::Flat) return {};
    if (kind_ == Kind::Round) return roundBulge(p, q, r);
    return kind_ == Kind::Disk ? rimBulge(p, q, r) : turnedBulge(p, q, r);
  }

 private:
  enum class Kind { Flat, Round, Turned, Disk };
  SurfaceChart(Kind kind, const Vector& a, const Vector& b) : kind_(kind), a_(a), b_(b) {}

  /// The radius of a surface of revolution at a parameter.
  double radiusAt(const Vector& parameter) const { return a_[0] + parameter[0] * (b_[0] - a_[0]); }

  /// The patch of the unit sphere is the triangle, each point x moved outward to x / |x|: by no
  /// more than 1 / least - 1 times x, where `least` is the least |x|. With the barycentric
  /// coordinates l and the edges e of the triangle, |x|^2 is 1 - sum l_i l_j e_ij^2: at least 1
  /// minus a third of the square of the longest edge.
  Bulge roundBulge(const Vector& p, const Vector& q, const Vector& r) const {
    const double square =
        std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()}) / 3;
    const double least = std::sqrt(std::max(0., 1 - square)),
                 share = square / (1 + least) / least;  // 1 / least - 1
    Bulge bulge;
    for (const Vector& corner : {p, q, r}) bulge.add(kSlack * share * b_.cwiseProduct(corner));
    return bulge;
  }
  /// The bulge up to the arc over the edge whose ends are on the rim.
  Bulge rimBulge(const Vector& p, const Vector& q, const Vector& r) const {
    Bulge bulge;
    const auto addArc = [&](const Vector& from, const Vector& to) {
      const double half = std::hypot(to[0] - from[0], to[1] - from[1]) / 2;
      if (from[2] + to[2] != 2 || half == 0) return;
      const Vector outward = Vector(from[0] + to[0], from[1] + to[1], 0).normalized();
      // The height of the arc is radius - chord_distance, without cancellation.
      const double chord_distance = std::sqrt(std::max(0., (a_[0] - half) * (a_[0] + half)));
      bulge.add(kSlack * half * half / (a_[0] + chord_distance) * outward);
    };
    addArc(p, q);
    addArc(q, r);
    addArc(r, p);
    return bulge;
  }
  /// The bulge by the second derivative along the angle: its length is the radius, and it points
  /// towards the axis, in a direction between those at the least and the greatest angle. Along the
  /// line the surface does not bend. Corners on the axis are skipped: their angle is undefined.
  Bulge turnedBulge(const Vector& p, const Vector& q, const Vector& r) const {
    double low = 0, high = 0, radius = 0;  // range of the angles, and largest radius
    for (const Vector& corner : {p, q, r}) {
      const double corner_radius = radiusAt(corner);
      if (!(corner_radius > 0)) continue;
      low = radius > 0 ? std::min(low, corner[1]) : corner[1];
      high = radius > 0 ? std::max(high, corner[1]) : corner[1];
      radius = std::max(radius, corner_radius);
    }
    const double middle = (low + high) / 2, half = (high - low) / 2,
                 height = kSlack * radius * half * half / 2, tangent = std::tan(half);
    const Vector outward(std::cos(middle), std::sin(middle), 0), around(-outward[1], outward[0], 0);
    Bulge bulge;
    for (const double t : {-tangent, tangent}) bulge.add(height * (outward + t * around));
    return bulge;
  }

  static constexpr double kSlack = 1 + 1e-9;  ///< exceeds the rounding errors of a bulge

  Kind kind_;
  /// The numbers of the surface. Round: centre and radii. Disk: a_ = (radius, -, z). Turned: the
  /// ends (radius, -, z) of the line.
  Vector a_, b_;
};

}  // namespace adaptive_bvh
