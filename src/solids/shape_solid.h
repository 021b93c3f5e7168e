#pragma once

#include <cstddef>
#include <new>

#include <fcl/geometry/collision_geometry.h>

#include "solids/solid.h"

namespace adaptive_bvh {

/// An FCL shape, converted to a Solid. Cheap: it allocates nothing, and the
/// points of an fcl::Convex are not copied. So each query converts shapes anew, because they may
/// have changed in place.
class ShapeSolid {
 public:
  /// Throws std::invalid_argument if the geometry is not a supported shape, if a size is not
  /// positive or not finite (FCL accepts such shapes silently), or if products of its lengths would
  /// underflow.
  explicit ShapeSolid(const fcl::CollisionGeometryd& shape);
  ~ShapeSolid() {
    if (solid_) solid_->~Solid();
  }
  ShapeSolid(const ShapeSolid&) = delete;
  ShapeSolid& operator=(const ShapeSolid&) = delete;

  const Solid& operator*() const { return *solid_; }
  const Solid* operator->() const { return solid_; }
  const ShapeCore& core() const { return core_; }

  /// Constructs a solid of type `Made` in place. For the table in shape_solid.cpp.
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

/// Whether ShapeSolid supports shapes of a type; and the name of the type, or null.
bool isShape(fcl::NODE_TYPE type);
const char* nameOfShape(fcl::NODE_TYPE type);

}  // namespace adaptive_bvh
