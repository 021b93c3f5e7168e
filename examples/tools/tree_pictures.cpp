// What a tree looks like: writes the bounding volumes at one depth, or the patches of triangles
// below them, as a mesh file with one colour a node. Open it with any viewer.
//   tree_pictures helmet --depth 3 --out helmet.ply
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/mesh_io.h"
#include "coloured_parts.h"
#include "mesh_options.h"
#include "scenarios.h"

namespace {

using adaptive_bvh::HierarchyStrategy;
using tools::Part;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;

struct Options {
  std::string mesh = "helmet", out = "tree.ply", volume = "rss";
  int depth = 3, resolution = 1;
  bool patches = false;
  HierarchyStrategy strategy = HierarchyStrategy::BottomUp;
  adaptive_bvh::MeshLoadOptions load;
};

Mesh meshNamed(const Options& options) {
  if (options.mesh == "helmet") return scenarios::helmet(options.resolution).mesh();
  if (options.mesh == "cable") return scenarios::cable(options.resolution).mesh();
  if (options.mesh == "plate") return scenarios::plate(options.resolution).mesh();
  return adaptive_bvh::loadMesh(options.mesh, options.load);
}

/// The surface of a rectangle-swept sphere: a globe cut along two meridian planes, its quarters
/// moved to the corners of the rectangle. `least` keeps flat ones visible from both sides.
Part surfaceOf(const fcl::RSSd& rss, double least) {
  constexpr int kQuarter = 6, kRings = 12;  // steps along a quarter circle; from pole to pole
  constexpr std::size_t kColumns = 4 * (kQuarter + 1);
  const double r = std::max(rss.r, least);
  Part part;
  for (int j = 0; j <= kRings; ++j)
    for (int quarter = 0; quarter < 4; ++quarter)
      for (int i = 0; i <= kQuarter; ++i) {
        const double across = M_PI / 2 * (quarter + double(i) / kQuarter);
        const double down = M_PI * j / kRings;
        const Point corner(quarter == 0 || quarter == 3 ? rss.l[0] : 0, quarter <= 1 ? rss.l[1] : 0,
                           0);
        const Point out(std::sin(down) * std::cos(across), std::sin(down) * std::sin(across),
                        std::cos(down));
        part.mesh.vertices.push_back(rss.To + rss.axis * (corner + r * out));
        part.normals.push_back(rss.axis * out);
      }
  auto& triangles = part.mesh.triangles;
  for (std::size_t j = 0; j < kRings; ++j)
    for (std::size_t i = 0; i < kColumns; ++i) {
      const std::size_t a = kColumns * j + i, b = kColumns * j + (i + 1) % kColumns;
      triangles.emplace_back(a, a + kColumns, b + kColumns);
      triangles.emplace_back(a, b + kColumns, b);
    }
  const std::size_t side = kQuarter + 1, bottom = kColumns * kRings;  // the flat faces
  for (std::size_t i = 1; i < 3; ++i) {
    triangles.emplace_back(0, i * side, (i + 1) * side);
    triangles.emplace_back(bottom, bottom + (i + 1) * side, bottom + i * side);
  }
  return part;
}

/// The box of an OBBRSS. A corner for each face it belongs to: so its faces look flat.
Part surfaceOf(const fcl::OBBRSSd& bv, double least) {
  const fcl::OBBd& box = bv.obb;
  const Point half = box.extent.cwiseMax(least);
  Part part;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1, 1}) {
      const std::size_t first = part.mesh.vertices.size();
      const Point out = side * Point::Unit(axis), u = Point::Unit((axis + 1) % 3), v = out.cross(u);
      for (const auto& [x, y] : {std::array<double, 2>{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        part.mesh.vertices.push_back(box.To + box.axis * half.cwiseProduct(out + x * u + y * v));
        part.normals.push_back(box.axis * out);
      }
      part.mesh.triangles.emplace_back(first, first + 1, first + 2);
      part.mesh.triangles.emplace_back(first, first + 2, first + 3);
    }
  return part;
}

template <typename Model>
Part patchOf(const Model& model, int node) {
  Mesh mesh;
  std::map<std::size_t, std::size_t> names;
  for (int triangle : primitivesBelow(model, node)) {
    std::size_t corner[3];
    for (int k = 0; k < 3; ++k) {
      const std::size_t v = model.tri_indices[triangle][k];
      const auto [name, is_new] = names.emplace(v, mesh.vertices.size());
      if (is_new) mesh.vertices.push_back(model.vertices[v]);
      corner[k] = name->second;
    }
    mesh.triangles.emplace_back(corner[0], corner[1], corner[2]);
  }
  return {mesh, {}};
}

template <typename BV>
void run(const Options& options) {
  adaptive_bvh::AdaptiveBVHModel<BV> model(options.strategy);
  fillModel(meshNamed(options), model);
  const adaptive_bvh::HierarchyQuality quality = measureHierarchy(model);
  std::vector<Part> parts;
  for (int node : nodesAtDepth(model, options.depth))
    parts.push_back(options.patches ? patchOf(model, node)
                                    : surfaceOf(model.getBV(node).bv, 1e-3 * model.aabb_radius));
  tools::write(parts, options.out);
  std::printf("%s, %s: %d triangles, depth %d (balance %.2f), aspect ratio %.2f, overlap %.1f %%\n",
              options.mesh.c_str(), toString(options.strategy), model.num_tris, quality.depth,
              quality.balance, quality.aspect_ratio, 100 * quality.sibling_overlap);
  std::printf("%zu nodes at depth %d -> %s\n", parts.size(), options.depth, options.out.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("The bounding volumes of one tree depth as a mesh file, one colour a node.");
  app.add_option("MESH", options.mesh, "helmet, cable, plate, or a mesh file");
  app.add_option("--depth", options.depth, "Depth in the tree; 0 is the root")
      ->check(CLI::Range(0, 64));
  app.add_option("--out", options.out, "File to write: .ply, .obj, .gltf, .glb or .stl");
  app.add_flag("--patches", options.patches, "The triangles below the nodes, not their volumes");
  app.add_option("--volume", options.volume, "rss, or obbrss, of which the boxes are drawn")
      ->check(CLI::IsMember({"rss", "obbrss"}));
  app.add_option("--resolution", options.resolution,
                 "Of helmet, cable and plate: this squared times the triangles")
      ->check(CLI::Range(1, 64));
  app.add_option("--strategy", options.strategy, "How the tree is built")
      ->transform(CLI::CheckedTransformer(std::map<std::string, HierarchyStrategy>{
          {"top-down", HierarchyStrategy::TopDown}, {"bottom-up", HierarchyStrategy::BottomUp}}));
  tools::addMeshOptions(app, options.load);
  try {
    app.parse(argc, argv);
    if (options.volume == "obbrss")
      run<fcl::OBBRSSd>(options);
    else
      run<fcl::RSSd>(options);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
  } catch (const std::exception& error) {
    std::cerr << "tree_pictures: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
