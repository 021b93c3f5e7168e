#pragma once

#include <cstddef>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// A non-owning view of points in either number type, read in double precision.
class Points {
 public:
  explicit Points(const fcl::Vector3d* points) : doubles_(points) {}
  explicit Points(const fcl::Vector3f* points) : singles_(points) {}

  fcl::Vector3d operator[](std::size_t i) const {
    return singles_ ? fcl::Vector3d(singles_[i].cast<double>()) : doubles_[i];
  }

 private:
  const fcl::Vector3d* doubles_ = nullptr;
  const fcl::Vector3f* singles_ = nullptr;
};

}  // namespace adaptive_bvh
