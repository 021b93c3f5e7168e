#pragma once

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {

/// The volume under test. Some programs are compiled once for each (CMakeLists.txt): with RSS in
/// float and double, and with OBBRSS in double, which both share what depends on the number.
///
/// TestBodies: for tests of what adaptive_bvh::distance and collide answer of meshes and of models.
/// The first programs have each type of body and each number type once.
#ifdef ADAPTIVE_BVH_TEST_OBBRSS
template <typename S>
using TestVolume = fcl::OBBRSS<S>;
using TestScalars = testing::Types<double>;
using TestBodies = testing::Types<adaptive_bvh::DeformableMesh,
                                  adaptive_bvh::AdaptiveBVHModel<fcl::OBBRSS<double>>>;
#else
template <typename S>
using TestVolume = fcl::RSS<S>;
using TestScalars = testing::Types<float, double>;
using TestBodies =
    testing::Types<adaptive_bvh::DeformableMesh, adaptive_bvh::AdaptiveBVHModel<fcl::RSS<double>>>;
#endif

template <typename S>
S radiusOf(const fcl::RSS<S>& bv) {
  return bv.r;
}
template <typename S>
S radiusOf(const fcl::OBBRSS<S>& bv) {
  return bv.rss.r;
}

using AdaptiveModel = adaptive_bvh::AdaptiveBVHModel<TestVolume<double>>;
using PlainModel = fcl::BVHModel<TestVolume<double>>;

}  // namespace adaptive_bvh_test
