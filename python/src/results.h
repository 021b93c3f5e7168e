#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>

#include <fcl/math/triangle.h>

#include "adaptive_bvh/feature_pairs.h"
#include "bound.h"

// Results in NumPy's arrays. All functions need the GIL.
namespace adaptive_bvh::python {

/// What a row of an array is made of: the type of its numbers, and how many along each axis.
template <typename T>
struct Row {
  static_assert(std::is_arithmetic_v<T>, "a number");
  using Integer =
      std::conditional_t<sizeof(T) == 8, std::int64_t,
                         std::conditional_t<sizeof(T) == 4, std::int32_t, bool>>;  // a byte says
                                                                                   // yes or no
  using Number = std::conditional_t<std::is_integral_v<T>, Integer, T>;
  static std::vector<py::ssize_t> shape() { return {}; }
};
template <typename N, py::ssize_t kCount>
struct RowOf {
  using Number = N;
  static std::vector<py::ssize_t> shape() { return {kCount}; }
};
template <>
struct Row<fcl::Vector3d> : RowOf<double, 3> {};
template <>
struct Row<fcl::Triangle> : RowOf<std::int64_t, 3> {};
template <>
struct Row<FeaturePair> : RowOf<std::int32_t, 2> {};
template <typename T, std::size_t kCount>
struct Row<std::array<T, kCount>> {
  using Number = typename Row<T>::Number;
  static std::vector<py::ssize_t> shape() {
    std::vector<py::ssize_t> shape = Row<T>::shape();
    shape.insert(shape.begin(), kCount);
    return shape;
  }
};

/// An array of one row: a copy.
template <typename T>
py::array_t<typename Row<T>::Number> arrayOf(const T& row) {
  using Number = typename Row<T>::Number;
  static_assert(sizeof(T) % sizeof(Number) == 0, "a row is made of numbers");
  return py::array_t<Number>(Row<T>::shape(), reinterpret_cast<const Number*>(&row));
}

/// An array of rows that shares their memory and keeps their owner alive.
template <typename T>
py::array_t<typename Row<T>::Number> viewOf(const std::vector<T>& rows, const py::object& owner) {
  using Number = typename Row<T>::Number;
  static_assert(sizeof(T) % sizeof(Number) == 0, "a row is made of numbers");
  std::vector<py::ssize_t> shape = Row<T>::shape();
  shape.insert(shape.begin(), static_cast<py::ssize_t>(rows.size()));
  return py::array_t<Number>(std::move(shape), reinterpret_cast<const Number*>(rows.data()), owner);
}

/// An array that takes over its rows.
template <typename T>
py::array_t<typename Row<T>::Number> adopt(std::vector<T>&& rows) {
  auto owned = std::make_unique<std::vector<T>>(std::move(rows));
  const std::vector<T>& kept = *owned;
  const py::capsule owner(owned.release(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return viewOf(kept, owner);
}

/// One member of each of many structures.
template <typename T, typename Structure>
std::vector<T> column(const std::vector<Structure>& structures, T Structure::*member) {
  std::vector<T> numbers;
  numbers.reserve(structures.size());
  for (const Structure& one : structures) numbers.push_back(one.*member);
  return numbers;
}

template <typename T>
struct IsVector : std::false_type {};
template <typename T>
struct IsVector<std::vector<T>> : std::true_type {};
template <typename T>
struct IsArray : std::is_same<T, fcl::Vector3d> {};
template <typename T, std::size_t kCount>
struct IsArray<std::array<T, kCount>> : std::true_type {};

/// Python's class of the results T, which queries alone make. Its __repr__ (_classes.py) shows all
/// attributes.
template <typename T>
class ResultClass {
 public:
  ResultClass(py::module_& module, const char* name, const char* doc) : class_(module, name, doc) {
    class_.attr("_attributes") = shown_;
  }

  /// `get` is a member or a function of T. Python sees a vector as an array that shares its memory,
  /// three numbers and a std::array as an array of their own.
  template <typename Get>
  ResultClass& attribute(const char* name, Get get, const char* doc) {
    using Value = std::invoke_result_t<Get, const T&>;
    shown_.append(name);
    if constexpr (IsVector<std::decay_t<Value>>::value) {
      static_assert(std::is_reference_v<Value>, "the result keeps it");
      define(name, doc,
             [get](const T& self) { return viewOf(std::invoke(get, self), py::cast(self)); });
    } else if constexpr (IsArray<std::decay_t<Value>>::value) {
      define(name, doc, [get](const T& self) { return arrayOf(std::invoke(get, self)); });
    } else {
      define(name, doc, [get](const T& self) -> Value { return std::invoke(get, self); });
    }
    return *this;
  }

  /// Lets len() count the rows of a vector.
  template <typename Get>
  ResultClass& length(Get get) {
    class_.def("__len__", [get](const T& self) { return std::invoke(get, self).size(); });
    return *this;
  }

  /// To define more.
  py::class_<T>& operator*() { return class_; }

 private:
  /// Objects that a result holds keep it alive.
  template <typename F>
  void define(const char* name, const char* doc, const F& f) {
    class_.def_property_readonly(name, f, doc);
  }

  py::class_<T> class_;
  py::list shown_;
};

}  // namespace adaptive_bvh::python
