#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh_test {

using adaptive_bvh::TriangleMesh;

/// The points in numbers of type S.
template <typename S>
std::vector<fcl::Vector3<S>> pointsIn(const std::vector<fcl::Vector3d>& points) {
  std::vector<fcl::Vector3<S>> converted;
  for (const fcl::Vector3d& x : points) converted.push_back(x.template cast<S>());
  return converted;
}

// What is not defined here is compiled in meshes.cpp, for float and double.

/// A sheet of columns x rows cells, two triangles each, over [0, width] x [0, height] in z = 0.
TriangleMesh plate(int columns, int rows, double width = 1, double height = 1);

/// A plate bent by `map`, closed or not as the map says.
template <typename Map>
TriangleMesh bent(int columns, int rows, Map&& map) {
  TriangleMesh mesh = plate(columns, rows);
  for (fcl::Vector3d& p : mesh.vertices) p = map(p[0], p[1]);
  return mesh;
}

/// A hose of length 2 and radius 0.15 along x.
TriangleMesh tube(int around, int along);

/// A dome of radius 0.5 without its innermost cap.
TriangleMesh dome(int around, int rings);

/// Triangles of edge about 0.2 that share no vertices, strewn over the unit cube.
TriangleMesh soup(int triangles, std::mt19937& random);

fcl::Transform3d randomPose(std::mt19937& random, double reach);

/// Deforms a mesh frame by frame, each frame from the one before.
class Deformation {
 public:
  enum class Kind {
    Smooth,  ///< progressive waves: neighbours move together, about 2 % of the size a frame
    Jerky,   ///< now and then a handful of vertices jump by up to a third of the size
    Still,   ///< nothing moves
  };

  Deformation(TriangleMesh rest, Kind kind, unsigned seed);

  const std::vector<fcl::Vector3d>& positions() const { return now_; }
  const std::vector<fcl::Vector3d>& next();

 private:
  struct Wave {
    fcl::Vector3d direction, number;
    double speed;
  };

  void flow();
  void jump();

  Kind kind_;
  std::vector<fcl::Vector3d> rest_, now_;
  std::mt19937 random_;
  Wave waves_[3];
  int frame_ = 0;
};

}  // namespace adaptive_bvh_test
