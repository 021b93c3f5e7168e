#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

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
    const bool is_first = first_.positions.empty();
    const double moved =
        first_.step(*meshes.first.model, fcl::Matrix3d::Identity(), fcl::Vector3d::Zero()) +
        second_.step(*meshes.second.model, meshes.to_first.R, meshes.to_first.T);
    if (is_first) return std::nullopt;
    return std::max(std::exchange(last_, moved), moved);
  }

 private:
  struct Side {
    double step(const fcl::BVHModel<BV>& model, const fcl::Matrix3d& R, const fcl::Vector3d& T) {
      constexpr std::size_t kSize = 256;
      const bool is_first = positions.empty();
      positions.resize(kSize);
      double farthest = 0;
      for (std::size_t i = 0; i < kSize; ++i) {
        const std::size_t vertex = i * static_cast<std::size_t>(model.num_vertices) / kSize;
        const fcl::Vector3d x = R * model.vertices[vertex].template cast<double>() + T;
        if (!is_first) farthest = std::max(farthest, (x - positions[i]).squaredNorm());
        positions[i] = x;
      }
      return std::sqrt(farthest);
    }
    std::vector<fcl::Vector3d> positions;
  };

  Side first_, second_;
  double last_ = 0;
};

}  // namespace adaptive_bvh
