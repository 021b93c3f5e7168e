#include <algorithm>
#include <tuple>

#include <pybind11/stl.h>

#include "adaptive_bvh/scene.h"
#include "arrays.h"
#include "bind.h"
#include "continuous_docs.h"
#include "features.h"
#include "motion.h"
#include "results.h"

namespace adaptive_bvh::python {

MeshMotion::MeshMotion(const LockedMesh& mesh, const py::object& start, const py::object& end,
                       const py::object& start_tf, const py::object& end_tf)
    : mesh_(mesh.shared_from_this()),
      start_tf_(poseFrom(start_tf, "start_tf")),
      end_tf_(poseFrom(end_tf, "end_tf")) {
  mesh_->query([&](const Mesh& m) {  // both of one frame
    if (start.is_none()) start_ = m.previousVertices();
    if (end.is_none()) end_ = m.vertices();
  });
  if (start.is_none() && start_.empty())
    throw py::value_error(
        "start is missing: the last update was not update_two_frames, so the mesh has no "
        "positions before");
  const auto copy = [&](const py::object& positions, const char* name, auto& copied) {
    if (positions.is_none()) return;
    const Rows rows(positions, name);
    requireRows(rows.array(), mesh_->numVertices(), name);
    copied.assign(rows.begin(), rows.end());
  };
  copy(start, "start", start_);
  copy(end, "end", end_);
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

/// The pair of one kind that Python names by two numbers. Throws py::index_error when there are no
/// such features.
FeaturePair pairFrom(FeatureKind kind, const py::object& numbers, const LockedMesh& first,
                     const LockedMesh& second) {
  py::list rows;
  rows.append(numbers);
  const FeaturePair pair = pairsFrom(rows, "pair").at(0);
  FeaturePairs pairs;
  (kind == FeatureKind::VertexFace   ? pairs.vertex_face
   : kind == FeatureKind::FaceVertex ? pairs.face_vertex
                                     : pairs.edge_edge)
      .push_back(pair);
  checkedPairs(pairs, first, second);
  return pair;
}

const char* kindOf(const Impact& impact) { return kKinds[static_cast<int>(impact.kind)]; }

py::tuple pairOf(const Impact& impact) {
  const auto number = [](unsigned of_feature) {
    return of_feature == SceneImpact::kNoFeature ? -1 : std::int64_t(of_feature);
  };
  return py::make_tuple(number(impact.pair.first), number(impact.pair.second));
}

void bindMotion(py::module_& module) {
  py::class_<MeshMotion>(module, "Motion", docs::kMotion)
      .def(py::init<const LockedMesh&, const py::object&, const py::object&, const py::object&,
                    const py::object&>(),
           py::arg("mesh"), py::arg("start") = py::none(), py::arg("end") = py::none(),
           py::arg("start_tf") = py::none(), py::arg("end_tf") = py::none(), docs::kMotionInit);
  ResultClass<Impact> impact(module, "Impact", "Two features that come together first.");
  impact
      .attribute("time", &Impact::time,
                 "0 to 1, or infinity when nothing comes together: then the rest means nothing.")
      .attribute("kind", &kindOf,
                 "'vertex-face', 'face-vertex' or 'edge-edge': the first mesh's feature first.")
      .attribute("pair", &pairOf,
                 "The numbers of the two features, as in FeaturePairs; -1 of a shape.");
  (*impact).def_property_readonly("happens", &Impact::happens, "Whether anything comes together.");
  ResultClass<ImpactTimes>(module, "ImpactTimes",
                           "A time for each of some FeaturePairs: 0 to 1, or infinity where they "
                           "do not come together.")
      .attribute("vertex_face", &ImpactTimes::vertex_face, "(K,) float64.")
      .attribute("face_vertex", &ImpactTimes::face_vertex, "(K,) float64.")
      .attribute("edge_edge", &ImpactTimes::edge_edge, "(K,) float64.");
}

/// Defines a function of two motions, and of one with itself: both return
/// query(separation, motions...).
template <typename Query>
void define(py::module_& module, const char* name, const Query& query, const char* doc,
            const char* doc_within_one = docs::kWithinOne) {
  module.def(
      name,
      [query](const MeshMotion& first, const MeshMotion& second, double separation) {
        return query(separation, first, second);
      },
      py::arg("first"), py::arg("second"), py::arg("separation") = 0.0, doc);
  module.def(
      name,
      [query](const MeshMotion& motion, double separation) { return query(separation, motion); },
      py::arg("motion"), py::arg("separation") = 0.0, doc_within_one);
}

void bindCandidates(py::module_& module) {
  const auto query = [](double separation, const auto&... motions) {
    FeaturePairs pairs;
    queryMotions([&](const auto&... m) { candidates(m..., separation, pairs); }, motions...);
    return pairs;
  };
  define(module, "candidates", query, docs::kCandidates);
}

template <typename... Motions>
double timeOfImpactOf(const std::string& name, const py::object& pair, double separation,
                      const MeshMotion& first, const Motions&... second) {
  const FeatureKind kind = kindFrom(name);
  const MeshMotion& last = std::get<sizeof...(second)>(std::tie(first, second...));
  const FeaturePair two = pairFrom(kind, pair, first.mesh(), last.mesh());
  return queryMotions([&](const auto&... m) { return timeOfImpact(m..., kind, two, separation); },
                      first, second...);
}

void bindTimeOfImpact(py::module_& module) {
  module.def(
      "time_of_impact",
      [](const MeshMotion& first, const MeshMotion& second, const std::string& kind,
         const py::object& pair,
         double separation) { return timeOfImpactOf(kind, pair, separation, first, second); },
      py::arg("first"), py::arg("second"), py::arg("kind"), py::arg("pair"),
      py::arg("separation") = 0.0, docs::kTimeOfImpact);
  module.def(
      "time_of_impact",
      [](const MeshMotion& motion, const std::string& kind, const py::object& pair,
         double separation) { return timeOfImpactOf(kind, pair, separation, motion); },
      py::arg("motion"), py::arg("kind"), py::arg("pair"), py::arg("separation") = 0.0,
      docs::kWithinOne);
}

template <typename... Motions>
ImpactTimes timesOfImpactOf(const FeaturePairs& pairs, double separation, const MeshMotion& first,
                            const Motions&... second) {
  const MeshMotion& last = std::get<sizeof...(second)>(std::tie(first, second...));
  const FeaturePairs all = checkedPairs(pairs, first.mesh(), last.mesh());
  ImpactTimes times;
  queryMotions([&](const auto&... m) { timesOfImpact(m..., all, separation, times); }, first,
               second...);
  return times;
}

void bindTimesOfImpact(py::module_& module) {
  module.def(
      "times_of_impact",
      [](const MeshMotion& first, const MeshMotion& second, const FeaturePairs& pairs,
         double separation) { return timesOfImpactOf(pairs, separation, first, second); },
      py::arg("first"), py::arg("second"), py::arg("pairs"), py::arg("separation") = 0.0,
      docs::kTimesOfImpact);
  module.def(
      "times_of_impact",
      [](const MeshMotion& motion, const FeaturePairs& pairs, double separation) {
        return timesOfImpactOf(pairs, separation, motion);
      },
      py::arg("motion"), py::arg("pairs"), py::arg("separation") = 0.0, docs::kWithinOne);
}

void bindEarliestImpact(py::module_& module) {
  const auto query = [](double separation, const auto&... motions) {
    return queryMotions([&](const auto&... m) { return earliestImpact(m..., separation); },
                        motions...);
  };
  define(module, "earliest_impact", query, docs::kEarliestImpact);
  const auto safe_step = [query](double separation, const auto&... motions) {
    return std::min(query(separation, motions...).time, 1.0);
  };
  define(module, "largest_safe_step", safe_step, docs::kLargestSafeStep);
}

py::object safeDisplacementsOf(double separation, const MeshMotion& motion) {
  std::vector<double> lengths;
  queryMotions([&](const auto& m) { safeDisplacements(m, separation, lengths); }, motion);
  return adopt(std::move(lengths));
}

py::object safeDisplacementsOf(double separation, const MeshMotion& first,
                               const MeshMotion& second) {
  std::vector<double> of_first, of_second;
  queryMotions([&](const auto& a,
                   const auto& b) { safeDisplacements(a, b, separation, of_first, of_second); },
               first, second);
  return py::make_tuple(adopt(std::move(of_first)), adopt(std::move(of_second)));
}

void bindSafeDisplacements(py::module_& module) {
  const auto query = [](double separation, const auto&... motions) {
    return safeDisplacementsOf(separation, motions...);
  };
  define(module, "safe_displacements", query, docs::kSafeDisplacements,
         docs::kSafeDisplacementsOne);
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
