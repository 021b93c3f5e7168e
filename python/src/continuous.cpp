#include "continuous.h"

#include <algorithm>

#include <pybind11/stl.h>

#include "adaptive_bvh/scene.h"
#include "continuous_docs.h"
#include "features.h"
#include "motion.h"
#include "text.h"

namespace adaptive_bvh::python {

MeshMotion::MeshMotion(const LockedMesh& mesh, const py::object& start, const py::object& end,
                       const py::object& start_tf, const py::object& end_tf)
    : mesh_(mesh.shared_from_this()),
      start_tf_(poseFrom(start_tf, "start_tf")),
      end_tf_(poseFrom(end_tf, "end_tf")) {
  if (mesh_->isDouble())
    positions_ = positionsFrom<double>(start, end);
  else
    positions_ = positionsFrom<float>(start, end);
}

template <typename S>
MeshMotion::Positions<S> MeshMotion::positionsFrom(const py::object& start,
                                                   const py::object& end) const {
  Positions<S> positions;
  mesh_->queryAs<S>([&](const auto& mesh) {  // both of one frame
    if (start.is_none()) positions.start = mesh.previousVertices();
    if (end.is_none()) positions.end = mesh.vertices();
  });
  if (start.is_none() && positions.start.empty())
    throw py::value_error(
        "start is missing: the last update was not update_two_frames, so the mesh has no "
        "positions before");
  const auto copy = [&](const py::object& rows, const char* name, auto& copied) {
    if (rows.is_none()) return;
    const Rows<S> numbers = rowsFrom<S>(rows, name);
    requireRows(numbers, mesh_->numVertices(), name);
    copied.assign(pointsOf<S>(numbers), pointsOf<S>(numbers) + mesh_->numVertices());
  };
  copy(start, "start", positions.start);
  copy(end, "end", positions.end);
  return positions;
}

namespace {

/// Names are also those of the properties of FeaturePairs, with a hyphen.
constexpr const char* kKinds[] = {"vertex-face", "face-vertex", "edge-edge"};

FeatureKind kindFrom(const std::string& name) {
  for (const auto kind : {FeatureKind::VertexFace, FeatureKind::FaceVertex, FeatureKind::EdgeEdge})
    if (name == kKinds[static_cast<int>(kind)]) return kind;
  throw py::value_error("kind is '" + name +
                        "'; 'vertex-face', 'face-vertex' or 'edge-edge' is needed");
}

/// How many features of each kind the two meshes have, for indices.
struct Limits {
  Limits(const LockedMesh& first, const LockedMesh& second)
      : vertices1(first.numVertices()),
        faces1(first.numFaces()),
        vertices2(second.numVertices()),
        faces2(second.numFaces()) {}

  std::vector<FeaturePair> pairs(FeatureKind kind, const py::object& object,
                                 const char* name) const {
    switch (kind) {
      case FeatureKind::VertexFace: return pairsFrom<FeaturePair>(object, vertices1, faces2, name);
      case FeatureKind::FaceVertex: return pairsFrom<FeaturePair>(object, faces1, vertices2, name);
      default: return pairsFrom<FeaturePair>(object, 3 * faces1, 3 * faces2, name);
    }
  }
  FeaturePairs all(const FeatureArrays& arrays) const {
    FeaturePairs result;
    result.vertex_face = pairs(FeatureKind::VertexFace, arrays.vertex_face, "vertex_face");
    result.face_vertex = pairs(FeatureKind::FaceVertex, arrays.face_vertex, "face_vertex");
    result.edge_edge = pairs(FeatureKind::EdgeEdge, arrays.edge_edge, "edge_edge");
    return result;
  }
  FeaturePair one(FeatureKind kind, const py::object& object) const {
    py::list rows;
    rows.append(object);
    return pairs(kind, rows, "pair").at(0);
  }

