#include "arrays.h"

#include <cstring>

#include "wrong_type.h"

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
template <typename T>
PyObject* convertedTo(int order, const py::array& array) {
  PyObject* numbers = py::detail::npy_api::get().PyArray_FromAny_(
      array.ptr(), py::dtype::of<T>().release().ptr(), 0, 0,
      py::detail::npy_api::NPY_ARRAY_ENSUREARRAY_ | order | int(py::array::forcecast) |
          int(py::detail::npy_api::NPY_ARRAY_ALIGNED_),
      nullptr);
  if (!numbers) throw py::error_already_set();
  return numbers;
}
template <typename T>
Contiguous<T> converted(const py::array& array) {
  return py::reinterpret_steal<Contiguous<T>>(convertedTo<T>(int(py::array::c_style), array));
}

py::array rowsOfThree(const py::object& object, const char* name) {
  py::array array = numbersFrom(object, name);
  if (array.ndim() != 2 || array.shape(1) != 3) refuseShape(array, name, "(N, 3)");
  return array;
}

/// One ray becomes a list of one.
py::object listed(const py::object& rows, const char* name) {
  py::array array = numbersFrom(rows, name);
  return array.ndim() == 1 ? py::object(array.reshape({py::ssize_t(1), py::ssize_t(-1)}))
                           : py::object(array);
}

/// What an array that is no array of numbers holds.
std::string contentOf(const py::array& array) {
  switch (array.dtype().kind()) {
    case 'O': return "objects that are no numbers";
    case 'S':
    case 'U': return "text";
    default: return py::str(py::handle(array.dtype()));
  }
}

[[noreturn]] void refuseNumbers(const py::array& array, const char* name, const char* needed) {
  throw py::type_error(std::string(name) + " holds " + contentOf(array) + "; " + needed +
                       " are needed");
}

/// Of shape (N, columns), or (N,) for one column: integers, each at least 0 and less than `limit`.
Contiguous<std::int64_t> integersFrom(const py::object& object, py::ssize_t columns,
                                      std::size_t limit, const char* name, const char* things) {
  const py::array array = numbersFrom(object, name);
  // An empty list is an array of floats for NumPy.
  if (!std::strchr("iu", array.dtype().kind()) && array.size() != 0)
    refuseNumbers(array, name, "integers");
  const bool is_list = columns == 1;
  if (array.ndim() != (is_list ? 1 : 2) || (!is_list && array.shape(1) != columns))
    refuseShape(array, name, is_list ? "(N,)" : "(N, " + std::to_string(columns) + ")");
  const Contiguous<std::int64_t> numbers = converted<std::int64_t>(array);
  for (py::ssize_t i = 0; i < numbers.size(); ++i)
    requireIndex(numbers.data()[i], limit, name, std::size_t(i / columns), things);
  return numbers;
}

}  // namespace

std::string shapeOf(const py::array& array) { return std::string(py::str(array.attr("shape"))); }

py::array numbersFrom(const py::object& object, const char* name) {
  py::array array = py::isinstance<py::array>(object)
                        ? py::array(object)
                        : py::array::ensure(readableByNumpy(object, name));
  if (!array) throw py::type_error(std::string(name) + " is not an array of numbers");
  if (array.ndim() == 0 && std::strchr("OSU", array.dtype().kind()))
    throw py::type_error(std::string(name) + " is " + typeNameOf(object) +
                         "; an array of real numbers is needed");
  if (!std::strchr("fiu", array.dtype().kind())) refuseNumbers(array, name, "real numbers");
  return array;
}

Rows::Rows(const py::object& object, const char* name)
    : numbers_(converted<double>(rowsOfThree(object, name))) {}

void Rows::repeat(std::size_t count) {
  if (size() != 1) return;
  const py::object broadcast = py::module_::import("numpy").attr("broadcast_to");
  numbers_ = converted<double>(py::array(broadcast(numbers_, py::make_tuple(count, 3))));
}

