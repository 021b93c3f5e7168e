#pragma once

#include <string>

#include <gtest/gtest.h>

#include "adaptive_bvh/mesh_io.h"

namespace adaptive_bvh_test {

/// Why loadMesh refuses a file, which the reason must name; empty when it does not.
inline std::string reasonOf(const std::string& path) {
  try {
    adaptive_bvh::loadMesh(path);
  } catch (const adaptive_bvh::MeshLoadError& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find(path)) << error.what();
    return error.what();
  }
  return "";
}

}  // namespace adaptive_bvh_test
