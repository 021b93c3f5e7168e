#include <algorithm>

#include <pybind11/stl.h>

#include "adaptive_bvh/scene.h"
#include "arrays.h"
#include "bind.h"
#include "continuous_docs.h"
#include "features.h"
#include "locked_mesh.h"
#include "pose.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace {

/// Python's Motion: a mesh, and copies of its positions at two times.
class MeshMotion : public Bound {
 public:
  /// Each of `start` and `end` may be None: the mesh's positions before and at present. Throws as
  /// Rows and poseFrom, and py::value_error when a number of positions is not that of the
  /// vertices or there are none before.
  MeshMotion(const LockedMesh& mesh, const py::object& start, const py::object& end,
             const py::object& start_tf, const py::object& end_tf);

  const LockedMesh& mesh() const { return *mesh_; }

  /// For the library, while the mesh is locked. Refers to this object.
  Motion<double> motion() const { return {mesh_->mesh(), start_, end_, start_tf_, end_tf_}; }

 private:
  std::shared_ptr<const LockedMesh> mesh_;
  std::vector<fcl::Vector3d> start_, end_;
  fcl::Transform3d start_tf_, end_tf_;
};

/// Runs `f(motion)` on the library's motion, without the GIL; likewise `f(first, second)`.
template <typename F>
auto queryMotions(const F& f, const MeshMotion& motion) {
  return motion.mesh().query([&](const Mesh&) { return f(motion.motion()); });
}
template <typename F>
auto queryMotions(const F& f, const MeshMotion& first, const MeshMotion& second) {
  return queryPair(first.mesh(), second.mesh(),
                   [&](const Mesh&, const Mesh&) { return f(first.motion(), second.motion()); });
}

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
           "mesh"_a, "start"_a = py::none(), "end"_a = py::none(), "start_tf"_a = py::none(),
           "end_tf"_a = py::none(), docs::kMotionInit);
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

/// Defines a function of two motions, and of one with itself. Both return
/// query(others..., separation, motions...). `names` are those of the others.
template <typename... Others, typename Query, typename... Names>
void define(py::module_& module, const char* name, const Query& query, const char* doc,
            const char* doc_within_one, const Names&... names) {
  module.def(
      name,
      [query](const MeshMotion& first, const MeshMotion& second, const Others&... others,
              double separation) { return query(others..., separation, first, second); },
      "first"_a, "second"_a, names..., "separation"_a = 0.0, doc);
  module.def(
      name,
      [query](const MeshMotion& motion, const Others&... others, double separation) {
        return query(others..., separation, motion);
      },
      "motion"_a, names..., "separation"_a = 0.0, doc_within_one);
}

/// The meshes of a motion, or of two: which has the first feature of a pair, and which the second.
const LockedMesh& firstMesh(const MeshMotion& first) { return first.mesh(); }
const LockedMesh& firstMesh(const MeshMotion& first, const MeshMotion&) { return first.mesh(); }
const LockedMesh& secondMesh(const MeshMotion& only) { return only.mesh(); }
const LockedMesh& secondMesh(const MeshMotion&, const MeshMotion& second) { return second.mesh(); }

void bindCandidates(py::module_& module) {
  const auto query = [](double separation, const auto&... motions) {
    FeaturePairs pairs;
    queryMotions([&](const auto&... m) { candidates(m..., separation, pairs); }, motions...);
    return pairs;
  };
  define(module, "candidates", query, docs::kCandidates, docs::kWithinOne);
}

void bindTimesOfImpact(py::module_& module) {
  const auto time = [](const std::string& name, const py::object& pair, double separation,
                       const auto&... motions) {
    const FeatureKind kind = kindFrom(name);
    const FeaturePair two = pairFrom(kind, pair, firstMesh(motions...), secondMesh(motions...));
    return queryMotions([&](const auto&... m) { return timeOfImpact(m..., kind, two, separation); },
                        motions...);
  };
  define<std::string, py::object>(module, "time_of_impact", time, docs::kTimeOfImpact,
                                  docs::kWithinOne, "kind"_a, "pair"_a);
  const auto times = [](const FeaturePairs& pairs, double separation, const auto&... motions) {
    const FeaturePairs all = checkedPairs(pairs, firstMesh(motions...), secondMesh(motions...));
    ImpactTimes result;
    queryMotions([&](const auto&... m) { timesOfImpact(m..., all, separation, result); },
                 motions...);
    return result;
  };
  define<FeaturePairs>(module, "times_of_impact", times, docs::kTimesOfImpact, docs::kWithinOne,
                       "pairs"_a);
}

void bindEarliestImpact(py::module_& module) {
  const auto query = [](double separation, const auto&... motions) {
    return queryMotions([&](const auto&... m) { return earliestImpact(m..., separation); },
                        motions...);
  };
  define(module, "earliest_impact", query, docs::kEarliestImpact, docs::kWithinOne);
  const auto safe_step = [query](double separation, const auto&... motions) {
    return std::min(query(separation, motions...).time, 1.0);
  };
  define(module, "largest_safe_step", safe_step, docs::kLargestSafeStep, docs::kWithinOne);
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
  bindTimesOfImpact(module);
  bindEarliestImpact(module);
  bindSafeDisplacements(module);
}

}  // namespace adaptive_bvh::python
