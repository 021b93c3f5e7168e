#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "tree/boxes.h"
#include "tree/incidence.h"
#include "update/local_bounds.h"
#include "volume/rounding.h"

namespace adaptive_bvh {

/// What is known of some vertices of a new frame.
template <typename S>
struct StagedRange {
  using Point = fcl::Vector3<S>;

  Point low = Point::Constant(std::numeric_limits<S>::max()), high = -low;  ///< of positions
  S squared = 0;  ///< the largest displacement
  S sum = 0;      ///< of all squares; not finite when an old position was not

  void add(const Point& position, S squared_displacement) {
    squared = std::max(squared, squared_displacement);
    sum += squared_displacement;
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], position[k]);
      high[k] = std::max(high[k], position[k]);
    }
  }
  void add(const StagedRange& other) {
    squared = std::max(squared, other.squared);
    sum += other.sum;
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }

  /// Rounded up; not finite when an old position was not.
  S largestDisplacement() const {
    if (!std::isfinite(sum)) return sum;
    return std::sqrt(squared) * (1 + 4 * rounding::epsilon<S>()) + rounding::tiny<S>();
  }
};

/// To be called before the vertices of a new frame are staged.
template <typename BV>
void beginStaging(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                  const fcl::Vector3<typename BV::S>* positions);

/// Writes `positions` (one per vertex of the model) of the vertices in [begin, end) into the model,
/// and where each is and how it came there into `boxes`.
template <typename BV>
StagedRange<typename BV::S> stageRange(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                                       const fcl::Vector3<typename BV::S>* positions, int begin,
                                       int end);

/// To be called when all are staged: sets local box and centre. Returns the largest displacement.
template <typename BV>
typename BV::S finishStaging(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             const StagedRange<typename BV::S>& all);

/// For `count` vertices, by `indices`; of one that is named twice the last position counts. Marks
/// the nodes above them, tells `bounds` of each, and lets all other motions become 0.
/// Returns the largest displacement.
template <typename BV>
typename BV::S stageVertices(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             Incidence& incidence, PartialBounds<BV>& bounds,
                             const unsigned* indices, const fcl::Vector3<typename BV::S>* positions,
                             std::size_t count);

/// The same without motion, for a model as it stands.
template <typename BV>
void stageInPlace(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes);

}  // namespace adaptive_bvh
