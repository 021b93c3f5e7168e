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

namespace adaptive_bvh {

template <typename S>
struct MeshState;

namespace detail {
template <typename S>
struct MeshAccess;
}  // namespace detail

/// What an update of a DeformableMesh did.
struct MeshUpdate {
  std::size_t vertices = 0;         ///< positions that were given
  double largest_displacement = 0;  ///< of a vertex, rounded up, in the mesh's unit
  bool turned =
      false;  ///< whether the boxes lie along other axes since, because the body has turned
  double seconds = 0;  ///< all that the update took
};

/// Triangles that deform, for the queries of this library: distances, contacts, self-collisions,
/// nearness, continuous collision, points and rays. Holds the positions and one tree of boxes.
///
///     adaptive_bvh::DeformableMesh<double> cloth(vertices, triangles);
///     cloth.update(positions);  // each step; any query may follow
///
/// **Currency.** An update leaves everything current; nothing is put off to a query. Every query
/// answers for the present positions, exactly, whatever was asked before.
///
/// **Units and frames.** Positions are in the mesh's own frame and any one unit of length.
/// Coordinates must be finite and at most 2^252 (7e75, double) or 2^28 (2.7e8, float) in magnitude.
///
/// **Threads.** A const mesh is only read: any number of threads may query it at once. An update
/// needs the mesh for itself. A copy is a snapshot: threads may query it while the original is
/// updated, and it stays valid when the original is gone.
///
/// **Copies** share the topology, which never changes; positions and boxes are copied (about 90
/// bytes a triangle in double precision).
///
/// **FCL.** It is a fcl::CollisionGeometry: fcl::CollisionObject and FCL's broad-phase managers
/// take it (broadphase.h), and adaptive_bvh::distance and collide (query.h), which have FCL's
/// signatures. FCL's own distance and collide do not know it: they print that they do not support
/// it. For these, use AdaptiveBVHModel.
///
/// S is float or double. Queries compute in double precision for both.
template <typename S>
class DeformableMesh final : public fcl::CollisionGeometry<S> {
 public:
  using Point = fcl::Vector3<S>;  ///< x, y, z in the mesh's frame

  /// Builds the tree by the connectivity of the mesh (thesis appendix). Degenerate and duplicate
  /// triangles and unused vertices are fine; unused vertices count in the local AABB, as in FCL.
  /// Throws std::invalid_argument without triangles, when a triangle names a vertex that is not
  /// there, and when a coordinate is not finite or too large.
  DeformableMesh(std::vector<Point> vertices, std::vector<fcl::Triangle> triangles);
  /// From a mesh, as `loadMesh` reads it.
  explicit DeformableMesh(TriangleMesh<S> mesh);
  /// The triangles of a model of FCL's, whatever its volumes are, with the positions of both frames
  /// where it has two: also of rigid parts, so that all queries take them. Throws as above.
  template <typename BV, typename = std::enable_if_t<std::is_same<typename BV::S, S>::value>>
  explicit DeformableMesh(const fcl::BVHModel<BV>& model)
      : DeformableMesh(copied(model.vertices, model.num_vertices),
                       copied(model.tri_indices, model.num_tris)) {
    if (model.prev_vertices) setPrevious(copied(model.prev_vertices, model.num_vertices));
  }
  /// From V, N x 3 positions, and F, M x 3 indices of vertices: matrices of libigl, ipc-toolkit or
  /// NumPy, in any storage order. Throws as above, and on other shapes.
  template <typename V, typename F>
  DeformableMesh(const Eigen::MatrixBase<V>& vertices, const Eigen::MatrixBase<F>& triangles)
      : DeformableMesh(pointsOf(vertices), trianglesOf(triangles)) {}

  /// A snapshot, see above.
  DeformableMesh(const DeformableMesh& other);
  /// As above, in the memory of this one where it is of the same size.
  DeformableMesh& operator=(const DeformableMesh& other);
  /// Takes over everything. `other` can then only be destroyed or assigned to.
  DeformableMesh(DeformableMesh&& other) noexcept;
  /// Takes over everything. `other` can then only be destroyed or assigned to.
  DeformableMesh& operator=(DeformableMesh&& other) noexcept;
  ~DeformableMesh() override;

  /// Writes the mesh in a binary format: present positions, those of the frame before where there
  /// are some, triangles, and the tree without its boxes. So another process can `load` it without
  /// a build. About 16 bytes a triangle and 24 a vertex (12 in single precision). The first eight
  /// bytes are "ABVHMSHd" or, in single precision, "ABVHMSHf"; a version, a byte order, and a
  /// checksum at the end follow. Open files with std::ios::binary. Throws std::runtime_error when
  /// the stream fails.
  void save(std::ostream& out) const;
  /// Reads a mesh that `save` wrote, and refits its boxes. It answers as the saved mesh did: with
  /// the same bits where the last update was one of all vertices, else up to rounding. Settings of
  /// threads and FCL's user data are not saved. Reads no further than the mesh: others may follow.
  /// Throws std::runtime_error on other data, on another version, number type or byte order, and on
  /// data that are cut off or damaged, which a checksum and a check of every index find.
  static DeformableMesh load(std::istream& in);

  /// Positions, in the order in which they were given. Address and size stay over updates, but of a
  /// two-frame update.
  const std::vector<Point>& vertices() const;
  /// Positions of the frame before; empty unless the last update was updateTwoFrames.
  const std::vector<Point>& previousVertices() const;
  /// Indices of vertices, in the order in which they were given: what queries call a triangle's
  /// index.
  const std::vector<fcl::Triangle>& triangles() const;

