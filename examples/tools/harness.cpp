// Writes an engine bay and the frames of a wiring harness that is shaken in it, in millimetres, for
// clearance checks. Seeds and clocks have no part in it: the same options write the same files.
//   harness FOLDER                   500 frames, FOLDER/harness_0001.ply ..., and FOLDER/bay/*.stl
//   harness FOLDER --frames 20 --triangles 5000
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include <CLI/CLI.hpp>

#include "bay.h"
#include "harness.h"
#include "mesh_files.h"

namespace {

namespace fs = std::filesystem;

fs::path framePath(const fs::path& folder, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "harness_%04d.ply", frame);
  return folder / name;
}

void writeBay(const fs::path& folder) {
  fs::create_directories(folder);
  const harness::Parts parts = harness::engineBay();
  std::size_t triangles = 0;
  for (const harness::Part& part : parts) {
    harness::writeStl(part.surface, (folder / (part.name + ".stl")).string());
    triangles += part.surface.triangles.size();
  }
  std::printf("%s: %zu parts, %zu triangles\n", folder.c_str(), parts.size(), triangles);
}

void writeHarness(const fs::path& folder, int frames, std::size_t triangles) {
  harness::Harness harness(triangles);
  double strain = 0;
  for (int frame = 1; frame <= frames; ++frame) {
    if (frame > 1) harness.advance();
    harness::writePly(harness.surface(), framePath(folder, frame).string());
    strain = std::max(strain, harness.rods().largestStrain());
  }
  std::printf("%s: %d frames, %zu triangles each, %.3f s; cables stretch by at most %.2f %%\n",
              folder.c_str(), frames, harness.surface().triangles.size(),
              (frames - 1) / harness::Harness::kFramesPerSecond, 100 * strain);
}

}  // namespace

int main(int argc, char** argv) {
  std::string folder;
  int frames = 500;
  std::size_t triangles = 20000;
  CLI::App app(
      "Writes a wiring harness that is shaken in an engine bay: data for clearance checks.");
  app.add_option("folder", folder, "Where to write; made if it is not there")->required();
  app.add_option("--frames", frames, "200 a second")->check(CLI::Range(1, 9999));
  app.add_option("--triangles", triangles, "Of the harness, about")
      ->check(CLI::Range(4000, 10000000));
  try {
    app.parse(argc, argv);
    const fs::path left_over = framePath(folder, frames + 1);
    if (fs::exists(left_over))
      throw std::runtime_error("'" + left_over.string() +
                               "' is of another run: remove its frames or choose another folder");
    writeBay(fs::path(folder) / "bay");
    writeHarness(folder, frames, triangles);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
  } catch (const std::exception& error) {
    std::cerr << "harness: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
