#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "adaptive_bvh/mesh_io.h"
#include "planar.h"

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
/// corner names no vertex; there are more than `kMostCorners`; or the work is spent.
TriangleMesh<double> triangulate(PolygonMesh mesh, WorkLimit& work);

/// In most outlines few edges are near an ear, and the work grows little faster than the corners.
/// At worst it grows with their square.
constexpr std::size_t kMostCorners = 10000;

/// The work for the polygons of a file, in steps of 2 to 7 ns: so many, and so many for each
/// corner. Half a second for a file of a megabyte, where a corner takes five bytes.
constexpr std::size_t kPolygonSteps = 60000000, kPolygonStepsPerCorner = 200;

/// Levels of nodes, or of the text around them, that a file may have.
constexpr std::size_t kMostLevels = 500;

/// A file may have so many nodes, a node counted once for each way that leads to it, or
/// `kMostPlacementsPerNode` times as many as are written in it, whichever is more.
constexpr std::size_t kMostPlacements = 20000, kMostPlacementsPerNode = 4;

/// A file of a megabyte or less may make so many vertices and triangles: to place and weld them
/// takes half of 100 MB and of a second.
constexpr std::size_t kMostElements = 500000;

/// Counts what a file makes of its bytes, before memory is taken for it.
class ElementLimit {
 public:
  /// `most` elements, or `kMostElements`, whichever is more. `cause` begins the sentence that a
  /// refusal throws.
  ElementLimit(const char* cause, std::size_t most) : cause_(cause), allowed_(most) {}

  /// Adds to `most`, as the bytes of another file are read.
  void allow(std::size_t more) { allowed_ += more; }

  /// Throws std::runtime_error when all that was taken exceeds the limit.
  void take(std::size_t elements);

 private:
  const char* cause_;
  std::size_t allowed_, taken_ = 0;
};

/// Cause of a refusal: several meshes read one list, or a list is announced that is not there.
constexpr const char* kReadsTooOften =
    "its meshes read the same data so often, or so much that the file does not have,";

struct SceneNode {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();  ///< to its parent
  std::vector<std::size_t> children;                        ///< nodes; several may share one
  std::vector<std::size_t> meshes;
  bool is_skinned = false;  ///< its meshes stay where they are, whatever the transforms
};

/// What a file holds.
struct FileScene {
  std::vector<PolygonMesh> meshes;
  std::vector<SceneNode> nodes;
  std::size_t root = 0;          ///< the node that is placed, with those below it
  UpAxis up = UpAxis::AsInFile;  ///< which axis the file says is up; `AsInFile` where it does not
  double unit = 1;               ///< metres
  std::size_t bytes = 0;         ///< of all files that were read; 0 where compression hides them
};

/// Throws std::runtime_error when the nodes are no hierarchy: a node below itself, too many levels,
/// or too many nodes where several name the same child.
void checkHierarchy(const std::vector<SceneNode>& nodes);

/// Triangles in the frame of the root, transformed by `root`. Throws std::runtime_error by
/// `checkHierarchy` and `triangulate`, and when the nodes place meshes too often.
TriangleMesh<double> flatten(FileScene scene, const Eigen::Matrix4d& root);

}  // namespace adaptive_bvh
