#pragma once

#include <cmath>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The solid angle of a triangle as a point sees it, computed in numbers of type Real: from -2 pi
/// to 2 pi, positive where the point is behind the face (inside, where faces show outward). Van
/// Oosterom and Strackee 1983, "The solid angle of a plane triangle". 0 or 2 pi of points in its
/// plane.
template <typename Real, typename S>
Real solidAngle(const fcl::Vector3<S>& a, const fcl::Vector3<S>& b, const fcl::Vector3<S>& c,
                const fcl::Vector3d& x) {
  using Point = Eigen::Matrix<Real, 3, 1>;
  const Point at = x.template cast<Real>(), p = a.template cast<Real>() - at,
              q = b.template cast<Real>() - at, r = c.template cast<Real>() - at;
  const Real pn = p.norm(), qn = q.norm(), rn = r.norm();
  return 2 * std::atan2(p.dot(q.cross(r)),
                        pn * qn * rn + p.dot(q) * rn + q.dot(r) * pn + r.dot(p) * qn);
}

}  // namespace adaptive_bvh
