#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "model.h"

namespace adaptive_bvh::python {

/// The bounding volume of a C++ model.
template <typename M>
struct VolumeOf;
template <typename BV>
struct VolumeOf<AdaptiveBVHModel<BV>> {
  using Type = BV;
};

/// A C++ object that watches two models, CoherentDistance or CoherentProximity, with what keeps
/// them alive. Threads use it one after the other.
template <template <typename> class Watcher>
class ModelPair : public Bound {
 public:
  /// Throws py::type_error when the models have different volumes or numbers.
  ModelPair(const Model& first, const Model& second)
      : first_(first.shared_from_this()), second_(second.shared_from_this()) {
    Model::queryPair(*first_, *second_, [&](const auto& a, const auto& b) {
      using BV = typename VolumeOf<std::decay_t<decltype(a)>>::Type;
      watcher_.template emplace<Watcher<BV>>(a, b);
    });
  }

  /// Runs `f(watcher)`, without the GIL.
  template <typename F>
  void query(const F& f) {
    const py::gil_scoped_release nogil;
    const std::lock_guard alone(mutex_);
    const Model::PairLock lock(*first_, *second_);
    std::visit(
        [&](auto& watcher) {
          if constexpr (!std::is_same_v<std::decay_t<decltype(watcher)>, std::monostate>)
            f(watcher);
        },
        watcher_);
  }

 private:
  std::shared_ptr<const Model> first_, second_;
  std::mutex mutex_;
  std::variant<std::monostate, Watcher<fcl::RSS<double>>, Watcher<fcl::RSS<float>>,
               Watcher<fcl::OBBRSS<double>>, Watcher<fcl::OBBRSS<float>>>
      watcher_;
};

/// CoherentDistance and CoherentProximity.
void bindPairs(py::module_& module);

}  // namespace adaptive_bvh::python
