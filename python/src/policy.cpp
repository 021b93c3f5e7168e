#include "policy.h"

#include <string>
#include <utility>

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#ifdef ADAPTIVE_BVH_PYTHON_POLICY_JSON
#include "adaptive_bvh/policy_json.h"
#endif

namespace adaptive_bvh::python {
namespace {

template <typename Value>
using Name = std::pair<const char*, Value>;

constexpr Name<FitnessCriterion> kCriteria[] = {{"A", FitnessCriterion::A},
                                                {"B", FitnessCriterion::B},
                                                {"AB", FitnessCriterion::AB},
                                                {"BC", FitnessCriterion::BC},
                                                {"ABC", FitnessCriterion::ABC},
                                                {"AOrBC", FitnessCriterion::AOrBC},
                                                {"ABOrBC", FitnessCriterion::ABOrBC},
                                                {"RefitAll", FitnessCriterion::RefitAll},
                                                {"RefitNone", FitnessCriterion::RefitNone},
                                                {"AD", FitnessCriterion::AD}};
constexpr Name<InflationReference> kReferences[] = {
    {"node size", InflationReference::NodeSize},
    {"original radius", InflationReference::OriginalRadius}};
constexpr Name<Propagation> kPropagations[] = {
    {"translation-compensated", Propagation::TranslationCompensated},
    {"displacements", Propagation::Displacements}};

template <typename Value, std::size_t kCount>
Value named(const Name<Value> (&names)[kCount], const std::string& name, const char* what) {
  std::string all;
  for (const auto& [known, value] : names) {
    if (name == known) return value;
    all += (all.empty() ? "'" : ", '") + std::string(known) + "'";
  }
  throw py::value_error(std::string(what) + " is '" + name + "'; it is one of " + all);
}

template <typename Value, std::size_t kCount>
std::string nameOf(const Name<Value> (&names)[kCount], Value value) {
  for (const auto& [name, known] : names)
    if (value == known) return name;
  return "";
}

struct Choices {
  std::string criterion, reference, propagation;
};

RefitPolicy checked(RefitPolicy policy, const Choices& choices) {
  policy.criterion = named(kCriteria, choices.criterion, "criterion");
  policy.reference = named(kReferences, choices.reference, "reference");
  policy.propagation = named(kPropagations, choices.propagation, "propagation");
  policy.check();
  return policy;
}

/// Every member, in the order of the constructor.
py::tuple members(const RefitPolicy& p) {
  return py::make_tuple(nameOf(kCriteria, p.criterion), p.max_inflation, p.child_distance_ratio,
                        p.min_inflation, nameOf(kReferences, p.reference), p.axes_tolerance,
                        p.volumes_rest, p.volumes_on_demand, p.leaf_radius_may_shrink,
                        nameOf(kPropagations, p.propagation));
}

std::string textOf(const RefitPolicy& policy) {
  return std::string(
      py::str("RefitPolicy(criterion={!r}, max_inflation={!r}, child_distance_ratio={!r}, "
              "min_inflation={!r}, reference={!r}, axes_tolerance={!r}, volumes_rest={!r}, "
              "volumes_on_demand={!r}, leaf_radius_may_shrink={!r}, propagation={!r})")
          .format(*members(policy)));
}

void bindRefitPolicy(py::module_& module) {
  const RefitPolicy standard;
  py::class_<RefitPolicy> policy(module, "RefitPolicy",
                                 "Which bounding volumes an update refits. No policy makes an "
                                 "answer wrong: it moves work between update and query. Does not "
                                 "change once it is made. Ratios have no unit.");
  policy
      .def(py::init([](const std::string& criterion, double max_inflation,
                       double child_distance_ratio, double min_inflation,
                       const std::string& reference, double axes_tolerance, bool volumes_rest,
                       bool volumes_on_demand, bool leaf_radius_may_shrink,
                       const std::string& propagation) {
             RefitPolicy p;
             p.max_inflation = max_inflation;
             p.child_distance_ratio = child_distance_ratio;
             p.min_inflation = min_inflation;
             p.axes_tolerance = axes_tolerance;
             p.volumes_rest = volumes_rest;
             p.volumes_on_demand = volumes_on_demand;
             p.leaf_radius_may_shrink = leaf_radius_may_shrink;
             return checked(p, {criterion, reference, propagation});
           }),
           py::arg("criterion") = nameOf(kCriteria, standard.criterion),
           py::arg("max_inflation") = standard.max_inflation,
           py::arg("child_distance_ratio") = standard.child_distance_ratio,
           py::arg("min_inflation") = standard.min_inflation,
           py::arg("reference") = nameOf(kReferences, standard.reference),
           py::arg("axes_tolerance") = standard.axes_tolerance,
           py::arg("volumes_rest") = standard.volumes_rest,
           py::arg("volumes_on_demand") = standard.volumes_on_demand,
           py::arg("leaf_radius_may_shrink") = standard.leaf_radius_may_shrink,
           py::arg("propagation") = nameOf(kPropagations, standard.propagation),
           "A policy; what is left out has its default. criterion: 'AD' (the default), 'A', 'B', "
           "'AB', 'BC', 'ABC', 'AOrBC', 'ABOrBC', 'RefitAll' or 'RefitNone'.")
      .def_static(
          "thesis",
          [](const std::string& name) {
            return RefitPolicy::thesis(named(kCriteria, name, "criterion"));
          },
          py::arg("criterion"), "The thesis's parameters for a criterion.")
      .def("__eq__",
           [](const RefitPolicy& a, const py::object& b) {
             return py::isinstance<RefitPolicy>(b) &&
                    members(a).equal(members(b.cast<const RefitPolicy&>()));
           })
      .def("__hash__", [](const RefitPolicy& p) { return py::hash(members(p)); })
      .def("__repr__", &textOf);
  policy
      .def_property_readonly(
          "criterion", [](const RefitPolicy& p) { return nameOf(kCriteria, p.criterion); },
          "Which combination of tests calls a volume unfit.")
      .def_readonly("max_inflation", &RefitPolicy::max_inflation,
                    "Of test A: how much a volume may have grown.")
      .def_readonly("child_distance_ratio", &RefitPolicy::child_distance_ratio,
                    "Of test C, 0 to 1.")
      .def_readonly("min_inflation", &RefitPolicy::min_inflation, "Of test C.")
      .def_property_readonly(
          "reference", [](const RefitPolicy& p) { return nameOf(kReferences, p.reference); },
          "What inflations are ratios of: 'node size' or 'original radius'.")
      .def_readonly("axes_tolerance", &RefitPolicy::axes_tolerance,
                    "How much a volume's surface may grow before its axes are chosen anew.")
      .def_readonly("volumes_rest", &RefitPolicy::volumes_rest,
                    "Whether updates leave volumes alone, but large enough, that no query reads.")
      .def_readonly("volumes_on_demand", &RefitPolicy::volumes_on_demand,
                    "Whether updates leave FCL's volumes to the queries that need them: those with "
                    "shapes.")
      .def_readonly("leaf_radius_may_shrink", &RefitPolicy::leaf_radius_may_shrink,
                    "With the propagation 'displacements' only.")
      .def_property_readonly(
          "propagation", [](const RefitPolicy& p) { return nameOf(kPropagations, p.propagation); },
          "How volumes follow: 'translation-compensated' or 'displacements' (the thesis's).");
#ifdef ADAPTIVE_BVH_PYTHON_POLICY_JSON
  policy
      .def(
          "to_json", [](const RefitPolicy& p) { return toJson(p); }, "As JSON text.")
      .def_static(
          "from_json", [](const std::string& text) { return policyFromJson(text); },
          py::arg("text"),
          "Reads what to_json wrote. Members that are missing have their default.");
#endif
}

void bindUpdateReport(py::module_& module) {
  using Report = UpdateReport;
  py::class_<Report>(module, "UpdateReport", "What an update did, and how long it took.")
      .def_readonly("nodes", &Report::nodes, "Bounding volumes in the tree.")
      .def_readonly("moved", &Report::moved, "Volumes that moved with their triangles.")
      .def_readonly("inflated", &Report::inflated, "Volumes that grew or shrank.")
      .def_readonly("refitted_leaves", &Report::refitted_leaves,
                    "Volumes of one triangle refitted.")
      .def_readonly("refitted_inner", &Report::refitted_inner, "Other volumes refitted.")
      .def_readonly("refitted_primitives", &Report::refitted_primitives,
                    "Triangles that the refits read.")
      .def_readonly("largest_displacement", &Report::largest_displacement,
                    "The largest motion of a vertex, in the unit of the mesh.")
      .def_readonly("resynchronised", &Report::resynchronised,
                    "Whether the whole tree was refitted.")
      .def_readonly("displacement_seconds", &Report::displacement_seconds,
                    "Seconds that reading the positions took.")
      .def_readonly("propagation_seconds", &Report::propagation_seconds,
                    "Seconds that moving and inflating the volumes took.")
      .def_readonly("refit_seconds", &Report::refit_seconds, "Seconds that refits took.")
      .def_property_readonly("propagated", &Report::propagated,
                             "Volumes that were moved or inflated.")
      .def_property_readonly("refitted", &Report::refitted, "Volumes that were refitted.")
      .def_property_readonly("seconds", &Report::seconds, "Seconds of all three phases.")
      .def("__repr__", [](const Report& r) {
        return std::string(
            py::str("<adaptive_bvh.UpdateReport: {} volumes, {} moved, {} refitted, {:.3g} s>")
                .format(r.nodes, r.propagated(), r.refitted(), r.seconds()));
      });
}

}  // namespace

void bindPolicy(py::module_& module) {
  bindRefitPolicy(module);
  bindUpdateReport(module);
}

}  // namespace adaptive_bvh::python
