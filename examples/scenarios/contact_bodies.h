#pragma once

#include "scenarios.h"

namespace scenarios {

/// \name Bodies that touch themselves
/// For self-collision; triangles at resolution 1.
/// \{
Body coilingCable(int resolution = 1);   ///< 180, 40 frames: wound up until its turns meet
Body crumpledSheet(int resolution = 1);  ///< 162, 20 frames: every vertex goes its own way
Body pressedRods(int resolution = 1);    ///< 4,992, 21 frames: all four rods of pressedRodsPair
/// \}

/// Four long rods, twisted around each other like a rope, 21 frames. Each lies along two others, at
/// a distance that is least at five places: up to frame 10 between 0 and 1e-6 of a length of 3, in
/// later frames the rods press into each other there. The first body is two rods that lie
/// across from each other, the second the other two.
Scenario pressedRodsPair(const Options& options = {});

}  // namespace scenarios
