#pragma once

#include <memory>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>

#include "support/meshes.h"

namespace adaptive_bvh_test {

inline std::shared_ptr<fcl::Convexd> tetrahedron() {
  auto corners = std::make_shared<std::vector<fcl::Vector3d>>();
  *corners = {{0, 0, 0}, {0.6, 0, 0}, {0, 0.5, 0}, {0, 0, 0.7}};
  auto faces = std::make_shared<std::vector<int>>(
      std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 0, 3, 2, 3, 1, 2, 3});
  return std::make_shared<fcl::Convexd>(corners, 4, faces);
}

/// One of each primitive to which FCL can compute a mesh's distance.
inline std::vector<std::shared_ptr<fcl::CollisionGeometryd>> boundedShapes() {
  return {std::make_shared<fcl::Boxd>(0.4, 0.3, 0.5),
          std::make_shared<fcl::Ellipsoidd>(0.3, 0.2, 0.25),
          std::make_shared<fcl::Capsuled>(0.15, 0.4),
          std::make_shared<fcl::Coned>(0.2, 0.4),
          std::make_shared<fcl::Cylinderd>(0.2, 0.4),
          std::make_shared<fcl::Sphered>(0.25),
          tetrahedron()};
}

}  // namespace adaptive_bvh_test
