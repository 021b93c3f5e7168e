#include "objects.h"

namespace adaptive_bvh::python {
namespace {

const LockedMesh* meshOf(const py::object& object) {
  return py::isinstance<LockedMesh>(object) ? &object.cast<const LockedMesh&>() : nullptr;
}

const Shape* asShape(const py::object& object) {
  return py::isinstance<Shape>(object) ? &object.cast<const Shape&>() : nullptr;
}

std::string typeOf(const py::object& object) {
  return py::str(py::type::of(object).attr("__name__"));
}

}  // namespace

Objects objectsFrom(const py::object& o1, const py::object& o2, const py::object& tf1,
                    const py::object& tf2) {
  Objects objects;
  objects.first = meshOf(o1);
  objects.second = meshOf(o2);
  objects.is_swapped = !objects.first;
  if (objects.is_swapped) std::swap(objects.first, objects.second);
  if (!objects.second) objects.shape = asShape(objects.is_swapped ? o1 : o2);
  if (!objects.first || (!objects.second && !objects.shape))
    throw py::type_error(
        "a DeformableMesh and another, or a DeformableMesh and a Shape, are needed, not " +
        typeOf(o1) + " and " + typeOf(o2));
  objects.tf1 = poseFrom(objects.is_swapped ? tf2 : tf1, objects.is_swapped ? "tf2" : "tf1");
  objects.tf2 = poseFrom(objects.is_swapped ? tf1 : tf2, objects.is_swapped ? "tf1" : "tf2");
  return objects;
}

}  // namespace adaptive_bvh::python
