#pragma once

#include <type_traits>
#include <utility>

namespace adaptive_bvh::python {

/// A result of meshes of either precision: one of the two stays empty.
template <template <typename> class Result>
class Either {
 public:
  template <typename S>
  Result<S>& as() {
    if constexpr (std::is_same_v<S, double>)
      return of_double_;
    else
      return of_float_;
  }
  /// Returns take(Result<S>&&).
  template <typename Take>
  auto take(bool is_double, const Take& take) && {
    return is_double ? take(std::move(of_double_)) : take(std::move(of_float_));
  }

 private:
  Result<double> of_double_;
  Result<float> of_float_;
};

}  // namespace adaptive_bvh::python
