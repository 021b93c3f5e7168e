#pragma once

#include <stdexcept>

#include "geometry/rigid.h"

namespace adaptive_bvh {

template <typename S>
void requireDistance(S distance) {
  if (!(distance >= 0))
    throw std::invalid_argument("adaptive_bvh: a distance to ask for is negative or not a number");
}

}  // namespace adaptive_bvh
