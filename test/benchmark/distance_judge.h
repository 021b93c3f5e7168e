#pragma once

#include "scenarios.h"

namespace adaptive_bvh_bench {

/// The least distance of two triangles, one of each mesh, both in one frame: in quadruple
/// precision, over a tree of boxes that shares no code with the library or with FCL.
double exactDistance(const scenarios::Mesh& first, const scenarios::Mesh& second);

/// Of one pair of triangles.
double exactDistance(const scenarios::Mesh& first, unsigned a, const scenarios::Mesh& second,
                     unsigned b);

/// Whether two triangles touch; barely: by less than 1e-12 of their size, or not by as little.
enum class Touch { No, Barely, Yes };
Touch touchOf(const scenarios::Mesh& first, unsigned a, const scenarios::Mesh& second, unsigned b);

}  // namespace adaptive_bvh_bench
