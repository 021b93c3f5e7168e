#pragma once

#include <initializer_list>
#include <string>
#include <type_traits>
#include <utility>

#include <pybind11/pybind11.h>

#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/motion_clearance.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/scene.h"
#include "adaptive_bvh/trust_region.h"

namespace adaptive_bvh::python {

namespace py = pybind11;
using py::literals::operator""_a;

/// Base of the classes that Python sees. Python can make an object without calling __init__
/// (DeformableMesh.__new__(DeformableMesh)); pybind11 would hand out memory that holds no object.
/// For these classes that is a TypeError. Include this wherever such an object comes from Python.
struct Bound {};

/// The value with a name that Python gives for an argument; else throws py::value_error with all
/// names.
template <typename T>
T named(const std::string& name, const char* argument,
        std::initializer_list<std::pair<const char*, T>> values) {
  std::string names;
  for (auto value = values.begin(); value != values.end(); ++value) {
    if (name == value->first) return value->second;
    const bool is_last = value + 1 == values.end();
    names += value == values.begin() ? "'" : is_last ? " or '" : ", '";
    names += std::string(value->first) + "'";
  }
  throw py::value_error(std::string(argument) + " is '" + name + "'; " + names + " is needed");
}

template <typename T, typename... Types>
constexpr bool kIsOneOf = (std::is_same_v<T, Types> || ...);

/// Also classes of the library.
template <typename T>
constexpr bool kIsBound =
    std::is_base_of_v<Bound, T> ||
    kIsOneOf<T, BodyOptions, ClosestPoint, ContactPatches, ContactRegions, DistanceDerivatives,
             FeatureDetails, FeaturePairDerivatives, FeaturePairDetails, FeaturePairs, Impact,
             ImpactTimes, MeshUpdate, MotionClearance, SceneClearance, SceneDistance, SceneImpact,
             ScenePoint, SignedDistance, TriangleMesh, TrianglePairs, TrustRegionReport,
             VertexContacts, VertexGradients>;

/// Refuses what was not constructed.
template <typename T>
class ConstructedCaster : public py::detail::type_caster_base<T> {
 public:
  bool load(py::handle source, bool convert) {
    return this->template load_impl<ConstructedCaster>(source, convert);
  }
  /// Called by load_impl.
  void load_value(py::detail::value_and_holder&& holder) {
    if (!holder.value_ptr())
      throw py::type_error(
          "an object of adaptive_bvh was not initialised: its __init__ was not "
          "called");
    py::detail::type_caster_base<T>::load_value(std::move(holder));
  }
};

}  // namespace adaptive_bvh::python

namespace pybind11::detail {
template <typename T>
class type_caster<T, enable_if_t<adaptive_bvh::python::kIsBound<T>>>
    : public adaptive_bvh::python::ConstructedCaster<T> {};
}  // namespace pybind11::detail
