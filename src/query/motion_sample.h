#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "query/pair_of_meshes.h"

namespace adaptive_bvh {

/// A few vertices of two models, as the first one sees them: the models moved at least as far as
/// these did.
template <typename BV>
class MotionSample {
 public:
  /// How far they moved since the last call, the farthest of either model, added; or before that,
  /// if it was more. Unknown in the first call.
  std::optional<double> step(const PairOfMeshes<BV>& meshes) {
    const double moved = first_.step(*meshes.first.model, [](const fcl::Vector3d& x) {
      return x;
    }) + second_.step(*meshes.second.model, [&](const fcl::Vector3d& x) {
      return fcl::Vector3d(meshes.R * x + meshes.T);
    });
    if (!std::exchange(has_positions_, true)) return std::nullopt;
    return std::max(std::exchange(last_, moved), moved);
  }

 private:
  struct Side {
    static constexpr std::size_t kSize = 256;

    template <typename Place>
    double step(const fcl::BVHModel<BV>& model, const Place& place) {
      double farthest = 0;
      for (std::size_t i = 0; i < kSize; ++i) {
        const std::size_t vertex = i * static_cast<std::size_t>(model.num_vertices) / kSize;
        const fcl::Vector3d x = place(model.vertices[vertex].template cast<double>());
        farthest = std::max(farthest, (x - at[i]).squaredNorm());
        at[i] = x;
      }
      return std::sqrt(farthest);
    }
    std::array<fcl::Vector3d, kSize> at;
  };

  Side first_, second_;
  bool has_positions_ = false;
  double last_ = 0;
};

}  // namespace adaptive_bvh
