#pragma once

#include "contact_method.h"
#include "distance_judge.h"

namespace adaptive_bvh_bench {

using scenarios::Mesh;

/// Do triangles of one mesh share a vertex?
inline bool areNeighbours(const fcl::Triangle& a, const fcl::Triangle& b) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (a[i] == b[j]) return true;
  return false;
}

/// Whether two triangles intersect, as FCL decides.
bool touchByFcl(const Mesh& first, unsigned a, const Mesh& second, unsigned b);

/// What touches, of all pairs whose boxes overlap, in quadruple precision: no tree is involved.
/// Sorted.
struct TouchingPairs {
  std::vector<TrianglePair> surely;    ///< by more than rounding
  std::vector<TrianglePair> possibly;  ///< also barely
};
TouchingPairs touchingPairs(const Mesh& first, const Mesh& second);
/// Of one mesh, without neighbours.
TouchingPairs touchingPairs(const Mesh& mesh);

}  // namespace adaptive_bvh_bench
