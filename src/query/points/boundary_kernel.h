#pragma once

#include <cstddef>

#include "base/pack.h"

namespace adaptive_bvh {

/// Curves as arrays of vertices; each vertex but the last begins an edge to the next one. A vertex
/// of weight 0 stands between two curves: its edges count nothing. All others have the weight 1.
struct BoundaryArrays {
  const double *x, *y, *z, *weight;
};

/// A point that sees a boundary, and an orthonormal frame whose third axis is the direction of the
/// cone's apex.
struct BoundaryView {
  double at[3], axes[3][3];
  /// Whether the frame's axes are those of the coordinates, apart from the third one's sign.
  bool is_aligned;
  /// Bound of 1 / (1 + cos a)^2, a the angle between the apex and a vertex.
  double limit;
};

/// The angle of a complex number that is not 0, and whole turns. Numbers are multiplied in place of
/// the angles' sum.
struct BoundaryTurn {
  double x = 1, y = 0;
  long long turns = 0;

  ADAPTIVE_BVH_INLINE void multiply(const BoundaryTurn& by) {
    const double re = x * by.x - y * by.y, im = x * by.y + y * by.x;
    // Both angles are above -pi, and pi at most. Only the sum of two of one sign leaves that range.
    if (y < 0 && by.y < 0 && (im > 0 || (im == 0 && (x < 0 || by.x < 0)))) --turns;
    if (y >= 0 && by.y >= 0 && (im < 0 || (im == 0 && x < 0 && by.x < 0))) ++turns;
    turns += by.turns;
    x = re;
    y = im;
  }
  ADAPTIVE_BVH_INLINE void normalize() {
    const double inverse = 1 / ((x < 0 ? -x : x) + (y < 0 ? -y : y));
    x *= inverse;
    y *= inverse;
  }
};

/// Sums half the solid angles of triangles between the edges of a boundary and the apex of a cone,
/// for packs P of numbers, which are two or four. Seen from the point, a vertex is projected from
/// the apex's opposite onto a plane, at z = tan(a / 2) e^(ib), a its angle with the apex. Half the
/// solid angle of the edge from z to w is the argument of 1 + z* w. Here z is x + iy over a depth,
/// and no division is made. docs/bounds.md, 16.
template <typename P>
struct BoundaryKernel {
  static constexpr std::size_t kLanes = sizeof(P) / sizeof(double), kBlock = 256;
  /// Edges at once, whatever P is: so results are the same.
  static constexpr std::size_t kStep = 4, kPacks = kStep / kLanes;

  /// Adds `count` edges, a multiple of kStep and at most kBlock, from number `begin` on. Returns
  /// false where a vertex is beyond the view's limit. Edges that are long, or near the point, are
  /// not added, but listed.
  static bool add(const BoundaryArrays& boundary, std::size_t begin, std::size_t count,
                  const BoundaryView& view, BoundaryTurn& turn, unsigned* listed,
                  std::size_t& num_listed) {
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
      for (unsigned left = ~added & 15; left != 0; left &= left - 1)
        listed[num_listed++] =
            static_cast<unsigned>(begin + i) + static_cast<unsigned>(__builtin_ctz(left));
      constexpr std::size_t kOften = 8 * kStep;
      if (i % kOften == 0)
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
  struct Projected {
    double x[kBlock + kStep], y[kBlock + kStep], depth[kBlock + kStep];
    double square[kBlock + kStep];  ///< x^2 + y^2 + depth^2; 0 between curves
  };
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
  /// A bit for each number of which a comparison holds.
  template <typename Mask>
  ADAPTIVE_BVH_INLINE static unsigned bits(const Mask& mask) {
#if defined(__AVX2__)
    if constexpr (sizeof(mask) == 32)
      return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
    else
#endif
      return packs::bitsOf2(mask);
  }

  template <bool kIsAligned>
  static bool project(const BoundaryArrays& boundary, std::size_t begin, std::size_t count,
                      const BoundaryView& view, Projected& z) {
    const P limit = filled(view.limit), one = filled(1), kNear = filled(0x1p-80);
    auto is_within = limit > P{};
    for (std::size_t i = 0; i < count; i += kLanes) {
      const P dx = load(boundary.x + begin + i) - view.at[0],
              dy = load(boundary.y + begin + i) - view.at[1],
              dz = load(boundary.z + begin + i) - view.at[2],
              weight = load(boundary.weight + begin + i);
      const auto along = [&](int k) -> P {
        if constexpr (kIsAligned) return k == 0 ? dx : k == 1 ? dy : dz * view.axes[2][2];
        return dx * view.axes[k][0] + dy * view.axes[k][1] + dz * view.axes[k][2];
      };
      const P square = dx * dx + dy * dy + dz * dz;
      const P depth = weight * (squareRoot(square) + along(2)) + (one - weight),
              x = weight * along(0), y = weight * along(1);
      const P across = x * x + y * y, along2 = depth * depth;
      // So near that products of many underflow: the edges of that vertex are to be listed.
      const auto is_near = square < kNear;
      is_within &= (weight * square < limit * along2) | is_near;
      store(x, z.x + i);
      store(y, z.y + i);
      store(depth, z.depth + i);
      store(weight * (is_near ? limit * along2 : along2 + across), z.square + i);
    }
    constexpr unsigned kAll = (1u << kLanes) - 1;
    return bits(is_within) == kAll;
  }

  /// Returns a bit for each edge that was added: where the real part is more than half the product
  /// of the lengths of (depth, x, y) of both ends.
  ADAPTIVE_BVH_INLINE static unsigned multiply(const Projected& z, std::size_t i, Sum& sum) {
    const P zx = load(z.x + i), zy = load(z.y + i), wx = load(z.x + i + 1), wy = load(z.y + i + 1),
            zero{}, one = filled(1);
    P x = load(z.depth + i) * load(z.depth + i + 1) + zx * wx + zy * wy, y = zx * wy - zy * wx;
    const auto is_far =
        (x > zero) & (filled(4) * x * x > load(z.square + i) * load(z.square + i + 1));
    x = is_far ? x : one;
    y = is_far ? y : zero;
    const P re = sum.x * x - sum.y * y, im = sum.x * y + sum.y * x;
    // A true comparison is -1. The angle of x + iy is less than a quarter of a turn: so the sum of
    // the angles leaves the range from -pi to pi where the sign changes on the left.
    sum.turns += (re < zero) & ((sum.y < zero) - (im < zero));
    sum.x = re;
    sum.y = im;
    return bits(is_far);
  }
  ADAPTIVE_BVH_INLINE static void normalize(Sum& sum) {
    const auto absolute = [](const P& v) -> P { return v < P{} ? -v : v; };
    const P inverse = filled(1) / (absolute(sum.x) + absolute(sum.y));
    sum.x *= inverse;
    sum.y *= inverse;
  }
};

/// BoundaryKernel::add.
using AddBoundary = bool (*)(const BoundaryArrays&, std::size_t, std::size_t, const BoundaryView&,
                             BoundaryTurn&, unsigned*, std::size_t&);

/// That of the widest packs this processor has.
AddBoundary addBoundary();

}  // namespace adaptive_bvh
