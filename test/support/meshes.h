#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh_test {

template <typename S>
using Vector3 = fcl::Vector3<S>;
using adaptive_bvh::TriangleMesh;

// What is not defined here is compiled in meshes.cpp, for float and double.

/// A sheet of columns x rows cells, two triangles each, over [0, width] x [0, height] in z = 0.
template <typename S>
TriangleMesh<S> plate(int columns, int rows, S width = 1, S height = 1);

/// A plate bent by `map`, closed or not as the map says.
template <typename S, typename Map>
TriangleMesh<S> bent(int columns, int rows, Map&& map) {
  TriangleMesh<S> mesh = plate<S>(columns, rows);
  for (Vector3<S>& p : mesh.vertices) p = map(p[0], p[1]);
  return mesh;
}

/// A hose of length 2 and radius 0.15 along x.
template <typename S>
TriangleMesh<S> tube(int around, int along);

/// A dome of radius 0.5 without its innermost cap.
template <typename S>
TriangleMesh<S> dome(int around, int rings);

/// Triangles of edge about 0.2 that share no vertices, strewn over the unit cube.
template <typename S>
TriangleMesh<S> soup(int triangles, std::mt19937& random);

template <typename S>
fcl::Transform3<S> randomPose(std::mt19937& random, S reach);

/// Deforms a mesh frame by frame, each frame from the one before.
template <typename S>
class Deformation {
 public:
  enum class Kind {
    Smooth,  ///< progressive waves: neighbours move together, about 2 % of the size a frame
    Jerky,   ///< now and then a handful of vertices jump by up to a third of the size
    Still,   ///< nothing moves
  };

  Deformation(TriangleMesh<S> rest, Kind kind, unsigned seed);

  const std::vector<Vector3<S>>& positions() const { return now_; }
  const std::vector<Vector3<S>>& next();

 private:
  struct Wave {
    Vector3<S> direction, number;
    S speed;
  };

  void flow();
  void jump();

  Kind kind_;
  std::vector<Vector3<S>> rest_, now_;
  std::mt19937 random_;
  Wave waves_[3];
  int frame_ = 0;
};

extern template class Deformation<float>;
extern template class Deformation<double>;

}  // namespace adaptive_bvh_test
