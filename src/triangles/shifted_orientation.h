#pragma once

#include "triangles/orientation.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// Which of two bodies a point, an edge or a face belongs to.
enum class Operand : unsigned { First = 0, Second = 1 };

namespace orientations {

/// The sign of component k of (b - a) x (d - c), without any error.
inline int crossSign(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                     const fcl::Vector3d& d, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const double left = (b[i] - a[i]) * (d[j] - c[j]), right = (b[j] - a[j]) * (d[i] - c[i]);
  const double value = left - right, size = std::fabs(left) + std::fabs(right);
  if (size > 0x1p-900 && size < 0x1p1000 && std::fabs(value) > 0x1p-50 * size)
    return value > 0 ? 1 : -1;
  ExactSum sum;
  for (const auto& p : {std::make_pair(&b, false), std::make_pair(&a, true)})
    for (const auto& q : {std::make_pair(&d, false), std::make_pair(&c, true)}) {
      const bool is_negative = p.second != q.second;
      is_negative ? sum.subtract((*p.first)[i], (*q.first)[j], 1)
                  : sum.add((*p.first)[i], (*q.first)[j], 1);
      is_negative ? sum.add((*p.first)[j], (*q.first)[i], 1)
                  : sum.subtract((*p.first)[j], (*q.first)[i], 1);
    }
  return sum.sign();
}

}  // namespace orientations

/// The sign of an orientation, where it is 0 that which it gets when the first body moves by an
/// infinitely small step along x, or, where that changes nothing, along y, or z. This one rule
/// breaks all ties. A real motion would do the same: so what is decided is free of contradictions.
/// (Simulation of simplicity: Edelsbrunner and Muecke 1990, here by a common shift.) The derivative
/// by the step is (b - a) x (d - c), or its opposite.
inline int brokenTie(double orientation, const fcl::Vector3d& a, const fcl::Vector3d& b,
                     const fcl::Vector3d& c, const fcl::Vector3d& d, bool is_opposite) {
  if (orientation != 0) return orientation > 0 ? 1 : -1;
  for (int k = 0; k < 3; ++k)
    if (const int sign = orientations::crossSign(a, b, c, d, k)) return is_opposite ? -sign : sign;
  return 0;
}

/// Where a point of the one body lies seen from a face of the other.
struct FaceSide {
  double value;  ///< its orientation, which may be 0
  int sign;      ///< 1 behind the face, -1 in front of it; 0 only of a face without area
};
/// `body`: the point's.
inline FaceSide sideOfFace(const TrianglePoints<double>& face, const fcl::Vector3d& point,
                           Operand body) {
  const double value = orientation(face[0], face[1], face[2], point);
  return {value, brokenTie(value, face[0], face[1], face[0], face[2], body == Operand::First)};
}

/// On which side of the line through an edge that of another body's edge passes. `body`: of the
/// first edge. 0 only where the edges are parallel.
inline int passingSide(const fcl::Vector3d& p, const fcl::Vector3d& q, const fcl::Vector3d& a,
                       const fcl::Vector3d& b, Operand body) {
  // By a shift of p and q the determinant changes by that times (q - p) x (a - b).
  return brokenTie(orientation(p, q, a, b), p, q, b, a, body == Operand::Second);
}

/// Whether an edge that crosses the plane of a face passes within it. `body`: the edge's.
inline bool passesWithin(const fcl::Vector3d& p, const fcl::Vector3d& q,
                         const TrianglePoints<double>& face, Operand body) {
  const int side = passingSide(p, q, face[0], face[1], body);
  return side == passingSide(p, q, face[1], face[2], body) &&
         side == passingSide(p, q, face[2], face[0], body);
}

}  // namespace adaptive_bvh