  std::size_t vertices1, faces1, vertices2, faces2;
};

/// Python's ImpactTimes.
struct Times : Bound {
  py::array_t<double> vertex_face, face_vertex, edge_edge;
};

Times timesOf(ImpactTimes&& times) {
  const auto array = [](std::vector<double>&& list) {
    const auto count = static_cast<py::ssize_t>(list.size());
    return adopt<double>(std::move(list), {count});
  };
  Times arrays;
  arrays.vertex_face = array(std::move(times.vertex_face));
  arrays.face_vertex = array(std::move(times.face_vertex));
  arrays.edge_edge = array(std::move(times.edge_edge));
  return arrays;
}

py::array_t<double> lengthsOf(std::vector<double>&& lengths) {
  const auto count = static_cast<py::ssize_t>(lengths.size());
  return adopt<double>(std::move(lengths), {count});
}

void bindMotion(py::module_& module) {
  py::class_<MeshMotion>(module, "Motion", docs::kMotion)
      .def(py::init<const LockedMesh&, const py::object&, const py::object&, const py::object&,
                    const py::object&>(),
           py::arg("mesh"), py::arg("start") = py::none(), py::arg("end") = py::none(),
           py::arg("start_tf") = py::none(), py::arg("end_tf") = py::none(), docs::kMotionInit);
  py::class_<FirstImpact>(module, "Impact", "Two features that come together first.")
      .def_property_readonly(
          "time", [](const FirstImpact& self) { return self.impact.time; },
          "0 to 1, or infinity when nothing comes together: then the rest means nothing.")
      .def_property_readonly(
          "kind",
          [](const FirstImpact& self) { return kKinds[static_cast<int>(self.impact.kind)]; },
          "'vertex-face', 'face-vertex' or 'edge-edge': the first mesh's feature first.")
      .def_property_readonly(
          "pair",
          [](const FirstImpact& self) {
            const auto number = [](unsigned of_feature) {
              return of_feature == SceneImpact::kNoFeature ? -1 : std::int64_t(of_feature);
            };
            return py::make_tuple(number(self.impact.pair.first), number(self.impact.pair.second));
          },
          "The numbers of the two features, as in FeaturePairs; -1 of a shape.")
      .def_property_readonly(
          "happens", [](const FirstImpact& self) { return self.impact.happens(); },
          "Whether anything comes together.")
      .def("__repr__", TextOf({"time", "kind", "pair"}));
  py::class_<Times>(module, "ImpactTimes",
                    "A time for each of some FeaturePairs: 0 to 1, or infinity where they do not "
                    "come together.")
      .def_readonly("vertex_face", &Times::vertex_face, "(K,) float64.")
      .def_readonly("face_vertex", &Times::face_vertex, "(K,) float64.")
      .def_readonly("edge_edge", &Times::edge_edge, "(K,) float64.")
      .def("__repr__", TextOf({"vertex_face", "face_vertex", "edge_edge"}));
}

void bindCandidates(py::module_& module) {
  module.def(
      "candidates",
      [](const MeshMotion& first, const MeshMotion& second, double separation) {
        FeaturePairs pairs;
        queryMotions(first, second,
                     [&](const auto& a, const auto& b) { candidates(a, b, separation, pairs); });
        return FeatureArrays(std::move(pairs));
      },
      py::arg("first"), py::arg("second"), py::arg("separation") = 0.0, docs::kCandidates);
  module.def(
      "candidates",
      [](const MeshMotion& motion, double separation) {
        FeaturePairs pairs;
        queryMotion(motion, [&](const auto& m) { candidates(m, separation, pairs); });
        return FeatureArrays(std::move(pairs));
      },
      py::arg("motion"), py::arg("separation") = 0.0, docs::kWithinOne);
}

void bindTimeOfImpact(py::module_& module) {
  module.def(
      "time_of_impact",
      [](const MeshMotion& first, const MeshMotion& second, const std::string& kind,
         const py::object& pair, double separation) {
        const FeatureKind what = kindFrom(kind);
        const FeaturePair two = Limits(first.mesh(), second.mesh()).one(what, pair);
        return queryMotions(first, second, [&](const auto& a, const auto& b) {
          return timeOfImpact(a, b, what, two, separation);
        });
      },
      py::arg("first"), py::arg("second"), py::arg("kind"), py::arg("pair"),
      py::arg("separation") = 0.0, docs::kTimeOfImpact);
  module.def(
      "time_of_impact",
      [](const MeshMotion& motion, const std::string& kind, const py::object& pair,
         double separation) {
        const FeatureKind what = kindFrom(kind);
        const FeaturePair two = Limits(motion.mesh(), motion.mesh()).one(what, pair);
        return queryMotion(motion,
                           [&](const auto& m) { return timeOfImpact(m, what, two, separation); });
      },
      py::arg("motion"), py::arg("kind"), py::arg("pair"), py::arg("separation") = 0.0,
      docs::kWithinOne);
}

void bindTimesOfImpact(py::module_& module) {
  module.def(
      "times_of_impact",
      [](const MeshMotion& first, const MeshMotion& second, const FeatureArrays& pairs,
         double separation) {
        const FeaturePairs all = Limits(first.mesh(), second.mesh()).all(pairs);
        ImpactTimes times;
        queryMotions(first, second, [&](const auto& a, const auto& b) {
          timesOfImpact(a, b, all, separation, times);
        });
        return timesOf(std::move(times));
      },
      py::arg("first"), py::arg("second"), py::arg("pairs"), py::arg("separation") = 0.0,
      docs::kTimesOfImpact);
  module.def(
      "times_of_impact",
      [](const MeshMotion& motion, const FeatureArrays& pairs, double separation) {
        const FeaturePairs all = Limits(motion.mesh(), motion.mesh()).all(pairs);
        ImpactTimes times;
        queryMotion(motion, [&](const auto& m) { timesOfImpact(m, all, separation, times); });
        return timesOf(std::move(times));
      },
      py::arg("motion"), py::arg("pairs"), py::arg("separation") = 0.0, docs::kWithinOne);
}

void bindEarliestImpact(py::module_& module) {
  const auto of_two = [](const MeshMotion& first, const MeshMotion& second, double separation) {
    return FirstImpact{{}, queryMotions(first, second, [&](const auto& a, const auto& b) {
                         return earliestImpact(a, b, separation);
                       })};
  };
  const auto of_one = [](const MeshMotion& motion, double separation) {
    return FirstImpact{
        {}, queryMotion(motion, [&](const auto& m) { return earliestImpact(m, separation); })};
  };
  module.def("earliest_impact", of_two, py::arg("first"), py::arg("second"),
             py::arg("separation") = 0.0, docs::kEarliestImpact);
  module.def("earliest_impact", of_one, py::arg("motion"), py::arg("separation") = 0.0,
             docs::kWithinOne);
  module.def(
      "largest_safe_step",
      [of_two](const MeshMotion& first, const MeshMotion& second, double separation) {
        return std::min(of_two(first, second, separation).impact.time, 1.0);
      },
      py::arg("first"), py::arg("second"), py::arg("separation") = 0.0, docs::kLargestSafeStep);
  module.def(
      "largest_safe_step",
      [of_one](const MeshMotion& motion, double separation) {
        return std::min(of_one(motion, separation).impact.time, 1.0);
      },
      py::arg("motion"), py::arg("separation") = 0.0, docs::kWithinOne);
}

void bindSafeDisplacements(py::module_& module) {
  module.def(
      "safe_displacements",
      [](const MeshMotion& first, const MeshMotion& second, double separation) {
        std::vector<double> of_first, of_second;
        queryMotions(first, second, [&](const auto& a, const auto& b) {
          safeDisplacements(a, b, separation, of_first, of_second);
        });
        return py::make_tuple(lengthsOf(std::move(of_first)), lengthsOf(std::move(of_second)));
      },
      py::arg("first"), py::arg("second"), py::arg("separation") = 0.0, docs::kSafeDisplacements);
  module.def(
      "safe_displacements",
      [](const MeshMotion& motion, double separation) {
        std::vector<double> of_vertices;
        queryMotion(motion, [&](const auto& m) { safeDisplacements(m, separation, of_vertices); });
        return lengthsOf(std::move(of_vertices));
      },
      py::arg("motion"), py::arg("separation") = 0.0, docs::kSafeDisplacementsOne);
}

}  // namespace

void bindContinuous(py::module_& module) {
  bindMotion(module);
  bindCandidates(module);
  bindTimeOfImpact(module);
  bindTimesOfImpact(module);
  bindEarliestImpact(module);
  bindSafeDisplacements(module);
}

}  // namespace adaptive_bvh::python
