#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "locked_mesh.h"

namespace adaptive_bvh::python {

/// A C++ object that watches two meshes, CoherentDistance or CoherentProximity, with what keeps
/// them alive. Threads use it one after the other.
template <template <typename> class Watcher>
class MeshPair : public Bound {
 public:
  MeshPair(const LockedMesh& first, const LockedMesh& second)
      : first_(first.shared_from_this()), second_(second.shared_from_this()) {
    queryPair(*first_, *second_, [&](const Mesh& a, const Mesh& b) { watcher_.emplace(a, b); });
  }

  /// Returns `f(watcher)`, without the GIL.
  template <typename F>
  auto query(const F& f) {
    const py::gil_scoped_release nogil;
    const std::lock_guard alone(mutex_);
    const LockedMesh::PairLock lock(*first_, *second_);
    return f(*watcher_);
  }

 private:
  std::shared_ptr<const LockedMesh> first_, second_;
  std::mutex mutex_;
  std::optional<Watcher<double>> watcher_;  ///< always there
};

}  // namespace adaptive_bvh::python
