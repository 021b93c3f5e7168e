#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include <fcl/math/triangle.h>

namespace adaptive_bvh_test {

using Point = fcl::Vector3d;
using Points = std::vector<Point>;

#define REQUIRE(condition)                                                                \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)

/// The input, number by number; zeros when it is used up.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  bool isEmpty() const { return left_ == 0; }
  int byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  /// From 0 to count - 1.
  int below(int count) { return byte() % count; }
  bool oneIn(int count) { return below(count) == count - 1; }

  /// Most are tenths, as CAD data has them, or eighths; some are not usable at all, or hardly.
  double coordinate() {
    const int b = byte();
    if (b < 120) return (b - 60) / 10.;
    if (b < 240) return (b - 180) / 8.;
    constexpr double inf = std::numeric_limits<double>::infinity();
    const double odd[] = {inf,    -inf,  std::nan(""), 1e77, -1e200, 7e75, -7e75, 1e-300,
                          5e-324, -1e-9, 0.,           -0.,  1e6,    1e9,  0.125, 1e20};
    return odd[b - 240];
  }
  Point point() {
    const double x = coordinate(), y = coordinate();
    return {x, y, coordinate()};
  }
  Points points(int count) {
    Points points;
    for (int i = 0; i < count; ++i) points.push_back(i > 0 && oneIn(8) ? points.back() : point());
    return points;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

inline bool isUsable(const Points& points) {
  for (const Point& p : points)
    for (double x : p)
      if (!(std::abs(x) <= std::ldexp(1., 252))) return false;
  return true;
}

/// Tenths and eighths, up to rounding: on these, tolerances mean something.
inline bool isPlain(double x) {
  return std::abs(x) <= 16 && std::abs(x * 40 - std::round(x * 40)) < 1e-9;
}
inline bool isEighth(double x) { return x * 8 == std::round(x * 8); }

inline bool same(const Points& a, const Points& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0);
}

inline fcl::Transform3d pose(Bytes& in) {
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  const double half = in.below(64) * 0.1;
  tf.rotate(Eigen::AngleAxisd(half, fcl::Vector3d(1, 2, 3).normalized()));
  tf.translation() = fcl::Vector3d(in.below(64) / 4. - 8, in.below(64) / 4. - 8, 0.5);
  return tf;
}

}  // namespace adaptive_bvh_test
