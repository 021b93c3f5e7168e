#include <algorithm>

#include <pybind11/pybind11.h>

#include "bind.h"
#include "docs.h"

namespace adaptive_bvh::python {

namespace py = pybind11;

namespace {

/// pybind11 works in the main interpreter only: it takes the GIL by PyGILState_Ensure, which waits
/// for ever in another one.
bool isMainInterpreter() { return PyInterpreterState_Get() == PyInterpreterState_Main(); }
constexpr const char* kOtherInterpreter = "adaptive_bvh does not work in a subinterpreter";

/// The protocols 0 and 1 make a pickled object of any class without its __new__, which pybind11
/// answers by ending the process. So they get what protocol 2 gets: what a class says about itself,
/// or a TypeError.
void definePickling(py::module_& module) {
  const py::object of_object =
      py::reinterpret_borrow<py::object>(reinterpret_cast<PyObject*>(&PyBaseObject_Type))
          .attr("__reduce_ex__");
  for (const auto& item : py::dict(module.attr("__dict__"))) {
    if (!PyType_Check(item.second.ptr())) continue;
    if (!py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(item.second.ptr()))) continue;
    item.second.attr("__reduce_ex__") = py::cpp_function(
        [of_object](const py::object& self, int protocol) {
          return of_object(self, std::max(protocol, 2));
        },
        py::name("__reduce_ex__"), py::is_method(item.second), py::arg("protocol"));
  }
}

}  // namespace
}  // namespace adaptive_bvh::python

#define PyInit__core initCore  // the function that PYBIND11_MODULE defines

// The module adaptive_bvh._core. adaptive_bvh/__init__.py names what is public.
PYBIND11_MODULE(_core, module) {
  using namespace adaptive_bvh::python;
  module.doc() = docs::kModule;
  module.attr("__version__") = ADAPTIVE_BVH_PYTHON_VERSION;
  // Types say where they can be imported from, in docstrings and errors.
  const py::object name = module.attr("__name__");
  module.attr("__name__") = "adaptive_bvh";
  bindShapes(module);  // first: signatures of what follows name these types
  bindLockedMesh(module);
  bindQuery(module);
  bindPairs(module);
  bindFeatures(module);
  bindFeatureDetails(module);
  bindProximity(module);
  bindPoints(module);
  bindRays(module);
  bindPenetration(module);
  bindInside(module);
  bindContactRegions(module);
  bindContinuous(module);
  bindScene(module);
  bindMeshes(module);
#ifdef ADAPTIVE_BVH_PYTHON_RECORDING
  bindRecording(module);
#endif
  definePickling(module);
  module.def("_require_main_interpreter", [] {
    if (!isMainInterpreter()) throw pybind11::import_error(kOtherInterpreter);
  });
  module.attr("__name__") = name;
}

#undef PyInit__core

/// Called where no interpreter has imported the module before. Others get a copy of the module of
/// the first one: they call _require_main_interpreter.
extern "C" PYBIND11_EXPORT PyObject* PyInit__core() {
  if (adaptive_bvh::python::isMainInterpreter()) return initCore();
  PyErr_SetString(PyExc_ImportError, adaptive_bvh::python::kOtherInterpreter);
  return nullptr;
}
