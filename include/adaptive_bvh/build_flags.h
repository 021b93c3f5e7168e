#pragma once

#include <Eigen/Core>

// Refuses compiler flags under which a program and the compiled library would not fit together.
// Every public header with types of Eigen or FCL includes this.

/// Eigen's largest alignment, in bytes, with which FCL and this library were compiled: 16, as in
/// the packages of Debian, Ubuntu and ROS. The CMake target defines another number if the library
/// was configured with it. A different alignment changes the size of FCL's classes.
#ifndef ADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES
#define ADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES 16
#endif

#if EIGEN_MAX_ALIGN_BYTES != ADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES
// clang-format off
#error "adaptive_bvh: FCL and this library were compiled with another alignment of Eigen's types \
(-mavx and -march=native change it): compile the whole program with -DEIGEN_MAX_ALIGN_BYTES=16, as \
the CMake target adaptive_bvh::adaptive_bvh and pkg-config do"
#elif (defined(__x86_64__) || defined(__aarch64__)) && \
    EIGEN_MAX_STATIC_ALIGN_BYTES != ADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES
#error "adaptive_bvh: FCL and this library were compiled with aligned members of Eigen's types: \
remove EIGEN_DONT_ALIGN_STATICALLY and EIGEN_DONT_VECTORIZE, or compile the whole program with \
-DEIGEN_MAX_STATIC_ALIGN_BYTES=16"
#endif

// Exact predicates and bounds need the arithmetic of IEEE 754. GCC alone defines the last two.
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0) || \
    defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__)
#error "adaptive_bvh: -ffast-math, -Ofast and their parts make exact results wrong: compile the \
files that include this header with -fno-fast-math"
#endif
// clang-format on
