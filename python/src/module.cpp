#include <pybind11/pybind11.h>

#include "bind.h"

namespace adaptive_bvh::python {

namespace py = pybind11;

namespace {

/// pybind11 works in the main interpreter only: it takes the GIL by PyGILState_Ensure, which waits
/// for ever in another one.
bool isMainInterpreter() { return PyInterpreterState_Get() == PyInterpreterState_Main(); }
constexpr const char* kOtherInterpreter = "adaptive_bvh does not work in a subinterpreter";

}  // namespace
}  // namespace adaptive_bvh::python

#define PyInit__core initCore  // the function that PYBIND11_MODULE defines

// The module adaptive_bvh._core. adaptive_bvh/__init__.py names what is public.
PYBIND11_MODULE(_core, module) {
  using namespace adaptive_bvh::python;
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
  bindDerivatives(module);
  bindInside(module);
  bindContactRegions(module);
  bindContinuous(module);
  bindMotions(module);
  bindTrustRegion(module);
  bindScene(module);
  bindContactSet(module);
  bindMeshes(module);
#ifdef ADAPTIVE_BVH_PYTHON_MESH_IO
  bindFiles(module);
#endif
#ifdef ADAPTIVE_BVH_PYTHON_RECORDING
  bindRecording(module);
#endif
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
