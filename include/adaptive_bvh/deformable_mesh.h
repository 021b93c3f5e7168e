#pragma once

#include <cstddef>
#include <iosfwd>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/collision_geometry.h>

#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/point_array.h"

namespace adaptive_bvh {

struct MeshState;

namespace detail {
struct MeshAccess;
}  // namespace detail

/// What an update of a DeformableMesh did.
struct MeshUpdate {
  std::size_t vertices = 0;  ///< number of positions passed
  /// The farthest that any vertex has come from before the call to after it, rounded up, in the
  /// mesh's unit.
  double largest_displacement = 0;
  bool turned = false;  ///< whether the boxes have new axes, because the body has rotated
  double seconds = 0;   ///< duration of the whole update
};

/// Triangles that deform, for the queries of this library: distances, contacts, self-collisions,
/// nearness, continuous collision, points and rays. Holds the positions and one tree of boxes.
///
///     adaptive_bvh::DeformableMesh cloth(vertices, triangles);
///     cloth.update(positions);  // each step; any query may follow
///
/// **Currency.** An update leaves everything current; no work is left to a query. Every query is
/// exact for the present positions, whatever was queried before.
///
/// **Units and frames.** Positions are in the mesh's own frame and any one unit of length.
/// Coordinates must be finite and at most 2^252 (7e75) in magnitude.
/// There is no smallest one: lengths, normals and decisions are as exact for a body of the size
/// 1e-300 as for one of the size 1, until results round to the smallest number. A length's error is
/// relative to the features that it belongs to, so a large mesh may have tiny parts. Exceptions are
/// documented with the queries: shapes of FCL's below 2^-204 (3.9e-62) are refused (query.h),
/// continuous collision counts lengths below 1e-150 as none (continuous_collision.h), and points
/// and depths of contacts of two meshes are FCL's, with its tolerance of 1e-5 (query.h).
///
/// **Threads.** A const mesh is only read: any number of threads may query it at once. An update
/// needs the mesh for itself. A copy is a snapshot: threads may query it while the original is
/// updated, and it stays valid after the original is destroyed.
///
/// **Memory.** A call that throws std::bad_alloc leaves the mesh as it was before, with its
/// positions, boxes and report, and can be repeated: an update on any number of threads, an
/// assignment, `load`. A query that throws it leaves its result valid, with unspecified contents.
///
/// **Copies** share the topology, which never changes; positions and boxes are copied (about 90
/// bytes a triangle).
///
/// **FCL.** It is a fcl::CollisionGeometry: fcl::CollisionObject and FCL's broad-phase managers
/// take it (broadphase.h), and adaptive_bvh::distance and collide (query.h), which have FCL's
/// signatures. FCL's own distance and collide do not know the type: they print a line on stderr;
/// fcl::distance then returns the largest number (DBL_MAX) and fcl::collide no contact. Use
/// AdaptiveBVHModel for them.
///
/// **Numbers** are double. Positions of another type are converted by the caller, once a step.
class DeformableMesh final : public fcl::CollisionGeometryd {
 public:
  using Point = fcl::Vector3d;  ///< x, y, z in the mesh's frame

  /// Builds the tree by the connectivity of the mesh (thesis appendix). Degenerate and duplicate
  /// triangles and unused vertices are fine; unused vertices count in the local AABB, as in FCL.
  /// Throws std::invalid_argument if there are no triangles, if a triangle names a vertex that does
  /// not exist, or if a coordinate is not finite or too large.
  DeformableMesh(std::vector<Point> vertices, std::vector<fcl::Triangle> triangles);
  /// From a mesh, as `loadMesh` reads it.
  explicit DeformableMesh(TriangleMesh mesh);
  /// From any model of FCL's, whatever its volumes are, for example that of a rigid part. Takes the
  /// positions of both frames if the model has two. Throws like the first constructor.
  template <typename BV>
  explicit DeformableMesh(const fcl::BVHModel<BV>& model)
      : DeformableMesh(copied<Point>(model.vertices, model.num_vertices),
                       copied<fcl::Triangle>(model.tri_indices, model.num_tris)) {
    if (model.prev_vertices) setPrevious(copied<Point>(model.prev_vertices, model.num_vertices));
  }
  /// From V, N x 3 positions, and F, M x 3 indices of vertices: matrices of libigl, ipc-toolkit or
  /// NumPy, in any storage order. Throws like the first constructor, and std::invalid_argument on
  /// matrices of other shapes.
  template <typename V, typename F>
  DeformableMesh(const Eigen::MatrixBase<V>& vertices, const Eigen::MatrixBase<F>& triangles)
      : DeformableMesh(pointsOf(vertices), trianglesOf(triangles)) {}

