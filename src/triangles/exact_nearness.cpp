#include "triangles/exact_nearness.h"

#include <optional>

#include "triangles/exact_number.h"
#include "triangles/orientation.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {
namespace {

/// Decides about features by differences of their corners and the distance, in exact arithmetic:
/// integers, or ExactNumber. `Number` holds products of three of these numbers, `Wide` of six.
/// `Limit` compares: admits(n, m) is n <= m times the squared distance. What is nearest lies inside
/// of both features, or at the end of one: a vertex of a face, or an edge and a side, and so on. So
/// only squared distances from points, lines and planes are compared.
template <typename Number, typename Wide, typename Limit>
class Tests {
 public:
  using Vector = std::array<Number, 3>;

  explicit Tests(const Limit& limit) : limit_(limit) {}

  /// Whether the point w is near the origin.
  bool point(const Vector& w) const { return limit_.admits(dot<Wide>(w, w), Wide(1)); }
  /// Whether the point w is near the segment from the origin to u.
  bool segment(const Vector& w, const Vector& u) const {
    const Wide along = dot<Wide>(w, u), length = dot<Wide>(u, u);
    if (!(Wide(0) < along)) return point(w);
    if (!(along < length)) return point(minus(w, u));
    const Vector across = cross(w, u);
    return limit_.admits(dot<Wide>(across, across), length);
  }
  /// Whether the point w is near the face of the origin, u and v.
  bool face(const Vector& w, const Vector& u, const Vector& v) const {
    const Answer answer = plane(w, u, v, true);
    if (answer != Answer::Outside) return answer == Answer::Near;
    return segment(w, u) || segment(w, v) || segment(minus(w, u), minus(v, u));
  }
  /// Whether the edge from the origin to u is near that from w to w - v.
  bool edges(const Vector& w, const Vector& u, const Vector& v) const {
    const Answer answer = plane(w, u, v, false);
    if (answer != Answer::Outside) return answer == Answer::Near;
    return segment(w, u) || segment(w, v) || segment(minus(w, v), u) || segment(minus(w, u), v);
  }

  static Vector minus(const Vector& a, const Vector& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }

 private:
  enum class Answer { Near, Farther, Outside };

  /// Compares the distance of w from the plane of u and v; its foot there is s u + t v. Outside: if
  /// the foot is not in the triangle (s + t <= 1) or parallelogram of both, or there is no plane.
  Answer plane(const Vector& w, const Vector& u, const Vector& v, bool is_triangle) const {
    const Vector n = cross(u, v);
    const Number height = dot<Number>(n, w);
    const Wide nn = dot<Wide>(n, n);
    if (!limit_.admits(Wide(height) * height, nn)) return Answer::Farther;
    const Wide s = dot<Wide>(cross(w, v), n), t = dot<Wide>(cross(u, w), n);  // times nn
    if (!(Wide(0) < nn) || s < Wide(0) || t < Wide(0)) return Answer::Outside;
    const bool is_inside = is_triangle ? !(nn < s + t) : !(nn < s) && !(nn < t);
    return is_inside ? Answer::Near : Answer::Outside;
  }
  template <typename Result>
  static Result dot(const Vector& a, const Vector& b) {
    return Result(a[0]) * b[0] + Result(a[1]) * b[1] + Result(a[2]) * b[2];
  }
  static Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }

  const Limit& limit_;
};

__extension__ typedef __int128 Int128;

/// Of integers n < 2^126 and m < 2^84, and a distance x < 2^20.
class GridLimit {
 public:
  explicit GridLimit(double x) {
    const double integer = std::floor(x), rest = x - integer;
    const double more = 2 * integer * rest + rest * rest, floor = std::floor(more);
    whole_ = static_cast<std::int64_t>(integer) * static_cast<std::int64_t>(integer) +
             static_cast<std::int64_t>(floor);
    fraction_ = more - floor;
    is_exact_ = rest == 0;
  }

  /// Where `more`, off by less than 2^-30, leaves it open, sets isOpen().
  bool admits(Int128 n, Int128 m) const {
    const Int128 excess = n - whole_ * m;
    if (is_exact_ || m == 0) return excess <= 0;
    const double left = static_cast<double>(excess) - fraction_ * static_cast<double>(m);
    is_open_ |= !(std::fabs(left) > 0x1p-28 * static_cast<double>(m));
    return left < 0;
  }
  bool isOpen() const { return is_open_; }

 private:
  std::int64_t whole_;  ///< the squared distance is whole_ + fraction_
  double fraction_;
  bool is_exact_;
  mutable bool is_open_ = false;
};

/// Of any numbers.
class SumLimit {
 public:
  explicit SumLimit(const ExactNumber& distance) : square_(distance * distance) {}

  bool admits(const ExactNumber& n, const ExactNumber& m) const { return !(square_ * m < n); }

 private:
  const ExactNumber square_;
};

using GridTests = Tests<std::int64_t, Int128, GridLimit>;
using SumTests = Tests<ExactNumber, ExactNumber, SumLimit>;

/// Points as multiples of a power of two. Coordinates relative to the first point are below 2^19,
/// so all differences are below 2^20, like the distance. So components of u x v are below 2^41,
/// products of three vectors below 3 * 2^61, and the square of that and all else below 2^126.
template <std::size_t kPoints>
class Grid {
 public:
  using Points = std::array<const fcl::Vector3d*, kPoints>;

