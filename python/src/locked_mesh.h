#pragma once

#include <functional>
#include <iosfwd>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "bound.h"
#include "callback.h"
#include "pose.h"

namespace adaptive_bvh::python {

using Mesh = DeformableMesh;

/// Python's DeformableMesh: a mesh of the library, behind a lock. Queries share the lock, what
/// changes the mesh has it for itself. It is only held without the GIL, so neither waits for the
/// other.
class LockedMesh : public Bound, public std::enable_shared_from_this<LockedMesh> {
 public:
  /// `faces` may be None: then the first argument has both as attributes. Throws as Rows,
  /// trianglesFrom, and std::invalid_argument as the library's constructor.
  LockedMesh(const py::object& vertices, const py::object& faces);
  /// Takes a mesh over.
  explicit LockedMesh(Mesh&& mesh);

  /// All vertices. Float arrays whose rows or columns lie side by side are read in place.
  MeshUpdate update(const py::object& vertices);
  /// Some.
  MeshUpdate update(const py::object& indices, const py::object& vertices);
  /// All, keeping the present positions as those before.
  MeshUpdate updateTwoFrames(const py::object& vertices);

  /// Throws py::type_error on what a mesh can be made of, except for shapes, which overloads take
  /// where others take meshes.
  static void refuseOthers(const py::handle& object);

  /// A snapshot.
  std::shared_ptr<LockedMesh> copy() const;
  /// Writes the mesh (DeformableMesh::save). Throws std::runtime_error when the stream fails.
  void save(std::ostream& out) const;
  /// Reads what `save` wrote. Throws py::value_error on other data, and on meshes that versions
  /// before 0.3 saved in single precision.
  static std::shared_ptr<LockedMesh> load(std::istream& in);
  /// A read-only copy.
  py::array vertices() const { return positions(&Mesh::vertices); }
  /// A read-only copy. Without rows where there are none.
  py::array previousVertices() const { return positions(&Mesh::previousVertices); }
  /// A read-only copy.
  py::array faces() const;
  std::size_t numVertices() const { return num_vertices_; }
  std::size_t numFaces() const { return num_faces_; }

  /// Runs `f(mesh)` on the C++ mesh: without the GIL, beside other queries.
  template <typename F>
  auto query(const F& f) const {
    const py::gil_scoped_release nogil;
    const std::shared_lock lock = share();
    return std::invoke(f, mesh_);
  }
  /// Runs `f(mesh)` alone, otherwise as `query`.
  template <typename F>
  auto change(const F& f) {
    CallbackScope::refuseChange();
    const py::gil_scoped_release nogil;
    const std::unique_lock lock(mutex_);
    return f(mesh_);
  }
  /// The C++ mesh, which stays where it is. Read it while the lock is held.
  const Mesh& mesh() const { return mesh_; }

  using SharedLock = std::shared_lock<std::shared_mutex>;
  /// Holds the lock as a query does; no lock in a callback whose query holds it. Call it without
  /// the GIL.
  SharedLock share() const {
    return CallbackScope::holds(this) ? SharedLock() : SharedLock(mutex_);
  }
  /// Shares the locks of many meshes as PairLock does for two. Call it without the GIL.
  static std::vector<SharedLock> shareAll(const std::set<const LockedMesh*>& meshes) {
    std::vector<SharedLock> locks;
    for (const LockedMesh* mesh : meshes) locks.push_back(mesh->share());
    return locks;
  }

  /// Shares the locks of two meshes, which may be one. Always in the same order: two queries and
  /// two updates could wait for each other in a circle.
  class PairLock {
   public:
    PairLock(const LockedMesh& a, const LockedMesh& b) : first_((&a < &b ? a : b).share()) {
      if (&a != &b) second_ = (&a < &b ? b : a).share();
    }

   private:
    SharedLock first_, second_;
  };

 private:
  using Points = std::vector<fcl::Vector3d>;

  py::array positions(const Points& (Mesh::*get)() const) const;

  Mesh mesh_;
  const std::size_t num_vertices_, num_faces_;
  /// The positions of an update that were float32, in float64; its memory stays.
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> converted_;
  mutable std::shared_mutex mutex_;
};

/// Runs `f(first, second)` on two C++ meshes, as `query` of one.
template <typename F>
auto queryPair(const LockedMesh& first, const LockedMesh& second, const F& f) {
  const py::gil_scoped_release nogil;
  const LockedMesh::PairLock lock(first, second);
  return f(first.mesh(), second.mesh());
}

/// Likewise `f(first, tf1, second, tf2)`, as the library's queries of two bodies begin. The second
/// may be a Shape.
template <typename Other, typename F>
auto queryPlaced(const LockedMesh& first, const Other& second, const Poses& poses, const F& f) {
  return queryPair(first, second,
                   [&](const Mesh& a, const auto& b) { return f(a, poses.tf1, b, poses.tf2); });
}

/// Returns what `f(result, first, tf1, second, tf2)` fills in.
template <typename Result, typename Other, typename F>
Result findPlaced(const LockedMesh& first, const Other& second, const Poses& poses, const F& f) {
  Result result;
  queryPlaced(first, second, poses, [&](const auto&... placed) { f(result, placed...); });
  return result;
}

/// Returns what `f(result, mesh)` fills in; likewise of a scene.
template <typename Result, typename Locked, typename F>
Result find(const Locked& locked, const F& f) {
  Result result;
  locked.query([&](const auto& one) { f(result, one); });
  return result;
}

}  // namespace adaptive_bvh::python

namespace pybind11::detail {
/// Says how a mesh is made of what no overload takes where another takes a mesh.
template <>
class type_caster<adaptive_bvh::python::LockedMesh>
    : public adaptive_bvh::python::ConstructedCaster<adaptive_bvh::python::LockedMesh> {
 public:
  bool load(handle source, bool convert) {
    if (ConstructedCaster::load(source, convert)) return true;
    if (convert) adaptive_bvh::python::LockedMesh::refuseOthers(source);
    return false;
  }
};
}  // namespace pybind11::detail
