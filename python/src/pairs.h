#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "locked_mesh.h"

namespace adaptive_bvh::python {

/// A C++ object that watches two meshes, CoherentDistance or CoherentProximity, with what keeps
/// them alive. Threads use it one after the other.
template <template <typename> class Watcher>
class MeshPair : public Bound {
 public:
  /// Throws py::type_error when the meshes have different numbers.
  MeshPair(const LockedMesh& first, const LockedMesh& second)
      : first_(first.shared_from_this()), second_(second.shared_from_this()) {
    LockedMesh::queryPair(*first_, *second_, [&](const auto& a, const auto& b) {
      watcher_.template emplace<Watcher<ScalarOf<decltype(a)>>>(a, b);
    });
  }

  /// Runs `f(watcher)`, without the GIL.
  template <typename F>
  void query(const F& f) {
    const py::gil_scoped_release nogil;
    const std::lock_guard alone(mutex_);
    const LockedMesh::PairLock lock(*first_, *second_);
    std::visit(
        [&](auto& watcher) {
          if constexpr (!std::is_same_v<std::decay_t<decltype(watcher)>, std::monostate>)
            f(watcher);
        },
        watcher_);
  }

 private:
  std::shared_ptr<const LockedMesh> first_, second_;
  std::mutex mutex_;
  std::variant<std::monostate, Watcher<double>, Watcher<float>> watcher_;
};

/// CoherentDistance and CoherentProximity.
void bindPairs(py::module_& module);

}  // namespace adaptive_bvh::python
