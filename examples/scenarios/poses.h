#pragma once

#include "scenarios.h"

namespace scenarios {

/// A body that goes from one pose of a mesh to another and back, above a plate of its own size.
/// Throws std::invalid_argument when the poses differ in their number of vertices.
Scenario interpolated(const std::string& name, const Mesh& from, const std::vector<Point>& to,
                      int frames);

/// The same motion; the first body is the largest connected part of the mesh, by triangles, the
/// second all others. Parts are connected by vertices of equal position in the pose `from`. Throws
/// std::invalid_argument also when there is only one part.
Scenario interpolatedParts(const std::string& name, const Mesh& from, const std::vector<Point>& to,
                           int frames);

}  // namespace scenarios
