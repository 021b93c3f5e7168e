#include <pybind11/pybind11.h>

#include <chrono>
#include <thread>

#include "adaptive_bvh/interruption.h"
#include "bind.h"

namespace adaptive_bvh::python {

namespace py = pybind11;

namespace {

/// pybind11 works in the main interpreter only: it takes the GIL by PyGILState_Ensure, which waits
/// for ever in another one.
bool isMainInterpreter() { return PyInterpreterState_Get() == PyInterpreterState_Main(); }
constexpr const char* kOtherInterpreter = "adaptive_bvh does not work in a subinterpreter";

/// Python's main thread, where its signal handlers run; none if another thread imports the module.
std::thread::id main_thread;

/// Ends a query of the main thread when a handler raises, as that of Ctrl-C does. Seldom, because
/// other threads may take 5 ms to hand over the GIL.
void checkSignals() {
  if (std::this_thread::get_id() != main_thread) return;
  using Clock = std::chrono::steady_clock;
  static Clock::time_point last;  // of the main thread alone
  if (Clock::now() - last < std::chrono::milliseconds(100)) return;
  last = Clock::now();
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void letSignalsEndQueries() {
  const py::module_ threading = py::module_::import("threading");
  if (threading.attr("current_thread")().is(threading.attr("main_thread")()))
    main_thread = std::this_thread::get_id();
  setInterruptionCheck(checkSignals);
}

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
  bindIgnored(module);
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
  letSignalsEndQueries();
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
