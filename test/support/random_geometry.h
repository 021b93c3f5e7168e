#pragma once

#include <array>
#include <cmath>
#include <random>

#include <fcl/math/bv/RSS.h>

#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {

/// Random bodies of all sizes and shapes, for tests of bounds.
template <typename S>
class RandomGeometryOf {
 public:
  using P = fcl::Vector3<S>;

  explicit RandomGeometryOf(unsigned seed) : random_(testSeed(seed)) {}

  std::mt19937& engine() { return random_; }
  S uniform(S low = -1, S high = 1) {
    return std::uniform_real_distribution<S>(low, high)(random_);
  }
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  bool oneIn(int count) { return below(count) == 0; }

  /// 10^x for an x between the two: every size is as likely.
  S size(double low, double high) {
    return S(std::pow(10., std::uniform_real_distribution<double>(low, high)(random_)));
  }
  P point() { return {uniform(), uniform(), uniform()}; }
  P direction() {
    for (;;) {
      const P p = point();
      if (p.norm() > S(0.1)) return p.normalized();
    }
  }
  /// Of three numbers at most one is 0, now and then all are equal: so edges lie along axes, too.
  P vectorOfSize(S size) {
    P v = point() * size;
    if (oneIn(4)) v = P::Unit(below(3)) * size;
    if (oneIn(8)) v = P::Constant(size);
    return v;
  }

  /// A triangle with this first corner, of any shape: general, a needle, a segment, a point, one
  /// along the axes.
  std::array<P, 3> triangleAt(const P& p, S size) {
    const P u = vectorOfSize(size);
    P v = vectorOfSize(size);
    const int kind = below(8);
    if (kind == 0) v = u * S(0.3) + point() * size * this->size(-9, -2);
    if (kind == 1) v = u * S(0.3);
    if (kind == 2) v = u;
    return {p, p + u, kind == 3 ? p : P(p + v)};
  }

  /// Any rotation, or one by almost nothing, or none, or by quarter turns.
  fcl::Matrix3<S> rotation() {
    switch (below(4)) {
      case 0: return fcl::Matrix3<S>::Identity();
      case 1: return Eigen::AngleAxis<S>(size(-9, -3), direction()).toRotationMatrix();
      case 2:
        return Eigen::AngleAxis<S>(S(M_PI / 2) * S(below(4)), P::Unit(below(3))).toRotationMatrix();
      default: return randomPose(random_, 0).linear().template cast<S>();
    }
  }
  fcl::Transform3<S> pose(S reach) {
    fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
    tf.linear() = rotation();
    tf.translation() = point() * reach;
    return tf;
  }

  /// A volume of about a size, of any proportions: a ball, a needle, a sheet, a point.
  fcl::RSS<S> volume(S size, S offset) {
    fcl::RSS<S> bv;
    bv.axis = rotation();
    bv.To = point() * offset;
    for (S* length : {&bv.l[0], &bv.l[1], &bv.r}) {
      const int kind = below(4);
      *length = kind == 0 ? S(0) : kind == 1 ? size * this->size(-6, 0) : size * uniform(0, 1);
    }
    return bv;
  }

 private:
  std::mt19937 random_;
};

using RandomGeometry = RandomGeometryOf<double>;

}  // namespace adaptive_bvh_test
