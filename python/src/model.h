#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include <pybind11/pybind11.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// One of the four models of the library, behind a lock: queries share it, what changes the model
/// has it for itself. The lock is only held without the GIL, so neither waits for the other.
class Model : public Bound, public std::enable_shared_from_this<Model> {
 public:
  using Variant =
      std::variant<AdaptiveBVHModel<fcl::RSS<double>>, AdaptiveBVHModel<fcl::RSS<float>>,
                   AdaptiveBVHModel<fcl::OBBRSS<double>>, AdaptiveBVHModel<fcl::OBBRSS<float>>>;

  /// What Python passes.
  struct Arguments {
    py::object vertices, faces;  ///< faces may be None: then the first has both as attributes
    std::string volume;
    py::object dtype;
    std::optional<RefitPolicy> policy;
    std::string hierarchy;
  };
  explicit Model(const Arguments& arguments);

  /// All vertices.
  UpdateReport update(const py::object& vertices);
  /// Some.
  UpdateReport update(const py::object& indices, const py::object& vertices);

  /// A copy.
  py::array vertices() const;
  /// A copy.
  py::array faces() const;
  std::size_t numVertices() const { return num_vertices_; }
  std::size_t numFaces() const { return num_faces_; }
  bool isDouble() const { return models_.index() % 2 == 0; }
  bool isRSS() const { return models_.index() < 2; }

  /// Runs `f(model)` on the C++ model: without the GIL, beside other queries.
  template <typename F>
  auto query(const F& f) const {
    const py::gil_scoped_release nogil;
    const std::shared_lock lock(mutex_);
    return std::visit(f, models_);
  }
  /// As above, alone.
  template <typename F>
  auto change(const F& f) {
    const py::gil_scoped_release nogil;
    const std::unique_lock lock(mutex_);
    return std::visit(f, models_);
  }

  /// Holds the lock as a query does, to be called without the GIL.
  std::shared_lock<std::shared_mutex> share() const { return std::shared_lock(mutex_); }

  /// Throws py::type_error when the models have different volumes or numbers.
  static void requireSameType(const Model& first, const Model& second);

  /// Runs `f(first, second)` on two C++ models of one type, as `query`. Throws as above.
  template <typename F>
  static auto queryPair(const Model& first, const Model& second, const F& f) {
    requireSameType(first, second);
    const py::gil_scoped_release nogil;
    const PairLock lock(first, second);
    return std::visit(
        [&](const auto& model) {
          return f(model, std::get<std::decay_t<decltype(model)>>(second.models_));
        },
        first.models_);
  }

  /// Shares the locks of two models, which may be one. Always in the same order: two queries and
  /// two updates could wait for each other in a circle.
  class PairLock {
   public:
    PairLock(const Model& a, const Model& b) : first_(&a < &b ? a.mutex_ : b.mutex_) {
      if (&a != &b) second_ = std::shared_lock(&a < &b ? b.mutex_ : a.mutex_);
    }

   private:
    std::shared_lock<std::shared_mutex> first_, second_;
  };

 private:
  Variant models_;
  std::size_t num_vertices_ = 0, num_faces_ = 0;
  mutable std::shared_mutex mutex_;
};

/// The scalar of a C++ model.
template <typename M>
using ScalarOf = typename std::decay_t<M>::S;

void bindModel(py::module_& module);

}  // namespace adaptive_bvh::python
