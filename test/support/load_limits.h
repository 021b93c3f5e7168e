#pragma once

#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "adaptive_bvh/mesh_io.h"
#include "support/heap_peak.h"
#include "support/temporary_file.h"

/// Of the address sanitizer; null without it.
extern "C" __attribute__((weak)) void __asan_init(void);

namespace adaptive_bvh_test {

/// A megabyte takes up to one second of a processor of its own. Processors that share their units
/// with others' work were seen to take two. Sanitizers, also those of the library alone, and builds
/// without optimization take longer.
inline double secondsPerMegabyte() {
#if defined(NDEBUG) && !defined(__SANITIZE_THREAD__)
  return __asan_init ? 20 : 3;
#else
  return 20;
#endif
}
constexpr double kBytesPerMegabyte = 100e6;

/// Seconds that the processor spent on this thread.
inline double threadSeconds() {
  timespec time;
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

/// Loads a mesh and expects that it is sound, and that time and memory keep to the limits of
/// mesh_io.h, where `bytes` are there to be read. Returns why the file was refused, or "". With
/// ADAPTIVE_BVH_PRINT_COSTS, prints the cost.
inline std::string loadWithinLimits(const std::string& path, std::size_t bytes) {
  const double megabytes = double(1 + bytes / 1000000);
  std::string reason;
  const HeapPeak peak;
  const double before = threadSeconds();
  try {
    const auto mesh = adaptive_bvh::loadMesh(path);
    EXPECT_FALSE(mesh.triangles.empty());
    for (const auto& p : mesh.vertices) EXPECT_TRUE(p.allFinite());
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) EXPECT_LT(t[k], mesh.vertices.size());
  } catch (const adaptive_bvh::MeshLoadError& error) {
    reason = error.what();
    EXPECT_NE(std::string::npos, reason.find(path));
    EXPECT_GT(reason.size(), path.size() + 24) << "no reason: " << reason;
  }
  const double seconds = (threadSeconds() - before) / megabytes;
  const double memory = double(peak.bytes()) / megabytes;
  if (std::getenv("ADAPTIVE_BVH_PRINT_COSTS"))
    std::printf("a megabyte: %.3f s, %5.1f MB  %.150s\n", seconds, memory / 1e6, reason.c_str());
  EXPECT_LT(seconds, secondsPerMegabyte()) << reason;
  EXPECT_LT(memory, kBytesPerMegabyte) << reason;
  return reason;
}

}  // namespace adaptive_bvh_test
