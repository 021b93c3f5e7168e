#pragma once

#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/mesh_io.h"

namespace tools {

/// The options of every tool that reads mesh files.
inline void addMeshOptions(CLI::App& app, adaptive_bvh::MeshLoadOptions& options) {
  using adaptive_bvh::UpAxis;
  app.add_option("--up", options.up, "Turn Collada and glTF until this axis is up: x, y or z")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, UpAxis>{{"x", UpAxis::X}, {"y", UpAxis::Y}, {"z", UpAxis::Z}}));
  app.add_flag("!--file-unit", options.metres, "Lengths in the unit of the file, not metres");
  app.add_option("--scale", options.scale, "Multiply positions by this")
      ->check(CLI::PositiveNumber);
  app.add_option("--weld-tolerance", options.weld_tolerance,
                 "Vertices no farther apart become one; in the unit of the result")
      ->check(CLI::NonNegativeNumber);
}

}  // namespace tools
