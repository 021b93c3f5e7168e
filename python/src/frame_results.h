#pragma once

#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "adaptive_bvh/recording.h"

namespace adaptive_bvh::python {

namespace py = pybind11;

/// What Python passes of a frame; None, or nothing, of what it leaves out.
struct FrameArguments {
  py::object distance, contacts;
  std::optional<double> update_ms, query_ms;
  py::object nearest_points, clearance, arrows, segments, patches;
  std::string note;
};

/// The library's results. Throws py::type_error on other kinds of objects, py::value_error on wrong
/// shapes and on numbers that are not finite, py::index_error on negative indices. Needs the GIL.
FrameResults frameResultsFrom(const FrameArguments& arguments);

}  // namespace adaptive_bvh::python
