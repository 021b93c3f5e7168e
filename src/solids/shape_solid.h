#pragma once

#include <cstddef>
#include <new>

#include <fcl/geometry/collision_geometry.h>

#include "solids/solid.h"

namespace adaptive_bvh {

/// A shape of FCL's, in either number type, read once as a Solid. It is cheap: nothing is
/// allocated, and the points of a convex stay where they are. So each query reads a shape anew,
/// which may have changed in place.
class ShapeSolid {
 public:
  /// Throws std::invalid_argument where the geometry is no shape that is known, where a size is not
  /// positive or not finite (FCL makes such shapes without a word), and where products of its
  /// lengths would underflow.
  template <typename S>
  explicit ShapeSolid(const fcl::CollisionGeometry<S>& shape);
  ~ShapeSolid() {
    if (solid_) solid_->~Solid();
  }
  ShapeSolid(const ShapeSolid&) = delete;
  ShapeSolid& operator=(const ShapeSolid&) = delete;

  const Solid& operator*() const { return *solid_; }
  const Solid* operator->() const { return solid_; }
  const ShapeCore& core() const { return core_; }

  /// Makes it a solid of a type, which is `Made`. For the table in shape_solid.cpp.
  template <typename Made, typename... Args>
  void make(const Args&... args) {
    static_assert(sizeof(Made) <= kBytes, "enlarge kBytes");
    solid_ = new (memory_) Made(args...);
  }

 private:
  static constexpr std::size_t kBytes = 96;

  alignas(std::max_align_t) std::byte memory_[kBytes];
  const Solid* solid_ = nullptr;
  ShapeCore core_;
};

/// Whether ShapeSolid knows shapes of a type; and their name, or null.
bool isShape(fcl::NODE_TYPE type);
const char* nameOfShape(fcl::NODE_TYPE type);

}  // namespace adaptive_bvh
