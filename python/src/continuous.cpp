#include <algorithm>

#include <pybind11/stl.h>

#include "adaptive_bvh/scene.h"
#include "arrays.h"
#include "bind.h"
#include "features.h"
#include "motions.h"
#include "results.h"

namespace adaptive_bvh::python {
// `distance` is a length: features that are so near have come together.
namespace docs {
constexpr const char* kMotion =
    R"(How a mesh or a shape moves from t = 0 to 1. With the path 'straight' every point moves on a
straight line in the world, so a body that turns shrinks in between. With 'screw' the body turns
about an axis by at most half a turn, and moves along the axis; vertices may move in its frame.

Keeps copies of positions, and the body alive. Functions of features, such as earliest_impact, take
meshes on straight paths; least_distance and intervals_below take all motions.)";

constexpr const char* kMotionInit =
    R"(mesh: its triangles say what moves.
start, end: (num_vertices, 3), in the mesh's frame. Without `start`, the positions before the last
    update, which must be update_two_frames (else ValueError); without `end`, the present positions.
start_tf, end_tf: poses that place the mesh in the world at both times.
path: 'straight' or 'screw'.)";

constexpr const char* kRigid =
    R"(The motion of a body that keeps its shape.

body: a shape, or a DeformableMesh with the positions that it has when a query reads them.
start_tf, end_tf: poses that place the body in the world at both times.
path: 'straight' or 'screw'.)";

constexpr const char* kCandidates =
    R"(All pairs of features that may come as near as `distance`, a length: others cannot.

first, second: Motions. Returns FeaturePairs. ValueError when the distance is negative, infinite or
NaN; likewise of all that take one.)";

constexpr const char* kWithinOne = "As the function without self_, of one Motion with itself.";

constexpr const char* kTimeOfImpact =
    R"(When two features come together: 0 to 1, never too late, or infinity when they do not.

kind: 'vertex-face', 'face-vertex' or 'edge-edge', the first mesh's feature first.
pair: their two numbers, as in FeaturePairs.
distance: a length; so near they have come together.)";

constexpr const char* kTimesOfImpact =
    R"(When the features of each of `pairs`, FeaturePairs, come together. Returns ImpactTimes.

distance: a length; so near they have come together.)";

constexpr const char* kEarliestImpact =
    R"(The first two features that come together, and when: an Impact. Needs no candidates.

first, second: Motions.
distance: a length; so near they have come together.)";

constexpr const char* kLargestSafeStep =
    R"(The time up to which nothing comes together, 0 to 1: at every earlier time all features are
farther apart than `distance`, a length.

first, second: Motions.)";

constexpr const char* kSafeDisplacements =
    R"(How far each vertex may move from its start, in any direction and whatever the others do within
theirs, so that no features come as near as `distance`, a length.

first, second: Motions. Returns two arrays of lengths, (num_vertices,) float64 of each.)";

constexpr const char* kWithinOneMesh =
    "As the function without self_, of one Motion with itself. Returns one array.";

constexpr const char* kTruncateMotion =
    R"(The share of its way, from 0 to 1, that each vertex may go: while every vertex is between
start and start + share * (end - start), no features come as near as `distance`, a length, in
whatever order and at whatever speed the vertices move. A fixed plane between each two near features
proves it. Features that are as near at the start come no nearer; features that touch do not move.

first, second: Motions. Returns two arrays of shares, (num_vertices,) float64 of each.)";
}  // namespace docs

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
  py::class_<MovingObject>(module, "Motion", docs::kMotion)
      .def(py::init<const LockedMesh&, const py::object&, const py::object&, const py::object&,
                    const py::object&, const std::string&>(),
           "mesh"_a, "start"_a = py::none(), "end"_a = py::none(), "start_tf"_a = py::none(),
           "end_tf"_a = py::none(), "path"_a = "straight", docs::kMotionInit)
      .def_static("rigid", &MovingObject::rigid, "body"_a, "start_tf"_a = py::none(),
                  "end_tf"_a = py::none(), "path"_a = "straight", docs::kRigid);
  ResultClass<Impact> impact(module, "Impact", "Two features that come together first.");
  impact
      .attribute("time", &Impact::time,
                 "0 to 1, or infinity when nothing comes together: then the rest means nothing.")
      .attribute("kind", &kindOf,
                 "'vertex-face', 'face-vertex' or 'edge-edge': the first mesh's feature first.")
      .attribute("pair", &pairOf,
                 "The numbers of the two features, as in FeaturePairs; -1 of a shape.");
  (*impact).def_property_readonly("exists", &Impact::exists, "Whether anything comes together.");
  ResultClass<ImpactTimes>(module, "ImpactTimes",
                           "A time for each of some FeaturePairs: 0 to 1, or infinity where they "
                           "do not come together.")
      .attribute("vertex_face", &ImpactTimes::vertex_face, "(K,) float64.")
      .attribute("face_vertex", &ImpactTimes::face_vertex, "(K,) float64.")
      .attribute("edge_edge", &ImpactTimes::edge_edge, "(K,) float64.");
}

