#pragma once

#include <string>

#include "adaptive_bvh/mesh_io.h"
#include "poses.h"

namespace adaptive_bvh_bench {

/// From one pose to the other and back in so many steps; at stride 8 a step goes all the way.
constexpr int kPoseSteps = 16;

/// Two poses of one mesh as a scenario: above a plate, or, when split, the mesh's largest connected
/// part against its others.
inline scenarios::Scenario loadPoses(const std::string& from_path, const std::string& to_path,
                                     bool split) {
  adaptive_bvh::MeshLoadOptions keep;
  keep.weld = false;  // two poses of one mesh pair their vertices by number
  const auto from = adaptive_bvh::loadMesh(from_path, keep);
  const auto to = adaptive_bvh::loadMesh(to_path, keep);
  const std::string name = from_path.substr(from_path.find_last_of('/') + 1);
  return (split ? scenarios::interpolatedParts : scenarios::interpolated)(name, from, to.vertices,
                                                                          kPoseSteps);
}

}  // namespace adaptive_bvh_bench
