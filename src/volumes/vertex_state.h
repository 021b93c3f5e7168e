#pragma once

// Also compiled for AVX2: see volumes/fit_kernels.h.
namespace adaptive_bvh {

/// A vertex in a step: where it is (ScaledFrame), and its motion beyond the common translation, in
/// body units. Loads of four numbers take one of what follows in memory.
struct VertexState {
  float position[3];
  float motion[3];
};

}  // namespace adaptive_bvh
