#pragma once

#include <algorithm>
#include <array>

#include "base/rigid.h"
#include "base/rounding.h"
#include "base/vectors.h"
#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// The corners of up to four triangles of a leaf, and their projections on a direction.
class TiedCorners {
 public:
  using Point = fcl::Vector3d;
  using D = Pack<double>;

  /// Projections of the triangles: of 0 and 1, and of 2 and 3.
  struct Ranges {
    D low[2], high[2];
  };

  void set(std::size_t c, int k, const Point& p) {
    Vectors<D>& pair = corner_[c][k / 2];
    pair.x[k % 2] = p[0];
    pair.y[k % 2] = p[1];
    pair.z[k % 2] = p[2];
  }
  /// Maps all corners.
  void place(const RelativePlacement& placement) {
    const Vectors<D> rows[3] = {all(placement.R.row(0)), all(placement.R.row(1)),
                                all(placement.R.row(2))},
                     shift = all(placement.T);
    for (auto& pairs : corner_)
      for (Vectors<D>& pair : pairs)
        pair = {vectors::dot(rows[0], pair) + shift.x, vectors::dot(rows[1], pair) + shift.y,
                vectors::dot(rows[2], pair) + shift.z};
  }
  /// Corner c of triangle k.
  Point at(int c, int k) const {
    const Vectors<D>& pair = corner_[c][k / 2];
    return {pair.x[k % 2], pair.y[k % 2], pair.z[k % 2]};
  }
  Point normal(int k) const { return (at(1, k) - at(0, k)).cross(at(2, k) - at(0, k)); }
  /// The sum of the corners of triangle k relative to `origin`.
  Point sumFrom(const Point& origin, int k) const {
    return (at(0, k) - origin) + (at(1, k) - origin) + (at(2, k) - origin);
  }
  /// Projections relative to `origin`: near it, few digits are lost.
  Ranges along(const Point& direction, const Point& origin) const {
    const Vectors<D> n = all(direction), from = all(origin);
    const auto at = [&](std::size_t c, int half) -> D {
      return vectors::dot(n, vectors::difference(corner_[c][half], from));
    };
    Ranges ranges;
    for (int half = 0; half < 2; ++half) {
      const D a = at(0, half), b = at(1, half), c = at(2, half);
      ranges.low[half] = packs::lower<D>(packs::lower<D>(a, b), c);
      ranges.high[half] = packs::upper<D>(packs::upper<D>(a, b), c);
    }
    return ranges;
  }

 private:
  template <typename Vector>
  static Vectors<D> all(const Vector& v) {
    return {packs::all(v[0]), packs::all(v[1]), packs::all(v[2])};
  }

  /// corner_[c][k / 2] has corner c of triangle k in its lane k % 2.
  Vectors<D> corner_[3][2] = {};
};

/// Separations in double precision of pairs of triangles of two leaves that are tied: single
/// precision cannot decide whether they are nearer than a limit. Tests each direction for all
/// pairs: where surfaces lie along each other, most pairs are equally near and share normals.
///
/// A pair is a bit: 4 j + i for triangle i of the first leaf and j of the second. The corners of
/// both leaves are in the first mesh's frame; projections are relative to one of them.
class TiedTriangles {
 public:
  using Point = fcl::Vector3d;

  TiedTriangles(const TiedCorners& first, const TiedCorners& second)
      : first_(first), second_(second), origin_(first.at(0, 0)) {}

  /// Returns which of `pairs` are at least `limit` > 0 apart along a direction of any length,
  /// whichever triangle comes first. None if the square of that length underflows.
  unsigned apartAlong(const Point& along, double limit, unsigned pairs) const {
    const double length = along.norm();
    if (!(length > rounding::tiny<double>())) return 0;
    const TiedCorners::Ranges a = first_.along(along, origin_), b = second_.along(along, origin_);
    const D enough = packs::all(limit * length);
    unsigned apart = 0;
    for (int j = 0; j < 4; ++j) {
      const D low = packs::all(b.low[j / 2][j % 2]), high = packs::all(b.high[j / 2][j % 2]);
      for (int half = 0; half < 2; ++half) {
        const D gap = packs::upper<D>(low - a.high[half], a.low[half] - high);
        apart |= packs::bitsOf2(gap >= enough) << (4 * j + 2 * half);
      }
    }
    return apart & pairs;
  }

  /// Directions that may separate a pair: the line, the normals of both triangles, and three times
  /// the difference of their centroids.
  enum class Along { Line, FirstNormal, SecondNormal, Centroids };

  /// Returns which of `pairs` are found to be at least `limit` apart. Tries directions for the pair
  /// `bit` until that pair is apart, first of the kind `preferred`; then that is the kind that
  /// separated the pair. Neighbours on smooth surfaces are mostly separated by the same kind.
  unsigned apartNear(int bit, double limit, unsigned pairs, const Point& line,
                     Along& preferred) const {
    unsigned apart = 0;
    for (int k = 0; k < 4; ++k) {
      const auto kind = Along((int(preferred) + k) % 4);
      apart |= apartAlong(directionOf(kind, bit & 3, bit >> 2, line), limit, pairs);
      if (!(apart >> bit & 1)) continue;
      preferred = kind;
      break;
    }
    return apart;
  }

 private:
  using D = TiedCorners::D;

  /// The direction of this kind for triangle i of the first leaf and j of the second.
  Point directionOf(Along kind, int i, int j, const Point& line) const {
    switch (kind) {
      case Along::Line: return line;
      case Along::FirstNormal: return first_.normal(i);
      case Along::SecondNormal: return second_.normal(j);
      case Along::Centroids: break;
    }
    return second_.sumFrom(origin_, j) - first_.sumFrom(origin_, i);
  }

  const TiedCorners &first_, &second_;
  const Point origin_;
};

/// The corners of those leaves of a mesh that were asked for last: a leaf is tied with many leaves.
class TiedLeaves {
 public:
  void clear() { first_.fill(-1); }
  /// Returns the corners of a leaf's triangles. fill(corners) sets them if they are not known.
  template <typename Fill>
  const TiedCorners& of(const WideNode& leaf, const Fill& fill) {
    const std::size_t slot = std::size_t(leaf.first) / 4 % kLeaves;
    if (first_[slot] != leaf.first) {
      first_[slot] = leaf.first;
      fill(corners_[slot]);
    }
    return corners_[slot];
  }

 private:
  static constexpr std::size_t kLeaves = 32;

  std::array<int, kLeaves> first_;  ///< WideNode::first of the leaf in each slot; -1: none
  std::array<TiedCorners, kLeaves> corners_;
};

}  // namespace adaptive_bvh
