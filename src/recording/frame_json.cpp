#include "frame_json.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace adaptive_bvh {
namespace {

/// Appends pairs of points, or of a point and a vector, as two blocks. Leaves out non-finite pairs.
json appendPairs(const std::vector<std::array<fcl::Vector3d, 2>>& pairs, Blob& blob) {
  std::array<std::vector<fcl::Vector3d>, 2> columns;
  for (const auto& [a, b] : pairs) {
    if (!a.allFinite() || !b.allFinite()) continue;
    columns[0].push_back(a);
    columns[1].push_back(b);
  }
  json blocks;
  for (const auto& points : columns)
    blocks.push_back(asJson(appendPoints(points.data(), points.size(), blob)));
  return blocks;
}

json appendArrows(const Arrows& arrows, Blob& blob) {
  std::vector<std::array<fcl::Vector3d, 2>> pairs;
  for (std::size_t i = 0; i < arrows.origins.size(); ++i)
    pairs.push_back({arrows.origins[i], arrows.vectors[i]});
  return {{"label", arrows.label}, {"scale", arrows.scale}, {"blocks", appendPairs(pairs, blob)}};
}

}  // namespace

std::string textOf(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string escaped;
  for (const char c : text)
    if (c == '<')
      escaped += "\\u003c";
    else
      escaped += c;
  return escaped;
}

json asJson(const fcl::Vector3d& v) { return {v[0], v[1], v[2]}; }

json asJson(const PointBlock& points) {
  return {{"at", points.begin},
          {"count", points.count},
          {"low", asJson(points.low)},
          {"size", asJson(points.size)}};
}

json asJson(const fcl::Transform3d& pose) {
  json numbers;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) numbers.push_back(pose(row, column));
  return numbers;
}

json asJson(const UpdateReport& report) {
  return {{"nodes", report.nodes},
          {"refitted", report.refitted()},
          {"displacement", report.largest_displacement}};
}

json appendDistances(const std::vector<double>& values, DistanceBlock& last, Blob& blob) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  DistanceBlock now{nullptr, blob.size(), values.size(), *low, *high};
  auto* const steps = blob.extend<std::uint16_t>(values.size());
  now.steps = steps;
  std::transform(values.begin(), values.end(), steps, Steps(*low, *high - *low));
  if (now == last)
    blob.takeBack(now.begin);
  else
    last = now;
  return {{"at", last.begin}, {"low", last.low}, {"high", last.high}};
}

json appendPatches(const TrianglePatches& patches, Blob& blob) {
  std::vector<std::uint32_t> numbers(patches.triangles.begin(), patches.triangles.end());
  for (const std::uint64_t patch : patches.patches)
    numbers.push_back(static_cast<std::uint32_t>(patch));
  const std::size_t begin = blob.size();
  blob.append(numbers);
  return {{"at", begin}, {"count", patches.triangles.size()}};
}

json resultsOf(const FrameResults& results, Blob& blob) {
  json frame;
  const auto set = [&frame](const char* name, const std::optional<double>& value) {
    if (value && std::isfinite(*value)) frame[name] = *value;
  };
  set("distance", results.distance);
  set("updateMs", results.update_ms);
  set("queryMs", results.query_ms);
  for (const auto& [a, b] : results.nearest_points)
    if (a.allFinite() && b.allFinite())
      frame["nearest"].push_back({a[0], a[1], a[2], b[0], b[1], b[2]});
  if (results.contact_count) frame["contactCount"] = *results.contact_count;
  std::vector<fcl::Vector3d> contacts;
  std::copy_if(results.contacts.begin(), results.contacts.end(), std::back_inserter(contacts),
               [](const fcl::Vector3d& point) { return point.allFinite(); });
  if (!contacts.empty())
    frame["contacts"] = asJson(appendPoints(contacts.data(), contacts.size(), blob));
  for (const Arrows& arrows : results.arrows) frame["arrows"].push_back(appendArrows(arrows, blob));
  for (const Segments& segments : results.segments)
    frame["segments"].push_back(
        {{"label", segments.label}, {"blocks", appendPairs(segments.pairs, blob)}});
  for (const auto& [label, value] : results.series)
    if (std::isfinite(value)) frame["series"][label] = value;
  set("time", results.time);
  if (!results.note.empty()) frame["note"] = results.note;
  return frame;
}

}  // namespace adaptive_bvh