  /// A step: `count` positions, one per vertex in order. Allocates nothing.
  /// Throws std::invalid_argument when count is wrong or a coordinate is not finite or too large
  /// (the message names the vertex). The mesh then keeps its positions.
  const MeshUpdate& update(const Point* positions, std::size_t count);
  /// From a vector.
  const MeshUpdate& update(const std::vector<Point>& positions) {
    return update(positions.data(), positions.size());
  }
  /// From a matrix, a vertex a row (N x 3) or a column (3 x N): an Eigen::MatrixX3d, an
  /// Eigen::Matrix3Xd, an Eigen::Map of your simulation's or NumPy's array. Matrices and maps in
  /// either storage order are read in place. Numbers of another type: positions.cast<double>().
  /// Throws as above, and std::invalid_argument on other shapes, and on a 3 x 3 matrix whose type
  /// does not say which of the two it is.
  template <typename Derived>
  const MeshUpdate& update(const Eigen::MatrixBase<Derived>& positions) {
    static_assert(std::is_same<typename Derived::Scalar, S>::value,
                  "adaptive_bvh: positions of another number type; pass positions.cast<S>()");
    constexpr int kRows = Derived::RowsAtCompileTime, kColumns = Derived::ColsAtCompileTime;
    const bool columns = kRows == 3 && kColumns != 3, rows = kColumns == 3 && kRows != 3;
    const bool is_3xN = columns || (!rows && positions.rows() == 3 && positions.cols() != 3);
    const bool is_Nx3 = rows || (!columns && positions.cols() == 3 && positions.rows() != 3);
    if (!is_3xN && !is_Nx3) refuseShape(positions.rows(), positions.cols());
    const Eigen::Ref<const Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic,
                                         Derived::IsRowMajor ? Eigen::RowMajor : Eigen::ColMajor>,
                     0, Eigen::OuterStride<>>
        m(positions.derived());
    const Eigen::Index outer = m.outerStride(), inner = 1;
    const bool outer_is_row = Derived::IsRowMajor;
    const Eigen::Index row = outer_is_row ? outer : inner, column = outer_is_row ? inner : outer;
    return is_Nx3 ? updateStrided(m.data(), m.rows(), row, column)
                  : updateStrided(m.data(), m.cols(), column, row);
  }

  /// A step in which only some vertices move: positions[i] is vertex indices[i]'s, in any order; of
  /// one that is named twice the last counts. All others stay. Throws as `update`, and
  /// std::invalid_argument when an index is past the vertices or the two vectors differ in length.
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

  /// A step that keeps the present positions as those of the frame before, for continuous collision
  /// (Motion). Other queries answer for the new positions. Throws as `update`.
  const MeshUpdate& updateTwoFrames(const Point* positions, std::size_t count);
  /// From a vector.
  const MeshUpdate& updateTwoFrames(const std::vector<Point>& positions) {
    return updateTwoFrames(positions.data(), positions.size());
  }

  /// What the last update did.
  const MeshUpdate& lastUpdate() const;
  /// Checks that every box contains every triangle below it, and the links of the tree. On false,
  /// `reason` says what is wrong where. Takes O(n depth).
  bool validate(std::string* reason = nullptr) const;

  /// Lets updates of 50,000 triangles or more use so many threads of the caller's oneTBB task
  /// arena. 1 by default. The result has the same bits whatever the number. On more than one thread
  /// an update allocates. Without effect where the library was built without oneTBB. Throws
  /// std::invalid_argument below 1.
  void setUpdateThreads(int threads);
  /// Lets a query use so many threads where there is much to search; of two meshes the larger
  /// number counts. 1 by default. Results and their order are the same whatever the number. As
  /// above.
  void setQueryThreads(int threads);

  /// Memory of the mesh, in bytes, with what it shares with copies.
  std::size_t bytes() const;

  /// BV_UNKNOWN: no volume of FCL's.
  fcl::NODE_TYPE getNodeType() const override { return fcl::BV_UNKNOWN; }
  /// OT_UNKNOWN, so that FCL's queries say that they do not support it.
  fcl::OBJECT_TYPE getObjectType() const override { return fcl::OT_UNKNOWN; }
  /// FCL calls this when a fcl::CollisionObject is made. Current after every update anyway.
  void computeLocalAABB() override {}

 private:
  friend struct detail::MeshAccess<S>;

  template <typename T>
  static std::vector<T> copied(const T* from, int count) {
    return std::vector<T>(from, from + (from ? count : 0));
  }
  template <typename V>
  static std::vector<Point> pointsOf(const Eigen::MatrixBase<V>& matrix) {
    if (matrix.cols() != 3) refuseMatrix("vertices", matrix.rows(), matrix.cols());
    std::vector<Point> points(static_cast<std::size_t>(matrix.rows()));
    for (std::size_t i = 0; i < points.size(); ++i)
      for (int k = 0; k < 3; ++k)
        points[i][k] = static_cast<S>(matrix(static_cast<Eigen::Index>(i), k));
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

  explicit DeformableMesh(std::istream& in);
  void setPrevious(std::vector<Point> positions);
  const MeshUpdate& updateStrided(const S* data, Eigen::Index count, Eigen::Index stride,
                                  Eigen::Index component);
  [[noreturn]] void refuseShape(Eigen::Index rows, Eigen::Index columns) const;
  [[noreturn]] static void refuseMatrix(const char* what, Eigen::Index rows, Eigen::Index columns);
  [[noreturn]] static void refuseLengths(std::size_t indices, std::size_t positions);

  std::unique_ptr<MeshState<S>> state_;
};

using DeformableMeshf = DeformableMesh<float>;   ///< single precision
using DeformableMeshd = DeformableMesh<double>;  ///< double precision

extern template class DeformableMesh<float>;
extern template class DeformableMesh<double>;

}  // namespace adaptive_bvh
