#include "wrong_type.h"

#include <pybind11/numpy.h>

#include "shapes.h"

namespace adaptive_bvh::python {
namespace {

bool isFileName(const py::handle& object) {
  return py::isinstance<py::str>(object) || py::isinstance<py::bytes>(object) ||
         py::hasattr(object, "__fspath__");
}

bool isSequence(const py::handle& object) {
  if (py::isinstance<py::array>(object)) return object.attr("size").cast<py::ssize_t>() > 1;
  return py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object);
}

}  // namespace

std::string typeNameOf(const py::handle& object) {
  if (PyType_Check(object.ptr())) return "class " + std::string(py::str(object.attr("__name__")));
  return py::str(py::type::handle_of(object).attr("__name__"));
}

std::string howToMesh(const py::handle& object) {
  if (PyType_Check(object.ptr())) return "";
  if (isFileName(object)) return "; to read a file, call DeformableMesh(load_mesh(path))";
  if (py::isinstance<Shape>(object))
    return "; for a shape's surface, call DeformableMesh(shape_mesh(shape))";
  if (py::hasattr(object, "vertices") && py::hasattr(object, "faces"))
    return "; to make one of vertices and faces, call DeformableMesh(object)";
  if (isSequence(object)) return "; to make one of arrays, call DeformableMesh(vertices, faces)";
  return "";
}

}  // namespace adaptive_bvh::python
