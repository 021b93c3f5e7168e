#pragma once

#include "scenarios.h"

namespace scenarios {

/// columns x rows cells of two triangles over [-width/2, width/2] x [-height/2, height/2] in z = 0.
Mesh grid(int columns, int rows, double width, double height);

/// An open tube around -z from the origin.
Mesh tube(int around, int along, double radius, double length);

/// A dome of radius 1 with a flared rim, open below, 385 vertices and 710 triangles; each triangle
/// cut into resolution^2 on the smooth surface.
Mesh dome(int resolution);

}  // namespace scenarios
