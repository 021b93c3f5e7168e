#pragma once

#include <cstddef>

#include "base/pack.h"

namespace adaptive_bvh {

/// Curves as arrays of vertices; each vertex but the last begins an edge to the next one. A vertex
/// of weight 0 separates two curves: its edges do not count. All others have the weight 1.
struct BoundaryArrays {
  const double *x, *y, *z, *weight;
};

/// A point from which a boundary is seen, and an orthonormal frame (a row for each axis) whose
/// third axis is the direction of the cone's apex.
struct BoundaryView {
  double point[3], axes[3][3];
  bool is_aligned;  ///< the axes are the coordinate axes, except for the sign of the third one
  /// Upper bound of 1 / (1 + cos a)^2, where a is the angle between the apex and a vertex.
  double limit;
};

/// A sum of angles: the argument of the complex number x + iy, which is not 0, and whole turns.
/// Multiplying the numbers adds their angles.
struct BoundaryTurn {
  double x = 1, y = 0;
  long long turns = 0;

  ADAPTIVE_BVH_INLINE void multiply(const BoundaryTurn& other) {
    const double re = x * other.x - y * other.y, im = x * other.y + y * other.x;
    // Both angles are in (-pi, pi]. Only a sum of two angles of one sign leaves that range.
    if (y < 0 && other.y < 0 && (im > 0 || (im == 0 && (x < 0 || other.x < 0)))) --turns;
    if (y >= 0 && other.y >= 0 && (im < 0 || (im == 0 && x < 0 && other.x < 0))) ++turns;
    turns += other.turns;
    x = re;
    y = im;
  }
  /// Scales the number to |x| + |y| = 1, so that products stay in range.
  ADAPTIVE_BVH_INLINE void normalize() {
    const double inverse = 1 / ((x < 0 ? -x : x) + (y < 0 ? -y : y));
    x *= inverse;
    y *= inverse;
  }
};

/// Sums half the solid angles of the triangles between a boundary's edges and the apex of a cone,
/// in packs P of two or four numbers. The direction from the point to a vertex is projected
/// stereographically, from the direction opposite to the apex, to the complex number
/// z = tan(a / 2) e^(ib); a is its angle with the apex, b the azimuth around it. Half the solid
/// angle of the edge from z to w is the argument of 1 + z* w. To avoid divisions, z is stored as
/// x + iy and a depth: z = (x + iy) / depth. docs/bounds.md, 16.
template <typename P>
struct BoundaryKernel {
  static constexpr std::size_t kLanes = sizeof(P) / sizeof(double), kBlock = 256;
  /// Edges per step, for every P, so that results are the same.
  static constexpr std::size_t kStep = 4, kPacks = kStep / kLanes;

  /// Multiplies `turn` by `count` edges, a multiple of kStep and at most kBlock, from number
  /// `begin` on. Returns false if a vertex exceeds the view's limit. Edges seen under a large
  /// angle, or near the point, are not added; their numbers are appended to `skipped`.
  static bool add(const BoundaryArrays& boundary, std::size_t begin, std::size_t count,
                  const BoundaryView& view, BoundaryTurn& turn, unsigned* skipped,
                  std::size_t& num_skipped) {
    Projected z;
    const bool is_within = view.is_aligned
                               ? project<true>(boundary, begin, count + kStep, view, z)
                               : project<false>(boundary, begin, count + kStep, view, z);
    if (!is_within) return false;
    Sum sums[kPacks];
    for (std::size_t i = 0; i < count; i += kStep) {
      unsigned added = 0;
      for (std::size_t k = 0; k < kPacks; ++k)
        added |= multiply(z, i + k * kLanes, sums[k]) << k * kLanes;
      for (unsigned rest = ~added & 15; rest != 0; rest &= rest - 1)
        skipped[num_skipped++] =
            static_cast<unsigned>(begin + i) + static_cast<unsigned>(__builtin_ctz(rest));
      constexpr std::size_t kNormalizeInterval = 8 * kStep;
      if (i % kNormalizeInterval == 0)
        for (Sum& sum : sums) normalize(sum);
    }
    for (Sum& sum : sums) {
      normalize(sum);
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        turn.multiply({sum.x[lane], sum.y[lane], sum.turns[lane]});
    }
    turn.normalize();
    return true;
  }

 private:
  /// Vertices in projection.
  struct Projected {
    double x[kBlock + kStep], y[kBlock + kStep], depth[kBlock + kStep];
    /// x^2 + y^2 + depth^2. 0 between curves, where an edge then counts as added, with angle 0.
    double square[kBlock + kStep];
  };
  /// A BoundaryTurn in each lane.
  struct Sum {
    P x = filled(1), y = filled(0);
    decltype(P{} < P{}) turns{};
  };

