#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

namespace adaptive_bvh::python {

namespace py = pybind11;

/// A __repr__ that shows attributes by name: "RayHits(rays=[0, 2], triangles=[7, 9], ...)". Numbers
/// of arrays have six digits. Arrays of more than 12 are abbreviated, and followed by their shape.
class TextOf {
 public:
  /// The names may still change.
  explicit TextOf(std::shared_ptr<const std::vector<const char*>> attributes)
      : attributes_(std::move(attributes)) {}
  std::string operator()(const py::object& self) const;

 private:
  std::shared_ptr<const std::vector<const char*>> attributes_;
};

}  // namespace adaptive_bvh::python
