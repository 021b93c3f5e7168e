#pragma once

#include <optional>
#include <string>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/surface_neighbourhood.h"
#include "bound.h"

namespace adaptive_bvh::python {

/// Python's SurfaceNeighbourhood.
struct Neighbours : Bound {
  explicit Neighbours(SurfaceNeighbourhood&& found) : pairs(std::move(found)) {}
  SurfaceNeighbourhood pairs;
};

/// Python's Ignored.
struct PyIgnored : Bound {
  py::object pairs = py::none();  ///< K x 2 integers, FeaturePairs, or None
  std::optional<SurfaceNeighbourhood> surface;
  NeighbourFilter neighbours = NeighbourFilter::SharedVertex;
};

/// An argument `ignored`: Ignored, a SurfaceNeighbourhood, or pairs. Keeps what the library's
/// request refers to.
class IgnoredArgument {
 public:
  enum Of { Triangles, Features };
  /// `is_self`: of two triangles or edges of one mesh, the smaller number comes first. Throws
  /// py::type_error if pairs are not of these elements, and as pairsFrom.
  IgnoredArgument(const py::object& given, Of elements, bool is_self);
  IgnoredArgument(const IgnoredArgument&) = delete;
  IgnoredArgument& operator=(const IgnoredArgument&) = delete;

  const Ignored& get() const { return ignored_; }

 private:
  void setPairs(const py::object& pairs, Of elements, bool is_self);

  Ignored ignored_;
  std::optional<SurfaceNeighbourhood> surface_;
  std::vector<FeaturePair> triangles_;
  FeaturePairs features_;
};

}  // namespace adaptive_bvh::python
