#include "arrays.h"

#include <cstring>

namespace adaptive_bvh::python {
namespace {

const char* nameOfDevice(int type) {
  switch (type) {  // of DLPack
    case 2:
    case 13: return "CUDA";
    case 4: return "OpenCL";
    case 7: return "Vulkan";
    case 8: return "Metal";
    case 10: return "ROCm";
    case 14: return "oneAPI";
    default: return "unknown";
  }
}

/// What NumPy can read in place: the object itself, or what its DLPack shows. Throws py::type_error
/// when it lies in the memory of a device.
py::object readableByNumpy(const py::object& object, const char* name) {
  constexpr int kCpu = 1, kCudaHost = 3, kRocmHost = 11;  // kinds of the CPU's memory in DLPack
  if (!py::hasattr(object, "__dlpack_device__")) return object;
  const int device = py::int_(object.attr("__dlpack_device__")()[py::int_(0)]).cast<int>();
  if (device != kCpu && device != kCudaHost && device != kRocmHost)
    throw py::type_error(std::string(name) + " lies on a device (" + nameOfDevice(device) +
                         ", number " + std::to_string(device) +
                         " of DLPack); copy it to the CPU's memory first");
  if (PyObject_CheckBuffer(object.ptr()) || py::hasattr(object, "__array__") ||
      py::hasattr(object, "__array_interface__"))
    return object;
  try {
    return py::module_::import("numpy").attr("from_dlpack")(object);
  } catch (const py::error_already_set& error) {
    throw py::type_error(std::string(name) + " cannot be read by DLPack: " + error.what());
  }
}

[[noreturn]] void refuseShape(const py::array& array, const char* name, const std::string& needed) {
  throw py::value_error(std::string(name) + " has the shape " + shapeOf(array) + "; " + needed +
                        " is needed");
}

/// Converts what NumPy can convert; `order` is 0 for any, or py::array::c_style.
template <typename S>
PyObject* convertedTo(int order, const py::array& array) {
  PyObject* rows = py::detail::npy_api::get().PyArray_FromAny_(
      array.ptr(), py::dtype::of<S>().release().ptr(), 0, 0,
      py::detail::npy_api::NPY_ARRAY_ENSUREARRAY_ | order | int(py::array::forcecast) |
          int(py::detail::npy_api::NPY_ARRAY_ALIGNED_),
      nullptr);
  if (!rows) throw py::error_already_set();
  return rows;
}
template <typename S>
Rows<S> converted(const py::array& array) {
  return py::reinterpret_steal<Rows<S>>(convertedTo<S>(int(py::array::c_style), array));
}

py::array rowsOfThree(const py::object& object, const char* name) {
  py::array array = numbersFrom(object, name);
  if (array.ndim() != 2 || array.shape(1) != 3) refuseShape(array, name, "(N, 3)");
  return array;
}

/// An empty list is an array of floats for NumPy.
void requireIntegers(const py::array& array, const char* name) {
  const char kind = array.dtype().kind();
  if (kind != 'i' && kind != 'u' && array.size() != 0)
    throw py::type_error(std::string(name) + " holds " +
                         std::string(py::str(py::handle(array.dtype()))) + "; integers are needed");
}

}  // namespace

std::string shapeOf(const py::array& array) { return std::string(py::str(array.attr("shape"))); }

py::array numbersFrom(const py::object& object, const char* name) {
  py::array array = py::isinstance<py::array>(object)
                        ? py::array(object)
                        : py::array::ensure(readableByNumpy(object, name));
  if (!array) throw py::type_error(std::string(name) + " is not an array of numbers");
  if (!std::strchr("fiu", array.dtype().kind()))
    throw py::type_error(std::string(name) + " holds " +
                         std::string(py::str(py::handle(array.dtype()))) +
                         "; real numbers are needed");
  return array;
}

template <typename S>
Rows<S> rowsFrom(const py::object& object, const char* name) {
  return converted<S>(rowsOfThree(object, name));
}

template <typename S>
StridedRows<S>::StridedRows(const py::object& object, const char* name)
    : array_(py::reinterpret_steal<py::array>(convertedTo<S>(0, rowsOfThree(object, name)))) {
  constexpr auto kNumber = static_cast<py::ssize_t>(sizeof(S));
  // What Eigen can map. The stride of a single row may be anything.
  const auto fits = [&](int inner, int outer) {
    const py::ssize_t stride = array_.strides(outer);
    return array_.strides(inner) == kNumber && stride > 0 && stride % kNumber == 0;
  };
  is_row_major_ = !fits(0, 1) || fits(1, 0);
  if (is_row_major_ && !fits(1, 0)) array_ = converted<S>(array_);
  outer_ = array_.strides(is_row_major_ ? 0 : 1) / kNumber;
}

template <typename S>
Eigen::Matrix<S, 3, 1> pointFrom(const py::object& object, const char* name) {
  const py::array array = numbersFrom(object, name);
  if (array.ndim() != 1 || array.shape(0) != 3) refuseShape(array, name, "(3,)");
  return *pointsOf<S>(converted<S>(array));
}

void requireRows(const py::array& rows, std::size_t count, const char* name) {
  if (static_cast<std::size_t>(rows.shape(0)) != count)
    refuseShape(rows, name, "(" + std::to_string(count) + ", 3), a row for each vertex,");
}

Integers integersFrom(const py::object& object, py::ssize_t columns, const char* name) {
  const py::array array = numbersFrom(object, name);
  requireIntegers(array, name);
  if (array.ndim() != 2 || array.shape(1) != columns)
    refuseShape(array, name, "(N, " + std::to_string(columns) + ")");
  return converted<std::int64_t>(array);
}

void requireIndex(std::int64_t index, std::size_t limit, const char* name, py::ssize_t row,
                  const char* things) {
  if (index >= 0 && static_cast<std::uint64_t>(index) < limit) return;
  throw py::index_error(std::string(name) + "[" + std::to_string(row) + "] names " +
                        std::to_string(index) + "; there are " + std::to_string(limit) + " " +
                        things);
}

std::vector<unsigned> indicesFrom(const py::object& object, std::size_t limit, const char* name,
                                  const char* things) {
  const py::array array = numbersFrom(object, name);
  requireIntegers(array, name);
  if (array.ndim() != 1) refuseShape(array, name, "(N,)");
  const Integers numbers = converted<std::int64_t>(array);
  const auto at = numbers.unchecked<1>();
  std::vector<unsigned> indices(static_cast<std::size_t>(at.shape(0)));
  for (py::ssize_t i = 0; i < at.shape(0); ++i) {
    requireIndex(at(i), limit, name, i, things);
    indices[static_cast<std::size_t>(i)] = static_cast<unsigned>(at(i));
  }
  return indices;
}

std::vector<fcl::Triangle> trianglesFrom(const py::object& object, std::size_t vertices) {
  const Integers numbers = integersFrom(object, 3, "faces");
  const auto at = numbers.unchecked<2>();
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(static_cast<std::size_t>(at.shape(0)));
  for (py::ssize_t i = 0; i < at.shape(0); ++i) {
    for (py::ssize_t k = 0; k < 3; ++k) requireIndex(at(i, k), vertices, "faces", i, "vertices");
    triangles.emplace_back(static_cast<std::size_t>(at(i, 0)), static_cast<std::size_t>(at(i, 1)),
                           static_cast<std::size_t>(at(i, 2)));
  }
  return triangles;
}

template class StridedRows<float>;
template class StridedRows<double>;
template Rows<float> rowsFrom<float>(const py::object&, const char*);
template Rows<double> rowsFrom<double>(const py::object&, const char*);
template Eigen::Matrix<float, 3, 1> pointFrom<float>(const py::object&, const char*);
template Eigen::Matrix<double, 3, 1> pointFrom<double>(const py::object&, const char*);

}  // namespace adaptive_bvh::python
