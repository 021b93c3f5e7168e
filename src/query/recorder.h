#pragma once

#include "tree/evidence.h"

namespace adaptive_bvh {

/// Where a query leaves what it saw of the two sides. Null for a side that is not adaptive.
struct Recorder {
  Evidence* side[2] = {nullptr, nullptr};

  void addQuery(const QueryWork& work) const {
    if (side[0]) side[0]->addQuery(work);
    if (side[1] && side[1] != side[0]) side[1]->addQuery(work);
  }
  void addVisit(int b1, int b2) const {
    if (side[0]) side[0]->addVisit(b1);
    if (side[1]) side[1]->addVisit(b2);
  }
  void addObstruction(int b1, int b2) const {
    if (side[0]) side[0]->addObstruction(b1);
    if (side[1]) side[1]->addObstruction(b2);
  }
};

}  // namespace adaptive_bvh
