#include <pybind11/pybind11.h>

#include "contact_regions.h"
#include "continuous.h"
#include "docs.h"
#include "feature_details.h"
#include "features.h"
#include "inside.h"
#include "locked_mesh.h"
#include "meshes.h"
#include "pairs.h"
#include "penetration.h"
#include "points.h"
#include "proximity.h"
#include "query.h"
#include "rays.h"
#include "recording.h"
#include "scene.h"
#include "shapes.h"

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
  bindRecording(module);
  module.attr("__name__") = name;
}
