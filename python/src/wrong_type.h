#pragma once

#include <string>

#include <pybind11/pybind11.h>

// What sentences of errors say of objects of another type.
namespace adaptive_bvh::python {

namespace py = pybind11;

/// The name of an object's type; of a class "class" and its name.
std::string typeNameOf(const py::handle& object);

/// The end of a sentence that says how a mesh is made of what was passed for one: a file's name, a
/// shape, arrays, or an object with vertices and faces. Empty for other objects, and for arrays of
/// one number.
std::string howToMesh(const py::handle& object);

}  // namespace adaptive_bvh::python
