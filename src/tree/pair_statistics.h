#pragma once

#include "tree/traversal_statistics.h"

namespace adaptive_bvh {

/// Where a query of two objects records its traversal. Null for a side that is not adaptive.
struct PairStatistics {
  TraversalStatistics* side[2] = {nullptr, nullptr};

  void recordQuery(const QueryWork& work) const {
    if (side[0]) side[0]->recordQuery(work);
    if (side[1] && side[1] != side[0]) side[1]->recordQuery(work);
  }
  void recordVisit(int b1, int b2) const {
    if (side[0]) side[0]->recordVisit(b1);
    if (side[1]) side[1]->recordVisit(b2);
  }
  void recordObstruction(int b1, int b2) const {
    if (side[0]) side[0]->recordObstruction(b1);
    if (side[1]) side[1]->recordObstruction(b2);
  }
};

}  // namespace adaptive_bvh
