// What does a tree look like, and how good is it? Measures FCL's top-down tree and the bottom-up
// one, and writes the patches of triangles below the nodes at depth 3, one colour a node.
//   05_tree_patches patches.ply
// examples/tools/tree_pictures draws bounding volumes too, of your mesh files.
#include <array>
#include <cstdio>
#include <fstream>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/hierarchy.h"
#include "scenarios.h"

using adaptive_bvh::HierarchyStrategy;
using Model = adaptive_bvh::AdaptiveBVHModeld;

constexpr std::array<const char*, 8> kColours = {"214 69 65",  "245 171 53", "247 202 24",
                                                 "38 166 91",  "27 188 155", "52 152 219",
                                                 "142 68 173", "149 165 166"};

void printQuality(const Model& model, HierarchyStrategy strategy) {
  const adaptive_bvh::HierarchyQuality quality = measureHierarchy(model);
  std::printf("%-9s  depth %2d, aspect ratio %.2f, overlap of siblings %.1f %%\n",
              toString(strategy), quality.depth, quality.aspect_ratio,
              100 * quality.sibling_overlap);
}

// Every triangle has corners of its own, so that colours do not run into each other.
void writePatches(const Model& model, int depth, std::ostream& out) {
  out << "ply\nformat ascii 1.0\nelement vertex " << 3 * model.num_tris
      << "\nproperty float x\nproperty float y\nproperty float z"
      << "\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face "
      << model.num_tris << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::size_t patch = 0;
  for (int node : nodesAtDepth(model, depth)) {
    for (int triangle : primitivesBelow(model, node))
      for (int k = 0; k < 3; ++k)
        out << model.vertices[model.tri_indices[triangle][k]].transpose() << ' '
            << kColours[patch % kColours.size()] << '\n';
    ++patch;
  }
  for (int t = 0; t < model.num_tris; ++t)
    out << "3 " << 3 * t << ' ' << 3 * t + 1 << ' ' << 3 * t + 2 << '\n';
}

int main(int argc, char** argv) {
  const auto helmet = scenarios::helmet().mesh();
  for (auto strategy : {HierarchyStrategy::TopDown, HierarchyStrategy::BottomUp}) {
    Model model(strategy);
    fillModel(helmet, model);
    printQuality(model, strategy);
  }

  Model model;  // bottom-up
  fillModel(helmet, model);
  const int depth = 3;
  for (int node : nodesAtDepth(model, depth))
    std::printf("node %3d: %3zu triangles\n", node, primitivesBelow(model, node).size());
  if (argc < 2) return 0;
  std::ofstream file(argv[1]);
  writePatches(model, depth, file);
  file.close();
  if (!file) std::fprintf(stderr, "05_tree_patches: cannot write '%s'\n", argv[1]);
  return file ? 0 : 2;
}