  /// A snapshot: shares the topology, copies positions and boxes.
  DeformableMesh(const DeformableMesh& other);
  /// Makes this mesh a snapshot of `other`, in its present memory if both have the same size.
  DeformableMesh& operator=(const DeformableMesh& other);
  /// Takes over everything. `other` can then only be destroyed or assigned to.
  DeformableMesh(DeformableMesh&& other) noexcept;
  /// Takes over everything. `other` can then only be destroyed or assigned to.
  DeformableMesh& operator=(DeformableMesh&& other) noexcept;
  ~DeformableMesh() override;

  /// Writes the mesh in a binary format: present positions, those of the previous frame if there
  /// are some, triangles, and the tree without its boxes. So another process can `load` it without
  /// a build. About 16 bytes a triangle and 24 a vertex. The first eight bytes are "ABVHMSHd"; a
  /// version, a byte order, and a
  /// checksum at the end follow. Open files with std::ios::binary. Throws std::runtime_error if the
  /// stream fails.
  void save(std::ostream& out) const;
  /// Reads a mesh that `save` wrote, and refits its boxes. Its answers are those of the saved mesh:
  /// with the same bits if the last update was one of all vertices, else up to rounding. Settings
  /// of threads and FCL's user data are not saved. Reads no further than the mesh, so other data
  /// may follow. Throws std::runtime_error on other data, on another version or byte order, on
  /// a mesh that a version before 0.3 saved in single precision, and on incomplete or damaged data,
  /// which a checksum and a check of every index detect.
  static DeformableMesh load(std::istream& in);

  /// Positions, in the order of construction. Address and size do not change in an update, except
  /// in a two-frame update.
  const std::vector<Point>& vertices() const;
  /// Positions of the previous frame; empty unless the last update was updateTwoFrames.
  const std::vector<Point>& previousVertices() const;
  /// Indices of vertices, in the order of construction: a query's index of a triangle is its index
  /// here.
  const std::vector<fcl::Triangle>& triangles() const;

  /// Takes the positions of a step, one per vertex in order, and refits the tree. Allocates
  /// nothing. Throws std::invalid_argument if `count` is wrong or a coordinate is not finite or too
  /// large (the message names the vertex). The mesh then keeps its positions.
  const MeshUpdate& update(const Point* positions, std::size_t count);
  /// From a vector.
  const MeshUpdate& update(const std::vector<Point>& positions) {
    return update(positions.data(), positions.size());
  }
  /// From a matrix, a vertex a row (N x 3) or a column (3 x N): an Eigen::MatrixX3d, an
  /// Eigen::Matrix3Xd, an Eigen::Map of your simulation's or NumPy's array. Matrices and maps in
  /// either storage order are read in place. Pass positions.cast<double>() for another number type.
  /// Throws like the other overloads, and std::invalid_argument on other shapes and on a 3 x 3
  /// matrix whose type does not state whether rows or columns are the vertices.
  template <typename Derived>
  const MeshUpdate& update(const Eigen::MatrixBase<Derived>& positions) {
    return detail::withStrided(positions,
                               [this](const detail::StridedPoints& points) -> const MeshUpdate& {
                                 return updateStrided(points, false);
                               });
  }

  /// Takes new positions of some vertices: positions[i] is that of vertex indices[i], in any order.
  /// If an index occurs twice, its last position counts alone. All other vertices keep theirs. The
  /// first such call allocates 24 bytes a triangle. Throws like `update`, and std::invalid_argument
  /// if an index is out of range or the two vectors differ in length.
  const MeshUpdate& update(const unsigned* indices, const Point* positions, std::size_t count);
  /// From vectors.
  template <typename Index, typename = std::enable_if_t<std::is_integral<Index>::value>>
  const MeshUpdate& update(const std::vector<Index>& indices, const std::vector<Point>& positions) {
    std::vector<unsigned> converted;
    converted.reserve(indices.size());
    for (const Index i : indices) {
      const auto index = static_cast<unsigned>(i);
      converted.push_back(static_cast<Index>(index) == i && i >= 0 ? index : ~0u);
    }
    if (converted.size() != positions.size()) refuseLengths(converted.size(), positions.size());
    return update(converted.data(), positions.data(), converted.size());
  }

