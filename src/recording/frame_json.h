#pragma once

#include <nlohmann/json.hpp>

#include "adaptive_bvh/recording.h"
#include "body.h"

namespace adaptive_bvh {

// The JSON that page/data.js reads. Functions append... append arrays to the Blob and return the
// JSON that refers to them. "at" is the position of an array in bytes.

using nlohmann::json;

/// A distance for each vertex in a Blob.
struct DistanceBlock {
  const std::uint16_t* steps = nullptr;  ///< in the Blob: one a vertex (see Steps)
  std::size_t begin = 0, count = 0;      ///< beginning in the Blob; number of vertices
  double low = 0, high = 0;              ///< the smallest and the largest

  bool operator==(const DistanceBlock& other) const {
    return count == other.count && low == other.low && high == other.high &&
           std::equal(steps, steps + count, other.steps);
  }
};

/// JSON as text for a script element, which a literal "</script>" would end: < is escaped.
std::string textOf(const json& value);

json asJson(const fcl::Vector3d& v);
json asJson(const PointBlock& points);
/// A pose as JSON, by columns: the images of x, y and z, and the origin.
json asJson(const fcl::Transform3d& pose);
json asJson(const UpdateReport& report);

/// Appends values, unless they equal those of `last`, which becomes what was appended.
json appendDistances(const std::vector<double>& values, DistanceBlock& last, Blob& blob);
json appendPatches(const TrianglePatches& patches, Blob& blob);
/// A frame with the user's results, without values that are not finite; bodies are not included.
json resultsOf(const FrameResults& results, Blob& blob);

}  // namespace adaptive_bvh
