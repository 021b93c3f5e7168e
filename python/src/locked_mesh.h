#pragma once

#include <iosfwd>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "bound.h"
#include "callback.h"

namespace adaptive_bvh::python {

/// Python's DeformableMesh: one of the two meshes of the library, behind a lock. Queries share the
/// lock, what changes the mesh has it for itself. It is only held without the GIL, so neither waits
/// for the other.
class LockedMesh : public Bound, public std::enable_shared_from_this<LockedMesh> {
 public:
  using Variant = std::variant<DeformableMesh<double>, DeformableMesh<float>>;

  /// `faces` may be None: then the first argument has both as attributes. Throws as rowsFrom and
  /// trianglesFrom, and std::invalid_argument as the library's constructor.
  LockedMesh(const py::object& vertices, const py::object& faces, const py::object& dtype);
  /// Takes a mesh over.
  explicit LockedMesh(Variant&& meshes);

  /// All vertices. Float arrays whose rows or columns lie side by side are read in place.
  MeshUpdate update(const py::object& vertices);
  /// Some.
  MeshUpdate update(const py::object& indices, const py::object& vertices);
  /// All, keeping the present positions as those before.
  MeshUpdate updateTwoFrames(const py::object& vertices);

  /// A snapshot.
  std::shared_ptr<LockedMesh> copy() const;
  /// Writes the mesh (DeformableMesh::save). Throws std::runtime_error when the stream fails.
  void save(std::ostream& out) const;
  /// Reads a mesh of either type. Throws py::value_error on what is none.
  static std::shared_ptr<LockedMesh> load(std::istream& in);
  /// A copy.
  py::array vertices() const;
  /// A copy. Without rows where there are none.
  py::array previousVertices() const;
  /// A copy.
  py::array faces() const;
  std::size_t numVertices() const { return num_vertices_; }
  std::size_t numFaces() const { return num_faces_; }
  bool isDouble() const { return meshes_.index() == 0; }

  /// Returns `f(S())` for the numbers S of the mesh.
  template <typename F>
  auto withScalar(const F& f) const {
    return isDouble() ? f(double()) : f(float());
  }
  /// Runs `f(mesh)` on the C++ mesh: without the GIL, beside other queries.
  template <typename F>
  auto query(const F& f) const {
    const py::gil_scoped_release nogil;
    const std::shared_lock lock = share();
    return std::visit(f, meshes_);
  }
  /// As above, where it is known that the numbers are S.
  template <typename S, typename F>
  auto queryAs(const F& f) const {
    const py::gil_scoped_release nogil;
    const std::shared_lock lock = share();
    return f(std::get<DeformableMesh<S>>(meshes_));
  }
  /// Runs `f(mesh)` alone, otherwise as `query`.
  template <typename F>
  auto change(const F& f) {
    CallbackScope::refuseChange();
    const py::gil_scoped_release nogil;
    const std::unique_lock lock(mutex_);
    return std::visit(f, meshes_);
  }
  /// As above, where it is known that the numbers are S.
  template <typename S, typename F>
  auto changeAs(const F& f) {
    CallbackScope::refuseChange();
    const py::gil_scoped_release nogil;
    const std::unique_lock lock(mutex_);
    return f(std::get<DeformableMesh<S>>(meshes_));
  }

  /// Holds the lock as a query does; no lock in a callback whose query holds it. Call it without
  /// the GIL.
  std::shared_lock<std::shared_mutex> share() const {
    return CallbackScope::holds(this) ? std::shared_lock<std::shared_mutex>()
                                      : std::shared_lock(mutex_);
  }

  /// Runs `f(mesh)` on the C++ mesh, where the caller holds the lock.
  template <typename F>
  auto visit(const F& f) const {
    return std::visit(f, meshes_);
  }

  /// Shares the locks of many meshes as PairLock does for two. Call it without the GIL.
  static std::vector<std::shared_lock<std::shared_mutex>> shareAll(
      const std::set<const LockedMesh*>& meshes) {
    std::vector<std::shared_lock<std::shared_mutex>> locks;
    for (const LockedMesh* mesh : meshes) locks.push_back(mesh->share());
    return locks;
  }

  /// Throws py::type_error when the meshes have different numbers.
  static void requireSameType(const LockedMesh& first, const LockedMesh& second);

  /// Runs `f(first, second)` on two C++ meshes of one type, as `query`, with the same errors.
  template <typename F>
  static auto queryPair(const LockedMesh& first, const LockedMesh& second, const F& f) {
    requireSameType(first, second);
    const py::gil_scoped_release nogil;
    const PairLock lock(first, second);
    return std::visit(
        [&](const auto& mesh) {
          return f(mesh, std::get<std::decay_t<decltype(mesh)>>(second.meshes_));
        },
        first.meshes_);
  }

  /// Shares the locks of two meshes, which may be one. Always in the same order: two queries and
  /// two updates could wait for each other in a circle.
  class PairLock {
   public:
    PairLock(const LockedMesh& a, const LockedMesh& b) : first_((&a < &b ? a : b).share()) {
      if (&a != &b) second_ = (&a < &b ? b : a).share();
    }

   private:
    std::shared_lock<std::shared_mutex> first_, second_;
  };

 private:
  Variant meshes_;
  std::size_t num_vertices_, num_faces_;  ///< which never change
  mutable std::shared_mutex mutex_;
};

/// The scalar of a C++ mesh.
template <typename M>
using ScalarOf = typename std::decay_t<M>::Point::Scalar;

void bindLockedMesh(py::module_& module);

}  // namespace adaptive_bvh::python
