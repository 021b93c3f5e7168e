#include "objects.h"

namespace adaptive_bvh::python {
namespace {

const Model* modelOf(const py::object& object) {
  return py::isinstance<Model>(object) ? &object.cast<const Model&>() : nullptr;
}

const Shape* asShape(const py::object& object) {
  return py::isinstance<Shape>(object) ? &object.cast<const Shape&>() : nullptr;
}

void requireFaces(const Model& model) {
  if (model.numFaces() == 0)
    throw py::value_error("a model has no triangles: it can be updated, but not queried");
}

std::string typeOf(const py::object& object) {
  return py::str(py::type::of(object).attr("__name__"));
}

}  // namespace

Objects objectsFrom(const py::object& o1, const py::object& o2, const py::object& tf1,
                    const py::object& tf2) {
  Objects objects;
  objects.first = modelOf(o1);
  objects.second = modelOf(o2);
  objects.is_swapped = !objects.first;
  if (objects.is_swapped) std::swap(objects.first, objects.second);
  if (!objects.second) objects.shape = asShape(objects.is_swapped ? o1 : o2);
  if (!objects.first || (!objects.second && !objects.shape))
    throw py::type_error("a Model and another, or a Model and a Shape, are needed, not " +
                         typeOf(o1) + " and " + typeOf(o2));
  requireFaces(*objects.first);
  if (objects.second) requireFaces(*objects.second);
  objects.tf1 = poseFrom(objects.is_swapped ? tf2 : tf1, objects.is_swapped ? "tf2" : "tf1");
  objects.tf2 = poseFrom(objects.is_swapped ? tf1 : tf2, objects.is_swapped ? "tf1" : "tf2");
  return objects;
}

}  // namespace adaptive_bvh::python
