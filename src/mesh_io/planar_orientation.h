#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace adaptive_bvh {

/// A point of the plane.
struct PlanarPoint {
  double x, y;
};

inline bool operator==(const PlanarPoint& a, const PlanarPoint& b) {
  return a.x == b.x && a.y == b.y;
}

/// The sum of a few products, exact: numbers that do not overlap, the largest last (an "expansion"
/// of J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
/// predicates", 1997).
class ExpansionSum {
 public:
  void addProduct(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }

  int sign() const {
    for (std::size_t k = size_; k-- > 0;)
      if (terms_[k] != 0) return terms_[k] > 0 ? 1 : -1;
    return 0;
  }

 private:
  void add(double number) {
    for (std::size_t k = 0; k < size_; ++k) {  // Knuth's TwoSum with each term
      const double sum = number + terms_[k], other = sum - number;
      terms_[k] = (number - (sum - other)) + (terms_[k] - other);
      number = sum;
    }
    terms_[size_++] = number;
  }

  std::array<double, 12> terms_;
  std::size_t size_ = 0;
};

/// 1 where three points are counter-clockwise, -1 where they are clockwise, 0 on one line. Exact
/// for coordinates of at most 1 whose products do not underflow.
inline int planarOrientation(const PlanarPoint& a, const PlanarPoint& b, const PlanarPoint& c) {
  const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
  const double determinant = left - right, size = std::fabs(left) + std::fabs(right);
  // The paper has (3 + 16 u) u times the size, with u = 2^-53.
  if (size > 0x1p-900 && std::fabs(determinant) > 0x1p-51 * size) return determinant > 0 ? 1 : -1;
  ExpansionSum sum;
  sum.addProduct(a.x, b.y);
  sum.addProduct(-a.x, c.y);
  sum.addProduct(-c.x, b.y);
  sum.addProduct(-a.y, b.x);
  sum.addProduct(a.y, c.x);
  sum.addProduct(c.y, b.x);
  return sum.sign();
}

}  // namespace adaptive_bvh