  /// Takes the positions of a step and keeps the present ones as previousVertices(), for continuous
  /// collision (Motion). Other queries answer for the new positions. Throws like `update`.
  const MeshUpdate& updateTwoFrames(const Point* positions, std::size_t count);
  /// From a vector.
  const MeshUpdate& updateTwoFrames(const std::vector<Point>& positions) {
    return updateTwoFrames(positions.data(), positions.size());
  }
  /// From a matrix, as `update` takes it.
  template <typename Derived>
  const MeshUpdate& updateTwoFrames(const Eigen::MatrixBase<Derived>& positions) {
    return detail::withStrided(positions,
                               [this](const detail::StridedPoints& points) -> const MeshUpdate& {
                                 return updateStrided(points, true);
                               });
  }

  /// Report of the last update.
  const MeshUpdate& lastUpdate() const;
  /// Returns whether every box contains every triangle below it and the links of the tree are
  /// consistent. If not, `reason` describes the error and its place. Takes O(n depth).
  bool validate(std::string* reason = nullptr) const;

  /// Lets updates of 50,000 triangles or more, and queries with much to search, use up to `threads`
  /// threads of the caller's oneTBB task arena. 1 by default. In a query of two meshes the larger
  /// number counts. Results have the same bits, and the same order, for any number. With more than
  /// one thread an update allocates. Without effect if the library was built without oneTBB. Throws
  /// std::invalid_argument below 1.
  void setThreads(int threads);

  /// Memory of the mesh in bytes, including the topology that copies share.
  std::size_t bytes() const;

  /// BV_UNKNOWN: no volume of FCL's.
  fcl::NODE_TYPE getNodeType() const override { return fcl::BV_UNKNOWN; }
  /// OT_UNKNOWN, so that FCL's queries say that they do not support it.
  fcl::OBJECT_TYPE getObjectType() const override { return fcl::OT_UNKNOWN; }
  /// Does nothing: the local AABB is current after every update. FCL calls this when it makes a
  /// fcl::CollisionObject.
  void computeLocalAABB() override {}

 private:
  friend struct detail::MeshAccess;

  template <typename T, typename From>
  static std::vector<T> copied(const From* from, int count) {
    std::vector<T> copies;
    for (int i = 0; from && i < count; ++i) {
      if constexpr (std::is_same<T, From>::value)
        copies.push_back(from[i]);
      else
        copies.push_back(from[i].template cast<double>());
    }
    return copies;
  }
  template <typename V>
  static std::vector<Point> pointsOf(const Eigen::MatrixBase<V>& matrix) {
    if (matrix.cols() != 3) refuseMatrix("vertices", matrix.rows(), matrix.cols());
    std::vector<Point> points(static_cast<std::size_t>(matrix.rows()));
    for (std::size_t i = 0; i < points.size(); ++i)
      for (int k = 0; k < 3; ++k)
        points[i][k] = static_cast<double>(matrix(static_cast<Eigen::Index>(i), k));
    return points;
  }
  template <typename F>
  static std::vector<fcl::Triangle> trianglesOf(const Eigen::MatrixBase<F>& matrix) {
    if (matrix.cols() != 3) refuseMatrix("triangles", matrix.rows(), matrix.cols());
    std::vector<fcl::Triangle> triangles(static_cast<std::size_t>(matrix.rows()));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const auto index = [&](int k) -> std::size_t {
        return static_cast<std::size_t>(matrix(static_cast<Eigen::Index>(i), k));
      };
      triangles[i].set(index(0), index(1), index(2));
    }
    return triangles;
  }

  explicit DeformableMesh(std::unique_ptr<MeshState> state);
  explicit DeformableMesh(std::istream& in);
  void setPrevious(std::vector<Point> positions);
  const MeshUpdate& updateStrided(const detail::StridedPoints& positions, bool two_frames);
  [[noreturn]] static void refuseMatrix(const char* what, Eigen::Index rows, Eigen::Index columns);
  [[noreturn]] static void refuseLengths(std::size_t indices, std::size_t positions);

  std::unique_ptr<MeshState> state_;
};

}  // namespace adaptive_bvh