  Grid(const Points& points, double distance) {
    double extent = distance / 2;
    for (const fcl::Vector3d* x : points)
      extent = std::max(extent, (*x - *points[0]).template lpNorm<Eigen::Infinity>());
    if (!(extent > 0x1p-200 && extent < 0x1p60)) return;
    up_ = std::ldexp(1, 18 - std::ilogb(extent));
    is_exact_ = true;
    for (std::size_t i = 0; i < kPoints && is_exact_; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        is_exact_ &= convert((*points[i])[Eigen::Index(k)], points_[i][k]);
  }
  /// Whether all points are such multiples.
  bool isExact() const { return is_exact_; }
  /// The inverse of the power of two; 0 if that is out of range.
  double scale() const { return up_; }
  GridTests::Vector operator()(std::size_t i, std::size_t j) const {
    return GridTests::minus(points_[i], points_[j]);
  }

 private:
  bool convert(double x, std::int64_t& to) const {
    const double multiple = x * up_;
    if (!(std::fabs(multiple) < 0x1p53)) return false;
    to = static_cast<std::int64_t>(multiple);
    return static_cast<double>(to) == multiple && (to != 0 || x == 0);  // unless it underflows
  }

  double up_ = 0;
  bool is_exact_ = false;
  std::array<GridTests::Vector, kPoints> points_;
};

/// What the gaps of two triangles along the axes say: that they are near or not, if that is
/// certain. A rounded gap is above the distance only if the gap is, and below it only if that is
/// not. `is_open`: compares triangles across an axis, too: on the plane of the first, they may
/// touch.
std::optional<bool> byAxes(TrianglePoints a, const TrianglePoints& b, double distance,
                           bool is_open) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto [low1, high1] = std::minmax({a[0][k], a[1][k], a[2][k]});
    const auto [low2, high2] = std::minmax({b[0][k], b[1][k], b[2][k]});
    const double from = low2 < low1 ? high2 : high1, to = low2 < low1 ? low1 : low2;
    const double gap = to - from;
    if (gap > distance) return false;
    if (!is_open || low1 != high1 || low2 != high2) continue;
    const bool is_exact = orientations::isExact(to, from, gap);
    if (!(gap < distance || is_exact)) continue;
    for (fcl::Vector3d& x : a) {
      x[k] = low2;
      if (x == b[0] || x == b[1] || x == b[2]) return true;  // usual on lattices
    }
    if (touch(a, b)) return true;
    if (gap == distance && is_exact) return false;
    for (fcl::Vector3d& x : a) x[k] = low1;
  }
  return std::nullopt;
}

/// Calls decide(tests, difference), where difference(i, j) is points[i] - points[j], if the axes
/// leave it open for triangles a and b that repeat corners of the features.
template <std::size_t kPoints, typename Decide>
bool decideExactly(const TrianglePoints& a, const TrianglePoints& b,
                   const std::array<const fcl::Vector3d*, kPoints>& points, double distance,
                   const Decide& decide) {
  const Grid<kPoints> grid(points, distance);
  if (const std::optional<bool> is_near = byAxes(a, b, distance, !grid.isExact())) return *is_near;
  if (isTaken(Shortcut::RoundedPredicates) && grid.isExact()) {
    const GridLimit limit(distance * grid.scale());
    const bool is_near = decide(GridTests(limit), grid);
    if (!limit.isOpen()) return is_near;
  }
  // Usual differences take one limb of ExactNumber, below 2^62. The scale is at least 1.
  const double scale = grid.scale() > 0 ? grid.scale() * 0x1p42 : 1;
  const SumLimit limit(distance * scale);
  return decide(SumTests(limit), [&](std::size_t i, std::size_t j) -> SumTests::Vector {
    const auto sum = [&](Eigen::Index k) -> ExactNumber {
      return ExactNumber((*points[i])[k] * scale) - (*points[j])[k] * scale;
    };
    return {sum(0), sum(1), sum(2)};
  });
}

}  // namespace

bool ExactNearness::areNear(const fcl::Vector3d& x, const TrianglePoints& face) const {
  return decideExactly<4>(
      {x, x, x}, face, {&x, &face[0], &face[1], &face[2]}, distance_,
      [](const auto& test, const auto& to) { return test.face(to(0, 1), to(2, 1), to(3, 1)); });
}

bool ExactNearness::areNear(const Segment& a, const Segment& b) const {
  return decideExactly<4>(
      {a[0], a[1], a[1]}, {b[0], b[1], b[1]}, {&a[0], &a[1], &b[0], &b[1]}, distance_,
      [](const auto& test, const auto& to) { return test.edges(to(2, 0), to(1, 0), to(2, 3)); });
}

bool ExactNearness::areTrianglesNear(const TrianglePoints& a, const TrianglePoints& b) const {
  return decideExactly<6>(
      a, b, {&a[0], &a[1], &a[2], &b[0], &b[1], &b[2]}, distance_,
      [](const auto& test, const auto& to) {
        for (std::size_t i = 0; i < 3; ++i)  // cheap, and often near
          for (std::size_t j = 3; j < 6; ++j)
            if (test.point(to(i, j))) return true;
        for (std::size_t i = 0; i < 3; ++i)
          if (test.face(to(i, 3), to(4, 3), to(5, 3)) ||
              test.face(to(i + 3, 0), to(1, 0), to(2, 0)))
            return true;
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            if (test.edges(to(j + 3, i), to((i + 1) % 3, i), to(j + 3, (j + 1) % 3 + 3)))
              return true;
        return false;
      });
}

}  // namespace adaptive_bvh
