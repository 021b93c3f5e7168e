#include "frame_results.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "arrays.h"
#include "contact_regions.h"
#include "locked_scene.h"
#include "objects.h"
#include "query.h"

namespace adaptive_bvh::python {
namespace {

using PointPairs = std::vector<std::array<fcl::Vector3d, 2>>;

/// "arrows['force']", as the sentence of an error names it.
std::string entryOf(const char* name, const py::handle& key) {
  return std::string(name) + "[" + std::string(py::repr(key)) + "]";
}

// ---- numbers ------------------------------------------------------------------------------------

void requireFinite(const double* numbers, std::size_t count, const std::string& name) {
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(numbers[i]))
      throw py::value_error(name + " has a number that is not finite");
}

fcl::Vector3d rowOf(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

std::optional<double> finiteOrNone(const std::optional<double>& number, const char* name) {
  if (number) requireFinite(&*number, 1, name);
  return number;
}

/// (N, 3) numbers.
std::vector<fcl::Vector3d> pointsFrom(const py::object& object, const std::string& name) {
  const Rows rows(object, name.c_str());
  requireFinite(rows.begin()->data(), 3 * rows.size(), name);
  return {rows.begin(), rows.end()};
}

/// (N, 2, 3) numbers.
PointPairs pointPairsFrom(const py::object& object, const std::string& name) {
  const py::array array = numbersFrom(object, name.c_str());
  if (array.ndim() != 3 || array.shape(1) != 2 || array.shape(2) != 3)
    throw py::value_error(name + " has the shape " + shapeOf(array) + "; (N, 2, 3) is needed");
  const Contiguous<double> rows(array);
  requireFinite(rows.data(), static_cast<std::size_t>(rows.size()), name);
  PointPairs pairs;
  for (const double* row = rows.data(); row != rows.data() + rows.size(); row += 6)
    pairs.push_back({rowOf(row), rowOf(row + 3)});
  return pairs;
}

// ---- keys and values of dicts -------------------------------------------------------------------

/// What a dict or another mapping holds now; nothing of None.
py::dict entriesOf(const py::object& mapping) {
  py::dict entries;
  if (mapping.is_none()) return entries;
  if (!py::hasattr(mapping, "keys"))
    throw py::type_error("a " + typeNameOf(mapping) + " was passed where a dict is needed");
  if (PyDict_Update(entries.ptr(), mapping.ptr()) != 0) throw py::error_already_set();
  return entries;
}

int bodyFrom(const py::handle& key, const char* name) {
  if (!PyIndex_Check(key.ptr()))
    throw py::type_error(std::string(name) + ": a key is not the number of a body");
  const Py_ssize_t number = PyNumber_AsSsize_t(key.ptr(), nullptr);  // clipped if too large
  if (number == -1 && PyErr_Occurred()) throw py::error_already_set();
  if (number < 0 || number > std::numeric_limits<int>::max())
    throw py::index_error(entryOf(name, key) + ": no body has this number");
  return static_cast<int>(number);
}

std::string labelFrom(const py::handle& key, const char* name) {
  if (!py::isinstance<py::str>(key))
    throw py::type_error(std::string(name) + ": a key is not a string");
  return key.cast<std::string>();
}

/// A tuple or list of `least` to `most` objects.
py::tuple partsFrom(const py::handle& object, std::size_t least, std::size_t most,
                    const std::string& name, const char* needed) {
  if (!py::isinstance<py::tuple>(object) && !py::isinstance<py::list>(object))
    throw py::type_error(name + " is a " + typeNameOf(object) + "; " + needed + " is needed");
  const py::tuple parts(py::reinterpret_borrow<py::object>(object));
  if (parts.size() < least || parts.size() > most)
    throw py::value_error(name + " has " + std::to_string(parts.size()) + " parts; " + needed +
                          " is needed");
  return parts;
}

VertexValues valuesFrom(const py::handle& body, const py::handle& values) {
  const std::string name = entryOf("clearance", body);
  const py::array array = numbersFrom(py::reinterpret_borrow<py::object>(values), name.c_str());
  if (array.ndim() != 1)
    throw py::value_error(name + " has the shape " + shapeOf(array) + "; (N,) is needed");
  const Contiguous<double> numbers(array);
  return {bodyFrom(body, "clearance"), {numbers.data(), numbers.data() + numbers.size()}};
}

Arrows arrowsFrom(const py::handle& label, const py::handle& given) {
  const std::string name = entryOf("arrows", label);
  const py::tuple parts =
      partsFrom(given, 2, 3, name, "(origins, vectors) or (origins, vectors, scale)");
  Arrows arrows{labelFrom(label, "arrows"), pointsFrom(parts[0], name + "[0]"),
                pointsFrom(parts[1], name + "[1]"), 0};
  if (parts.size() == 3) arrows.scale = parts[2].cast<double>();
  return arrows;
}

// ---- patches ------------------------------------------------------------------------------------

std::vector<std::uint64_t> patchNumbersFrom(const py::object& object, const std::string& name) {
  const std::vector<unsigned> numbers =
      indicesFrom(object, std::numeric_limits<unsigned>::max(), name.c_str(), "numbers of patches");
  return {numbers.begin(), numbers.end()};
}

std::vector<unsigned> trianglesOf(const py::object& object, const std::string& name) {
  return indicesFrom(object, std::numeric_limits<int>::max(), name.c_str(), "triangles at most");
}

/// ContactPatches, these with identities, or triangles with the number of a patch for each.
void addPatches(const py::handle& body, const py::handle& given, FrameResults& results) {
  const std::string name = entryOf("patches", body);
  const int number = bodyFrom(body, "patches");
  if (py::isinstance<ContactPatches<double>>(given)) {
    results.colourTriangles(number,
                            checkedPatches(given.cast<const ContactPatches<double>&>(), name));
    return;
  }
  const py::tuple parts =
      partsFrom(given, 2, 2, name, "ContactPatches, (ContactPatches, ids) or (triangles, patches)");
  const std::vector<std::uint64_t> patches = patchNumbersFrom(parts[1], name + "[1]");
  if (!py::isinstance<ContactPatches<double>>(parts[0])) {
    results.patches.push_back({number, trianglesOf(parts[0], name + "[0]"), patches});
    return;
  }
  const ContactPatches<double> regions =
      checkedPatches(parts[0].cast<const ContactPatches<double>&>(), name + "[0]");
  if (patches.size() + 1 != regions.begins.size())
    throw py::value_error(name + " has " + std::to_string(patches.size()) + " ids for " +
                          std::to_string(regions.begins.size() - 1) + " regions");
  results.colourTriangles(number, regions, patches);
}

// ---- results of queries -------------------------------------------------------------------------

void addNearest(double distance, const std::array<fcl::Vector3d, 2>& points,
                FrameResults& results) {
  fcl::DistanceResultd nearest;
  nearest.min_distance = distance;
  for (std::size_t side : {0, 1}) nearest.nearest_points[side] = points[side];
  results.add(nearest);
}

void addDistance(const py::handle& found, FrameResults& results) {
  if (py::isinstance<Nearest>(found)) {
    const auto& nearest = found.cast<const Nearest&>();
    addNearest(nearest.distance, nearest.points, results);
  } else if (py::isinstance<SceneDistance<double>>(found)) {
    const auto& gap = found.cast<const SceneDistance<double>&>();
    if (gap.exists()) addNearest(gap.distance, gap.points, results);
  } else {
    const double number = PyFloat_AsDouble(found.ptr());
    if (number == -1 && PyErr_Occurred()) {
      PyErr_Clear();
      throw py::type_error("distance is a " + typeNameOf(found) +
                           "; a DistanceResult, a SceneDistance, a number or a list of these is "
                           "needed");
    }
    requireFinite(&number, 1, "distance");
    results.distance = std::min(number, results.distance.value_or(number));
  }
}

void addContacts(const py::handle& found, FrameResults& results) {
  std::vector<fcl::Vector3d> points;  // NaN where they were not computed
  if (py::isinstance<Contacts>(found))
    points = found.cast<const Contacts&>().points;
  else if (py::isinstance<OfBodyPairs<Contacts>>(found))
    points = found.cast<const OfBodyPairs<Contacts>&>().found.points;
  else
    points = pointsFrom(py::reinterpret_borrow<py::object>(found), "contacts");
  results.contact_count = results.contact_count.value_or(0) + points.size();
  results.contacts.insert(results.contacts.end(), points.begin(), points.end());
}

/// Calls add(one, results) for one object or for each of a list.
template <typename Add>
void addEach(const py::object& given, const Add& add, FrameResults& results) {
  if (py::isinstance<py::list>(given) || py::isinstance<py::tuple>(given))
    for (const py::handle& one : given) add(one, results);
  else if (!given.is_none())
    add(given, results);
}

}  // namespace

FrameResults frameResultsFrom(const FrameArguments& a) {
  FrameResults results;
  addEach(a.distance, addDistance, results);
  addEach(a.contacts, addContacts, results);
  results.update_ms = finiteOrNone(a.update_ms, "update_ms");
  results.query_ms = finiteOrNone(a.query_ms, "query_ms");
  if (!a.nearest_points.is_none())
    for (const auto& pair : pointPairsFrom(a.nearest_points, "nearest_points"))
      results.nearest_points.push_back(pair);
  for (const auto& [body, values] : entriesOf(a.clearance))
    results.clearance.push_back(valuesFrom(body, values));
  for (const auto& [label, given] : entriesOf(a.arrows))
    results.arrows.push_back(arrowsFrom(label, given));
  for (const auto& [label, pairs] : entriesOf(a.segments))
    results.segments.push_back(
        {labelFrom(label, "segments"),
         pointPairsFrom(py::reinterpret_borrow<py::object>(pairs), entryOf("segments", label))});
  for (const auto& [body, given] : entriesOf(a.patches)) addPatches(body, given, results);
  results.note = a.note;
  return results;
}

}  // namespace adaptive_bvh::python
