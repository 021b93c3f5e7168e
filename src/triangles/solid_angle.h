#pragma once

#include <cmath>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The solid angle of a triangle as a point sees it, in numbers of type Real: from -2 pi to 2 pi,
/// positive where the point is behind the face (inside, where faces show outward). 0 or 2 pi of
/// points in its plane. Twice the argument of a complex number (Van Oosterom and Strackee 1983,
/// "The solid angle of a plane triangle").
///
/// With the unit roundoff u of Real, both parts of that number are off by at most 16 u pqr, pqr the
/// product of the distances of the corners. Its size is 4 pqr times the cosines of half the angles
/// between the corners: near an edge, one of these is small, and what is rounded counts for more.
template <typename Real>
class SolidAngle {
 public:
  using Point = Eigen::Matrix<Real, 3, 1>;

  /// Corners, seen from the point.
  SolidAngle(const Point& p, const Point& q, const Point& r) {
    const Real pn = p.norm(), qn = q.norm(), rn = r.norm();
    size_ = pn * qn * rn;
    imaginary_ = p.dot(q.cross(r));
    real_ = size_ + p.dot(q) * rn + q.dot(r) * pn + r.dot(p) * qn;
  }

  Real value() const { return 2 * std::atan2(imaginary_, real_); }
  /// Whether the value is off by at most 512 u.
  bool isPrecise() const {
    return std::fabs(imaginary_) + std::fabs(real_) >= size_ * Real(1. / 8);
  }

 private:
  Real size_, real_, imaginary_;
};

/// The solid angle of a triangle, off by at most 2^-44, or near an edge by what long double rounds.
/// `scale`: a power of two that brings lengths near 1, so that products neither overflow nor
/// underflow.
template <typename S>
double solidAngle(const fcl::Vector3<S>& a, const fcl::Vector3<S>& b, const fcl::Vector3<S>& c,
                  const fcl::Vector3d& x, double scale) {
  const auto in = [&](auto real) {
    using Real = decltype(real);
    const auto seen = [&](const fcl::Vector3<S>& corner) -> typename SolidAngle<Real>::Point {
      return (corner.template cast<Real>() - x.template cast<Real>()) * Real(scale);
    };
    return SolidAngle<Real>(seen(a), seen(b), seen(c));
  };
  const SolidAngle<double> angle = in(0.);
  return angle.isPrecise() ? angle.value() : static_cast<double>(in(0.L).value());
}

}  // namespace adaptive_bvh
