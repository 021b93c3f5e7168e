#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "base/number_text.h"
#include "base/rounding.h"

namespace adaptive_bvh {

/// Throws std::invalid_argument, naming the first coordinate that is not finite or too large
/// (rounding::largestCoordinate), if there is one. positions[i] belongs to vertex indexOf(i). The
/// message begins with `call` and ends with `remark`.
template <typename S, typename Positions, typename IndexOf>
void requireUsablePositions(const char* call, const Positions& positions, std::size_t count,
                            const IndexOf& indexOf, const char* remark = "") {
  constexpr S kLargest = rounding::largestCoordinate<S>();
  for (std::size_t i = 0; i < count; ++i) {
    const fcl::Vector3<S>& x = positions[i];  // refers to a copy for a PositionArray
    if (x.cwiseAbs().maxCoeff() <= kLargest && x.allFinite()) continue;
    int k = 0;
    while (std::abs(x[k]) <= kLargest) ++k;
    throw std::invalid_argument(std::string(call) + ": coordinate " + "xyz"[k] + " of vertex " +
                                std::to_string(indexOf(i)) + " is " + textOf(double(x[k])) +
                                (std::isfinite(x[k]) ? ", too large" : "") + remark);
  }
}

}  // namespace adaptive_bvh
