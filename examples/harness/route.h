#pragma once

#include <string>

#include "surface.h"

namespace harness {

/// A cable of the harness, as it is laid. The first is the trunk; the others branch off from it,
/// where their routes begin.
struct Cable {
  std::string name;
  double radius;
  Points route;  ///< points on its axis
  Points clips;  ///< points of the route where it is held
  Point plug;    ///< width, height and length of the connector at its free end; zero: none
};
std::vector<Cable> cables();

/// Where clips hold the trunk, each above a bracket: at the gearbox, and at both ends of the fuel
/// rail.
struct TrunkClips {
  Point gearbox, rail_right, rail_left;
};
TrunkClips trunkClips();

}  // namespace harness
