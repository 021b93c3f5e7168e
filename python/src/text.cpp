#include "text.h"

#include "arrays.h"

namespace adaptive_bvh::python {
namespace {

/// NumPy's text of an array, on one line.
std::string textOfArray(const py::array& array) {
  constexpr py::ssize_t kShown = 12;
  py::dict formatter;
  formatter["float_kind"] = py::str("{:.6g}").attr("format");
  formatter["int_kind"] = py::str("{}").attr("format");
  const py::object text = py::module_::import("numpy").attr("array2string")(
      array, py::arg("separator") = ", ", py::arg("threshold") = kShown, py::arg("edgeitems") = 2,
      py::arg("formatter") = formatter);
  const std::string line = py::str(" ")
                               .attr("join")(text.attr("split")())
                               .cast<std::string>();  // rows end with newlines
  return array.size() > kShown ? line + " of shape " + shapeOf(array) : line;
}

std::string textOfValue(const py::object& value) {
  return py::isinstance<py::array>(value) ? textOfArray(py::array(value))
                                          : py::repr(value).cast<std::string>();
}

}  // namespace

std::string TextOf::operator()(const py::object& self) const {
  std::string text = py::type::of(self).attr("__name__").cast<std::string>() + "(", separator;
  for (const char* name : *attributes_) {
    text += separator + name + "=" + textOfValue(self.attr(name));
    separator = ", ";
  }
  return text + ")";
}

}  // namespace adaptive_bvh::python
