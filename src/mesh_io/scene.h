#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "adaptive_bvh/mesh_io.h"
#include "planar.h"

// What readers of files return: nodes that place meshes of polygons. Limits on its size.
namespace adaptive_bvh {

/// Positions, and polygonal faces.
struct PolygonMesh {
  std::vector<fcl::Vector3d> vertices;
  std::vector<std::size_t> corners;  ///< vertices of all faces, one face after the other
  std::vector<std::size_t> sizes;    ///< number of corners of each face

  /// Makes a face of the corners that were added to `corners` since the last face.
  void endFace() {
    sizes.push_back(corners.size() - corners_in_faces_);
    corners_in_faces_ = corners.size();
  }
  void addTriangle(std::size_t a, std::size_t b, std::size_t c) {
    corners.insert(corners.end(), {a, b, c});
    endFace();
  }

  enum class Layout { List, Strip, Fan };
  /// Adds the triangles of a list of vertices. In a strip, every other triangle is reversed.
  void addTriangles(const std::vector<std::size_t>& list, Layout layout) {
    for (std::size_t i = 0; i + 2 < list.size(); i += layout == Layout::List ? 3 : 1) {
      const std::size_t odd = layout == Layout::Strip ? i % 2 : 0;
      addTriangle(list[layout == Layout::Fan ? 0 : i + odd], list[i + 1 - odd], list[i + 2]);
    }
  }

 private:
  std::size_t corners_in_faces_ = 0;  ///< number of corners of complete faces
};

/// Triangulates polygons without adding vertices; area and normal are preserved. Triangles are
/// copied, whatever their area; faces with one or two corners are left out.
///
/// A polygon with four or more corners is projected along a coordinate axis: the one along which
/// its normal is largest (the sum of cross products, after Newell). Dropping a coordinate is exact,
/// and so are all decisions in that plane. The result is checked: all triangles are
/// counter-clockwise, and no two overlap.
/// - A corner on a straight line between its neighbours is a corner of triangles.
/// - A corner that repeats the one before it, and one where the outline turns straight back (a slit
///   or a spike without width), is left out. A polygon without area gives no triangle.
/// - The outline may touch itself: where parts share a corner, or along the way to a hole and back.
///
/// Throws std::runtime_error with the number of the face (from 1) if it cannot be triangulated: the
/// outline crosses itself, or touches itself where a triangle's edge would have to be split; a
/// corner is not a valid vertex index; there are more than `kMostCorners` corners; or the work
/// limit is exceeded.
TriangleMesh triangulate(PolygonMesh mesh, WorkLimit& work);

/// In most outlines few edges are near an ear, and the work is nearly linear in the number of
/// corners. In the worst case it is quadratic.
constexpr std::size_t kMostCorners = 10000;

/// The work limit for the polygons of a file, in steps of 2 to 7 ns: a constant plus an amount per
/// corner. Half a second for a file of a megabyte, where a corner takes five bytes.
constexpr std::size_t kPolygonSteps = 60000000, kPolygonStepsPerCorner = 200;

/// The most levels of nested nodes, or of nested text around them, that a file may have.
constexpr std::size_t kMostLevels = 500;

/// The most nodes of a file, each counted once for each path to it from the root: the larger of
/// `kMostPlacements` and `kMostPlacementsPerNode` times the number of nodes in the file.
constexpr std::size_t kMostPlacements = 20000, kMostPlacementsPerNode = 4;

/// The most vertices and triangles that a file of a megabyte or less may produce: placing and
/// welding them takes 50 MB and half a second.
constexpr std::size_t kMostElements = 500000;

/// Limits the number of elements that a file produces, before memory is allocated for them.
class ElementLimit {
 public:
  /// The limit is the greater of `most` and `kMostElements`. `cause` begins the message.
  ElementLimit(const char* cause, std::size_t most) : cause_(cause), allowed_(most) {}

  /// Increases the limit, because the bytes of another file were read.
  void allow(std::size_t more) { allowed_ += more; }

  /// Counts elements. Throws std::runtime_error if the total exceeds the limit.
  void take(std::size_t elements);

 private:
  const char* cause_;
  std::size_t allowed_, taken_ = 0;
};

/// The cause of an ElementLimit on what meshes read: several may read the same list, or the file
/// may announce a list that it does not have.
constexpr const char* kReadsTooOften =
    "its meshes read the same data so often, or so much that the file does not have,";

/// A node of the file's hierarchy. Nodes and meshes are indices in FileScene.
struct SceneNode {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();  ///< to the frame of its parent
  std::vector<std::size_t> children;                        ///< several parents may share one
  std::vector<std::size_t> meshes;
  bool is_skinned = false;  ///< if true, its meshes are in the frame of the root
};

/// The content of a file.
struct FileScene {
  std::vector<PolygonMesh> meshes;
  std::vector<SceneNode> nodes;
  std::size_t root = 0;          ///< node that is placed, with all nodes below it
  UpAxis up = UpAxis::AsInFile;  ///< up axis of the file; `AsInFile` if not declared
  std::optional<double> unit;    ///< in metres; nothing if the file declares none
  std::size_t bytes = 0;  ///< total size of all files that were read; 0 if compression hides it
};

/// Throws std::runtime_error if the nodes are not a hierarchy: a node is below itself, there are
/// too many levels, or too many placements because several nodes share children.
void checkHierarchy(const std::vector<SceneNode>& nodes);

/// A node, once for each path to it from the root of its scene, which is at level 0.
struct Placement {
  std::size_t node, level;
};

/// The meshes of a scene as triangles, and its placements, depth first: the parent of one is the
/// last one before it that is a level higher.
struct PlacedMeshes {
  std::vector<TriangleMesh> meshes;
  std::vector<Placement> placements;
};

/// Throws std::runtime_error like `checkHierarchy` and `triangulate`, and if the nodes place meshes
/// too often. Moves the meshes out of the scene.
PlacedMeshes placedMeshes(FileScene& scene);

/// The triangles of all placed meshes in the frame of the root, transformed by `root`. Throws like
/// `placedMeshes`.
TriangleMesh flatten(FileScene scene, const Eigen::Matrix4d& root);

}  // namespace adaptive_bvh
