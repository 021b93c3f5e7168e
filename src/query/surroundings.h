#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "geometry/scratch.h"
#include "query/pair_of_meshes.h"

namespace adaptive_bvh {

/// At which place in the order of the leaves each triangle of a mesh is.
class PlacesOfTriangles {
 public:
  template <typename S>
  void adopt(const MeshState<S>& mesh) {
    if (topology_ == mesh.topology) return;
    topology_ = mesh.topology;
    places_.resize(topology_->triangles.size());
    for (unsigned place = 0; place < places_.size(); ++place)
      places_[static_cast<std::size_t>(mesh.tree.triangle(place))] = place;
  }
  unsigned operator[](unsigned triangle) const { return places_[triangle]; }

 private:
  std::shared_ptr<const MeshTopology> topology_;
  std::vector<unsigned> places_;
};

/// The triangles around a pair of leaves, some before and behind each in the order of the tree:
/// when two bodies stay in touch, where they touch moves on, but rarely far.
template <typename S>
class Surroundings {
 public:
  Surroundings(const PairOfMeshes<S>& meshes, const LeafPair& around)
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

    Side(const PlacedMesh<S>& mesh, unsigned around) {
      constexpr unsigned kBeside = 64;
      const auto size = static_cast<unsigned>(mesh.mesh.numTriangles());
      const unsigned end = std::min(around + kBeside, size);
      triangles.reserve(2 * kBeside);
      for (unsigned i = around > kBeside ? around - kBeside : 0; i < end; ++i) {
        triangles.push_back({i, mesh.pointsAt(i), {}});
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
