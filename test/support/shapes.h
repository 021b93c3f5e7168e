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

template <typename S>
std::shared_ptr<fcl::Convex<S>> tetrahedron() {
  auto corners = std::make_shared<std::vector<Vector3<S>>>();
  *corners = {{0, 0, 0}, {S(0.6), 0, 0}, {0, S(0.5), 0}, {0, 0, S(0.7)}};
  auto faces = std::make_shared<std::vector<int>>(
      std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 0, 3, 2, 3, 1, 2, 3});
  return std::make_shared<fcl::Convex<S>>(corners, 4, faces);
}

/// One of each primitive to which FCL can compute a mesh's distance.
template <typename S>
std::vector<std::shared_ptr<fcl::CollisionGeometry<S>>> boundedShapes() {
  return {std::make_shared<fcl::Box<S>>(S(0.4), S(0.3), S(0.5)),
          std::make_shared<fcl::Ellipsoid<S>>(S(0.3), S(0.2), S(0.25)),
          std::make_shared<fcl::Capsule<S>>(S(0.15), S(0.4)),
          std::make_shared<fcl::Cone<S>>(S(0.2), S(0.4)),
          std::make_shared<fcl::Cylinder<S>>(S(0.2), S(0.4)),
          std::make_shared<fcl::Sphere<S>>(S(0.25)),
          tetrahedron<S>()};
}

}  // namespace adaptive_bvh_test
