#include "objects.h"

#include <utility>

namespace adaptive_bvh::python {

const LockedMesh* asMesh(const py::object& object) {
  return py::isinstance<LockedMesh>(object) ? &object.cast<const LockedMesh&>() : nullptr;
}

const Shape* asShape(const py::object& object) {
  return py::isinstance<Shape>(object) ? &object.cast<const Shape&>() : nullptr;
}

Objects::Objects(const py::object& o1, const py::object& o2, const py::object& pose1,
                 const py::object& pose2)
    : first(asMesh(o1)), second(asMesh(o2)), is_swapped(!first) {
  if (is_swapped) std::swap(first, second);
  if (!second) shape = asShape(is_swapped ? o1 : o2);
  if (!first || (!second && !shape))
    throw py::type_error("two objects are needed, each a DeformableMesh or a Shape, not " +
                         typeNameOf(o1) + " and " + typeNameOf(o2) +
                         howToMesh(asMesh(o1) || asShape(o1) ? o2 : o1));
  tf1 = poseFrom(is_swapped ? pose2 : pose1, is_swapped ? "tf2" : "tf1");
  tf2 = poseFrom(is_swapped ? pose1 : pose2, is_swapped ? "tf1" : "tf2");
}

}  // namespace adaptive_bvh::python
