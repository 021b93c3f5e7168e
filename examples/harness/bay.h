#pragma once

#include <string>

#include "surface.h"

namespace harness {

/// A part of the bay. Its surface may be several closed surfaces that overlap.
struct Part {
  std::string name;
  Surface surface;
};
using Parts = std::vector<Part>;

/// Some sixty parts of an engine bay of 900 x 600 x 500 mm, all at rest. x points across the car, y
/// from the radiator (0) to the fire wall (600), z up. A transverse engine with four cylinders and
/// its intake in front, the gearbox at large x.
Parts engineBay();

/// x of the cylinders' axes.
constexpr std::array<double, 4> kCylinders = {315, 405, 495, 585};

/// The parts of `engineBay` by where they belong.
void addEngine(Parts& parts);       ///< block, head, covers, gearbox
void addIntake(Parts& parts);       ///< plenum, runners, throttle, fuel rail, coils, exhaust
void addAccessories(Parts& parts);  ///< belt drive, alternator, starter, brackets of the harness
void addBody(Parts& parts);         ///< radiator, battery, air box, brakes, sheet metal

}  // namespace harness
