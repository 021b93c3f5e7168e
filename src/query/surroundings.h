#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "geometry/scratch.h"
#include "query/pair_of_meshes.h"

namespace adaptive_bvh {

/// Which leaf of a tree holds a triangle, in the order of the leaves.
class LeavesOfTriangles {
 public:
  template <typename BV>
  bool isCurrent(const PlacedMesh<BV>& mesh) const {
    return topology_ == mesh.tree->topology_number;
  }
  template <typename BV>
  void adopt(const PlacedMesh<BV>& mesh) {
    if (isCurrent(mesh)) return;
    topology_ = mesh.tree->topology_number;
    leaves_.resize(static_cast<std::size_t>(mesh.model->num_tris));
    const auto& tree = mesh.tree->wide.topology(*mesh.model, *mesh.tree);
    for (unsigned leaf = 0; leaf < leaves_.size(); ++leaf)
      leaves_[static_cast<std::size_t>(tree.triangle(leaf))] = leaf;
  }
  /// Of triangle 0 where there is no such.
  unsigned leaf(unsigned triangle) const {
    return leaves_[triangle < leaves_.size() ? triangle : 0];
  }

 private:
  std::uint64_t topology_ = 0;
  std::vector<unsigned> leaves_;
};

/// The triangles around a pair of leaves, some before and behind each in the order of the tree:
/// when two bodies stay in touch, where they touch moves on, but rarely far.
template <typename BV>
class Surroundings {
 public:
  Surroundings(const PairOfMeshes<BV>& meshes, const LeafPair& around)
      : first_(meshes.first, around.first), second_(meshes.second, around.second) {
    for (auto& t : second_.triangles)
      for (fcl::Vector3d& x : t.corners) x = meshes.to_first(x);
    for (Side* side : {&first_, &second_}) side->bound();
  }

  /// Whether there are two that are at most so far apart, and which.
  bool find(double distance, LeafPair& found) {
    second_.keep(distance, first_.box);
    first_.keep(distance, second_.box);
    for (const auto& a : first_.triangles)
      for (const auto& b : second_.triangles)
        if (a.box.distance(b.box) <= distance &&
            !areSurelyFarther(a.corners, b.corners, distance) &&
            gapOf(a.corners, b.corners).distance <= distance) {
          found = {a.leaf, b.leaf};
          return true;
        }
    return false;
  }

 private:
  struct Side {
    struct Triangle {
      unsigned leaf;
      TrianglePoints<double> corners;
      fcl::AABBd box;
    };

    Side(const PlacedMesh<BV>& mesh, unsigned around) {
      constexpr unsigned kBeside = 64;
      const VertexSlots& slots = mesh.tree->topology.slots;
      const unsigned size = static_cast<unsigned>(slots.leaves());
      const unsigned end = std::min(around + kBeside, size);
      triangles.reserve(2 * kBeside);
      for (unsigned i = around > kBeside ? around - kBeside : 0; i < end; ++i) {
        Triangle t{i, {}, {}};
        const VertexIndices v = slots.verticesOf(i);
        for (std::size_t k = 0; k < 3; ++k)
          t.corners[k] = mesh.model->vertices[v[k]].template cast<double>();
        triangles.push_back(t);
      }
    }
    void bound() {
      for (Triangle& t : triangles) {
        t.box = fcl::AABBd(t.corners[0], t.corners[1], t.corners[2]);
        box += t.box;
      }
    }
    /// Those that may be so near to a box.
    void keep(double distance, const fcl::AABBd& other) {
      box = fcl::AABBd();
      const auto far = [&](const Triangle& t) { return t.box.distance(other) > distance; };
      triangles.erase(std::remove_if(triangles.begin(), triangles.end(), far), triangles.end());
      for (const Triangle& t : triangles) box += t.box;
    }

    Scratch<Triangle> triangles;
    fcl::AABBd box;
  };

  Side first_, second_;
};

}  // namespace adaptive_bvh
