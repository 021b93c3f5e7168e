#pragma once

#include <cstddef>
#include <vector>

#include "adaptive_bvh/mesh.h"

namespace adaptive_bvh {

/// Positions, and faces of any number of corners.
struct PolygonMesh {
  std::vector<fcl::Vector3d> vertices;
  std::vector<std::size_t> corners;  ///< of all faces, one after another
  std::vector<std::size_t> sizes;    ///< corners of each face

  /// Corners that were added to `corners` since the last face become one.
  void endFace() {
    sizes.push_back(corners.size() - in_faces_);
    in_faces_ = corners.size();
  }
  void addTriangle(std::size_t a, std::size_t b, std::size_t c) {
    corners.insert(corners.end(), {a, b, c});
    endFace();
  }

  enum class Layout { List, Strip, Fan };
  /// Adds triangles of consecutive corners. Every other triangle of a strip is reversed.
  void addTriangles(const std::vector<std::size_t>& all, Layout layout) {
    for (std::size_t i = 0; i + 2 < all.size(); i += layout == Layout::List ? 3 : 1) {
      const std::size_t odd = layout == Layout::Strip ? i % 2 : 0;
      addTriangle(all[layout == Layout::Fan ? 0 : i + odd], all[i + 1 - odd], all[i + 2]);
    }
  }

 private:
  std::size_t in_faces_ = 0;  ///< corners of complete faces
};

/// Triangles of the same corners, and of the same area and normal as the polygons. Triangles stay
/// as they are, whatever their area; faces of one or two corners are left out.
///
/// A polygon of four corners and more is seen along a coordinate axis: the one along which its
/// normal is largest (the sum of cross products, after Newell). Leaving out a coordinate is exact,
/// and so are all decisions in that plane. The result is checked: all triangles are counter-
/// clockwise, and no two overlap.
/// - A corner on a straight line between its neighbours is a corner of triangles.
/// - A corner that repeats the one before it, and one where the outline turns straight back (a slit
///   or a spike without width), is left out. A polygon without area gives no triangle.
/// - The outline may touch itself: where parts share a corner, or along the way to a hole and back.
///
/// Throws std::runtime_error, naming the face (counted from 1), where the triangles cannot be: the
/// outline crosses itself, or touches itself where a triangle's edge would have to be split; a
/// corner names no vertex; or there are more than `kMostCorners`.
TriangleMesh<double> triangulate(PolygonMesh mesh);

/// The work grows with the square of the corners.
constexpr std::size_t kMostCorners = 10000;

}  // namespace adaptive_bvh
