#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "base/number_text.h"
#include "base/rounding.h"

// The exceptions of AdaptiveBVHModel::update.
namespace adaptive_bvh {

[[noreturn]] inline void refuseUpdate(const std::string& what) {
  throw std::invalid_argument("AdaptiveBVHModel::update: " + what);
}

/// Throws an exception that names the first coordinate that is not finite or too large; there must
/// be one. positions[i] belongs to vertex indices[i], or to vertex i if `indices` is null.
template <typename S>
[[noreturn]] void refuseCoordinate(const fcl::Vector3<S>* positions, const unsigned* indices) {
  const auto usable = [](S x) { return std::abs(x) <= rounding::largestCoordinate<S>(); };
  for (std::size_t i = 0;; ++i)
    for (int k = 0; k < 3; ++k) {
      const S x = positions[i][k];
      if (usable(x)) continue;
      refuseUpdate("coordinate " + std::string(1, "xyz"[k]) + " of vertex " +
                   std::to_string(indices ? indices[i] : i) + " is " + textOf(double(x)) +
                   (std::isfinite(x) ? ", too large" : "") +
                   "; the model stays on its last positions");
    }
}

/// Throws for a matrix of positions whose shape is neither 3 x N nor N x 3, or is 3 x 3 of a type
/// that does not say which of the two it is. N is the number of vertices.
[[noreturn]] inline void refuseMatrix(Eigen::Index rows, Eigen::Index columns, int vertices) {
  refuseUpdate(
      "the positions are a " + std::to_string(rows) + " x " + std::to_string(columns) +
      " matrix; " +
      (rows == 3
           ? "only its type can state whether its rows or its columns are the vertices: pass "
             "an Eigen::Matrix<S, 3, Eigen::Dynamic> or an Eigen::Matrix<S, Eigen::Dynamic, 3>"
           : "3 x N or N x 3 is needed, for " + std::to_string(vertices) + " vertices"));
}

}  // namespace adaptive_bvh
