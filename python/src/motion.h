#pragma once

#include <memory>
#include <vector>

#include "adaptive_bvh/continuous_collision.h"
#include "arrays.h"
#include "model.h"
#include "objects.h"

namespace adaptive_bvh::python {

/// Python's Motion: a model, and copies of its positions at two times.
class MeshMotion : public Bound {
 public:
  /// `end` may be None: the model's present positions. Throws as rowsFrom and poseFrom, and
  /// py::value_error when a number of positions is not that of the vertices.
  MeshMotion(const Model& model, const py::object& start, const py::object& end,
             const py::object& start_tf, const py::object& end_tf);

  const Model& model() const { return *model_; }

  /// For the library. Refers to this object.
  template <typename BV>
  Motion<BV> of(const AdaptiveBVHModel<BV>& model) const {
    using S = typename BV::S;
    const Positions<S>& positions = std::get<Positions<S>>(positions_);
    return Motion<BV>(model, positions.start, positions.end, poseAs<S>(start_tf_),
                      poseAs<S>(end_tf_));
  }

 private:
  template <typename S>
  struct Positions {
    std::vector<Eigen::Matrix<S, 3, 1>> start, end;
  };

  std::shared_ptr<const Model> model_;
  std::variant<Positions<double>, Positions<float>> positions_;
  fcl::Transform3d start_tf_, end_tf_;
};

/// Runs `f(motion)` on the library's motion, without the GIL; likewise `f(first, second)`.
template <typename F>
auto queryMotion(const MeshMotion& motion, const F& f) {
  return motion.model().query([&](const auto& model) { return f(motion.of(model)); });
}
template <typename F>
auto queryMotions(const MeshMotion& first, const MeshMotion& second, const F& f) {
  return Model::queryPair(first.model(), second.model(), [&](const auto& a, const auto& b) {
    return f(first.of(a), second.of(b));
  });
}

}  // namespace adaptive_bvh::python