  ADAPTIVE_BVH_INLINE static P filled(double number) { return number - P{}; }
  ADAPTIVE_BVH_INLINE static P load(const double* from) {
    P v;
    __builtin_memcpy(&v, from, sizeof(v));
    return v;
  }
  ADAPTIVE_BVH_INLINE static void store(const P& v, double* to) {
    __builtin_memcpy(to, &v, sizeof(v));
  }
  ADAPTIVE_BVH_INLINE static P squareRoot(const P& v) {
#if defined(__AVX2__)
    if constexpr (sizeof(P) == 32)
      return _mm256_sqrt_pd(v);
    else
#endif
      return packs::squareRoot(v);
  }
  /// Returns a bit for each lane in which a comparison holds.
  template <typename Mask>
  ADAPTIVE_BVH_INLINE static unsigned bits(const Mask& mask) {
#if defined(__AVX2__)
    if constexpr (sizeof(mask) == 32)
      return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
    else
#endif
      return packs::bitsOf2(mask);
  }

  /// Projects `count` vertices. Returns whether each is within the view's limit, or so near the
  /// point that its edges are skipped.
  template <bool kIsAligned>
  static bool project(const BoundaryArrays& boundary, std::size_t begin, std::size_t count,
                      const BoundaryView& view, Projected& z) {
    const P limit = filled(view.limit), one = filled(1), kNear = filled(0x1p-80);
    auto is_within = limit > P{};
    for (std::size_t i = 0; i < count; i += kLanes) {
      const P dx = load(boundary.x + begin + i) - view.point[0],
              dy = load(boundary.y + begin + i) - view.point[1],
              dz = load(boundary.z + begin + i) - view.point[2],
              weight = load(boundary.weight + begin + i);
      const auto alongAxis = [&](int k) -> P {
        if constexpr (kIsAligned) return k == 0 ? dx : k == 1 ? dy : dz * view.axes[2][2];
        return dx * view.axes[k][0] + dy * view.axes[k][1] + dz * view.axes[k][2];
      };
      const P square = dx * dx + dy * dy + dz * dz;
      const P depth = weight * (squareRoot(square) + alongAxis(2)) + (one - weight),
              x = weight * alongAxis(0), y = weight * alongAxis(1);
      const P xy_square = x * x + y * y, depth_square = depth * depth;
      // Products of several lengths would underflow: a large `square` excludes the vertex's edges.
      const auto is_near = square < kNear;
      is_within &= (weight * square < limit * depth_square) | is_near;
      store(x, z.x + i);
      store(y, z.y + i);
      store(depth, z.depth + i);
      store(weight * (is_near ? limit * depth_square : depth_square + xy_square), z.square + i);
    }
    constexpr unsigned kAll = (1u << kLanes) - 1;
    return bits(is_within) == kAll;
  }

  /// Multiplies `sum` by 1 + z* w for the edges from number i on. Returns a bit for each edge that
  /// was added: the vectors (depth, x, y) of its ends are less than 60 degrees apart.
  ADAPTIVE_BVH_INLINE static unsigned multiply(const Projected& z, std::size_t i, Sum& sum) {
    const P zx = load(z.x + i), zy = load(z.y + i), wx = load(z.x + i + 1), wy = load(z.y + i + 1),
            zero{}, one = filled(1);
    P x = load(z.depth + i) * load(z.depth + i + 1) + zx * wx + zy * wy, y = zx * wy - zy * wx;
    const auto is_added =
        (x > zero) & (filled(4) * x * x > load(z.square + i) * load(z.square + i + 1));
    x = is_added ? x : one;
    y = is_added ? y : zero;
    const P re = sum.x * x - sum.y * y, im = sum.x * y + sum.y * x;
    // A true comparison is -1. The angle of x + iy is less than a quarter turn. So the sum leaves
    // the range (-pi, pi] if the imaginary part changes its sign and the real part is negative.
    sum.turns += (re < zero) & ((sum.y < zero) - (im < zero));
    sum.x = re;
    sum.y = im;
    return bits(is_added);
  }
  ADAPTIVE_BVH_INLINE static void normalize(Sum& sum) {
    const auto absolute = [](const P& v) -> P { return v < P{} ? -v : v; };
    const P inverse = filled(1) / (absolute(sum.x) + absolute(sum.y));
    sum.x *= inverse;
    sum.y *= inverse;
  }
};

/// The type of BoundaryKernel::add.
using AddBoundary = bool (*)(const BoundaryArrays&, std::size_t, std::size_t, const BoundaryView&,
                             BoundaryTurn&, unsigned*, std::size_t&);

/// The kernel of the widest packs that this processor has.
AddBoundary addBoundary();

}  // namespace adaptive_bvh