StridedRows::StridedRows(const py::object& object, const char* name)
    : array_(rowsOfThree(object, name)) {
  is_double_ = !py::isinstance<py::array_t<float>>(array_);
  // Not array::itemsize(): pybind11 before 2.12 reads it where NumPy 1 has it.
  const py::ssize_t number = is_double_ ? sizeof(double) : sizeof(float);
  const auto convert = [&](int order) {
    array_ = py::reinterpret_steal<py::array>(is_double_ ? convertedTo<double>(order, array_)
                                                         : convertedTo<float>(order, array_));
  };
  convert(0);
  // What Eigen can map. The stride of a single row may be anything.
  const auto fits = [&](int inner, int outer) {
    const py::ssize_t stride = array_.strides(outer);
    return array_.strides(inner) == number && stride > 0 && stride % number == 0;
  };
  is_row_major_ = !fits(0, 1) || fits(1, 0);
  if (is_row_major_ && !fits(1, 0)) convert(int(py::array::c_style));
  outer_ = array_.strides(is_row_major_ ? 0 : 1) / number;
}

fcl::Vector3d pointFrom(const py::object& object, const char* name) {
  const py::array array = numbersFrom(object, name);
  if (array.ndim() != 1 || array.shape(0) != 3) refuseShape(array, name, "(3,)");
  const Contiguous<double> numbers = converted<double>(array);
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

RayArguments::RayArguments(const py::object& from, const py::object& along)
    : origins(listed(from, "origins"), "origins"),
      directions(listed(along, "directions"), "directions") {
  origins.repeat(directions.size());
  directions.repeat(origins.size());
  if (origins.size() != directions.size())
    throw py::value_error("there are " + std::to_string(origins.size()) + " origins and " +
                          std::to_string(directions.size()) + " directions");
}

void requireRows(const py::array& rows, std::size_t count, const char* name) {
  if (static_cast<std::size_t>(rows.shape(0)) != count)
    refuseShape(rows, name, "(" + std::to_string(count) + ", 3), a row for each vertex,");
}

void requireIndex(std::int64_t index, std::size_t limit, const char* name, std::size_t row,
                  const char* things) {
  if (index >= 0 && static_cast<std::uint64_t>(index) < limit) return;
  throw py::index_error(std::string(name) + "[" + std::to_string(row) + "] names " +
                        std::to_string(index) + "; there are " + std::to_string(limit) + " " +
                        things);
}

std::vector<unsigned> indicesFrom(const py::object& object, std::size_t limit, const char* name,
                                  const char* things) {
  const Contiguous<std::int64_t> numbers = integersFrom(object, 1, limit, name, things);
  return {numbers.data(), numbers.data() + numbers.size()};
}

std::vector<fcl::Triangle> trianglesFrom(const py::object& object, std::size_t vertices) {
  const Contiguous<std::int64_t> numbers = integersFrom(object, 3, vertices, "faces", "vertices");
  std::vector<fcl::Triangle> triangles(static_cast<std::size_t>(numbers.shape(0)));
  const std::int64_t* row = numbers.data();
  for (fcl::Triangle& triangle : triangles) {
    triangle.set(std::size_t(row[0]), std::size_t(row[1]), std::size_t(row[2]));
    row += 3;
  }
  return triangles;
}

std::vector<FeaturePair> pairsFrom(const py::object& object, const char* name) {
  constexpr std::size_t kAny = std::size_t(1) << 31;  // meshes are checked where they are known
  const Contiguous<std::int64_t> numbers = integersFrom(object, 2, kAny, name, "features");
  std::vector<FeaturePair> pairs;
  for (const std::int64_t* row = numbers.data(); row != numbers.data() + numbers.size(); row += 2)
    pairs.push_back({static_cast<unsigned>(row[0]), static_cast<unsigned>(row[1])});
  return pairs;
}

}  // namespace adaptive_bvh::python