// The library's queries of one motion with itself, by the names of those of two.
void candidates(const Motion& mesh, double distance, FeaturePairs& pairs) {
  selfCandidates(mesh, distance, pairs);
}
double timeOfImpact(const Motion& mesh, FeatureKind kind, const FeaturePair& pair,
                    double distance) {
  return selfTimeOfImpact(mesh, kind, pair, distance);
}
void timesOfImpact(const Motion& mesh, const FeaturePairs& pairs, double distance,
                   ImpactTimes& times) {
  selfTimesOfImpact(mesh, pairs, distance, times);
}
Impact earliestImpact(const Motion& mesh, double distance) {
  return selfEarliestImpact(mesh, distance);
}
void safeDisplacements(const Motion& mesh, double distance, std::vector<double>& of_vertices) {
  selfSafeDisplacements(mesh, distance, of_vertices);
}
void truncateMotion(const Motion& mesh, double distance, std::vector<double>& shares) {
  selfTruncateMotion(mesh, distance, shares);
}

/// Defines a function of two motions, and with the prefix self_ one of a motion with itself. Both
/// return query(others..., distance, motions...). `names` are those of the others.
template <typename... Others, typename Query, typename... Names>
void define(py::module_& module, const std::string& name, const Query& query, const char* doc,
            const char* doc_within_one, const Names&... names) {
  module.def(
      name.c_str(),
      [query](const MovingObject& first, const MovingObject& second, const Others&... others,
              double distance) { return query(others..., distance, first, second); },
      "first"_a, "second"_a, names..., "distance"_a = 0.0, doc);
  module.def(("self_" + name).c_str(),
             [query](const MovingObject& mesh, const Others&... others, double distance) {
               return query(others..., distance, mesh);
             },
             "mesh"_a, names..., "distance"_a = 0.0, doc_within_one);
}

/// The meshes of a motion, or of two: which has the first feature of a pair, and which the second.
const LockedMesh& firstMesh(const MovingObject& first) { return first.meshWithFeatures(); }
const LockedMesh& firstMesh(const MovingObject& first, const MovingObject&) {
  return firstMesh(first);
}
const LockedMesh& secondMesh(const MovingObject& only) { return only.meshWithFeatures(); }
const LockedMesh& secondMesh(const MovingObject&, const MovingObject& second) {
  return secondMesh(second);
}

void bindCandidates(py::module_& module) {
  const auto query = [](double distance, const auto&... motions) {
    FeaturePairs pairs;
    queryMotions([&](const auto&... m) { candidates(m..., distance, pairs); }, motions...);
    return pairs;
  };
  define(module, "candidates", query, docs::kCandidates, docs::kWithinOne);
}

void bindTimesOfImpact(py::module_& module) {
  const auto time = [](const std::string& name, const py::object& pair, double distance,
                       const auto&... motions) {
    const FeatureKind kind = kindFrom(name);
    const FeaturePair two = pairFrom(kind, pair, firstMesh(motions...), secondMesh(motions...));
    return queryMotions([&](const auto&... m) { return timeOfImpact(m..., kind, two, distance); },
                        motions...);
  };
  define<std::string, py::object>(module, "time_of_impact", time, docs::kTimeOfImpact,
                                  docs::kWithinOne, "kind"_a, "pair"_a);
  const auto times = [](const FeaturePairs& pairs, double distance, const auto&... motions) {
    const FeaturePairs all = checkedPairs(pairs, firstMesh(motions...), secondMesh(motions...));
    ImpactTimes result;
    queryMotions([&](const auto&... m) { timesOfImpact(m..., all, distance, result); }, motions...);
    return result;
  };
  define<FeaturePairs>(module, "times_of_impact", times, docs::kTimesOfImpact, docs::kWithinOne,
                       "pairs"_a);
}

void bindEarliestImpact(py::module_& module) {
  const auto query = [](double distance, const auto&... motions) {
    return queryMotions([&](const auto&... m) { return earliestImpact(m..., distance); },
                        motions...);
  };
  define(module, "earliest_impact", query, docs::kEarliestImpact, docs::kWithinOne);
  const auto safe_step = [query](double distance, const auto&... motions) {
    return std::min(query(distance, motions...).time, 1.0);
  };
  define(module, "largest_safe_step", safe_step, docs::kLargestSafeStep, docs::kWithinOne);
}

/// A number for each vertex, by query(motion, distance, numbers); and of two motions.
template <typename Query>
py::object numbersOf(const Query& query, double distance, const MovingObject& motion) {
  std::vector<double> numbers;
  queryMotions([&](const auto& m) { query(m, distance, numbers); }, motion);
  return adopt(std::move(numbers));
}
template <typename Query>
py::object numbersOf(const Query& query, double distance, const MovingObject& first,
                     const MovingObject& second) {
  std::vector<double> of_first, of_second;
  queryMotions([&](const auto& a, const auto& b) { query(a, b, distance, of_first, of_second); },
               first, second);
  return py::make_tuple(adopt(std::move(of_first)), adopt(std::move(of_second)));
}

void bindLimitsOfVertices(py::module_& module) {
  const auto displacements = [](double distance, const auto&... motions) {
    return numbersOf([](auto&&... arguments) { safeDisplacements(arguments...); }, distance,
                     motions...);
  };
  define(module, "safe_displacements", displacements, docs::kSafeDisplacements,
         docs::kWithinOneMesh);
  const auto shares = [](double distance, const auto&... motions) {
    return numbersOf([](auto&&... arguments) { truncateMotion(arguments...); }, distance,
                     motions...);
  };
  define(module, "truncate_motion", shares, docs::kTruncateMotion, docs::kWithinOneMesh);
}

}  // namespace

void bindContinuous(py::module_& module) {
  bindMotion(module);
  bindCandidates(module);
  bindTimesOfImpact(module);
  bindEarliestImpact(module);
  bindLimitsOfVertices(module);
}

}  // namespace adaptive_bvh::python
