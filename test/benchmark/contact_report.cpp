#include "contact_report.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "median.h"

namespace adaptive_bvh_bench {
namespace {

constexpr const char* kUnknown = "-";

std::string text(const char* format, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof(buffer), format, value);
  return buffer;
}

std::string perFrame(long sum, int frames) {
  return sum < 0 ? kUnknown : text("%.0f", double(sum) / frames);
}

const ContactMeasurement* find(const ContactResult& result, const char* key) {
  for (const ContactMeasurement& m : result.methods)
    if (m.key == key) return &m;
  return nullptr;
}

/// How many times longer the first one takes, the median over the repeats; '-' without one.
std::string ratio(const ContactMeasurement* slow, const ContactMeasurement* fast) {
  if (!slow || !fast) return kUnknown;
  std::vector<double> ratios;
  for (std::size_t r = 0; r < slow->update_ms.size(); ++r)
    ratios.push_back(slow->total(r) / fast->total(r));
  return text("%.2f", median(ratios));
}

/// The same in the frame where it is least.
std::string worstRatio(const ContactMeasurement* slow, const ContactMeasurement* fast) {
  if (!slow || !fast) return kUnknown;
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < slow->frame_ms.size(); ++i)
    least = std::min(least, slow->frame_ms[i] / fast->frame_ms[i]);
  return text("%.2f", least);
}

using Cells = std::vector<std::string>;

void writeRow(std::ostream& out, const Cells& cells) {
  out << '|';
  for (const std::string& cell : cells) out << ' ' << cell << " |";
  out << '\n';
}

void writeHeader(std::ostream& out, Job job) {
  Cells cells = {
      "scenario",        "triangles",          "method",           "update",   "query", "sum",
      "faster than FCL", "in its worst frame", "takes times ours", "box tests"};
  if (job == Job::Distance)
    for (const char* name : {"triangle tests", "wrong frames", "worst error"})
      cells.emplace_back(name);
  else if (job == Job::Continuous)
    for (const char* name : {"candidates", "wrong frames", "worst error"}) cells.emplace_back(name);
  else
    for (const char* name : {"candidates", "triangle tests", "contacts", "missed", "extra"})
      cells.emplace_back(name);
  writeRow(out, cells);
  for (std::string& cell : cells) cell = cell == "scenario" || cell == "method" ? "---" : "---:";
  writeRow(out, cells);
}

Cells answerCells(const ContactResult& result, const ContactMeasurement& m) {
  const auto mean = [&](long sum) { return perFrame(sum, result.frames); };
  if (result.job == Job::Distance)
    return {mean(m.counts.triangle_tests), std::to_string(m.wrong_frames),
            text("%.0e", m.worst_error)};
  if (result.job == Job::Continuous)
    return {mean(m.counts.candidates), std::to_string(m.wrong_frames), text("%.0e", m.worst_error)};
  return {mean(m.counts.candidates), mean(m.counts.triangle_tests), mean(m.counts.contacts),
          m.by_fcl_test ? std::to_string(m.missed) : kUnknown,
          m.by_fcl_test ? std::to_string(m.extra) : kUnknown};
}

std::string caseName(const ContactResult& result) {
  std::string name = result.name;
  if (result.resolution > 1) name += ", ×" + std::to_string(result.resolution * result.resolution);
  if (result.job == Job::Continuous) name += ", from " + text("%.1e", result.least_distance);
  if (result.job == Job::Distance)
    name +=
        ", " + text("%.1e", result.least_distance) + " to " + text("%.1e", result.largest_distance);
  return name;
}

void writeCase(std::ostream& out, const ContactResult& result) {
  const ContactMeasurement* fcl = find(result, kContactReference);
  const ContactMeasurement* ours = find(result, kContactOurs);
  bool first = true;
  for (const ContactMeasurement& m : result.methods) {
    Cells cells = {first ? caseName(result) : "",
                   first ? std::to_string(result.triangles) : "",
                   m.title,
                   text("%.3f", median(m.update_ms)),
                   text("%.3f", median(m.query_ms)),
                   text("%.3f", median(m.update_ms) + median(m.query_ms)),
                   ratio(fcl, &m),
                   worstRatio(fcl, &m),
                   ratio(&m, ours),
                   perFrame(m.counts.box_tests, result.frames)};
    for (const std::string& cell : answerCells(result, m)) cells.push_back(cell);
    writeRow(out, cells);
    first = false;
  }
}

std::ofstream opened(const std::string& path) {
  std::ofstream out(path);
  if (!out) throw std::runtime_error("cannot write '" + path + "'");
  return out;
}

nlohmann::json toJson(const ContactMeasurement& m) {
  return {{"key", m.key},
          {"title", m.title},
          {"update_ms", m.update_ms},
          {"query_ms", m.query_ms},
          {"frame_ms", m.frame_ms},
          {"box_tests", m.counts.box_tests},
          {"candidates", m.counts.candidates},
          {"triangle_tests", m.counts.triangle_tests},
          {"contacts", m.counts.contacts},
          {"missed", m.by_fcl_test ? m.missed : -1},
          {"extra", m.by_fcl_test ? m.extra : -1},
          {"wrong_frames", m.wrong_frames},
          {"worst_error", m.worst_error}};
}

/// A cell of a CSV table, empty for values that a program does not report.
std::string cell(long count) { return count < 0 ? "" : std::to_string(count); }

}  // namespace

void writeContactTable(std::ostream& out, Job job, const std::vector<ContactResult>& all) {
  out << '\n' << toString(job) << ", milliseconds and counts a frame\n\n";
  writeHeader(out, job);
  for (const ContactResult& result : all)
    if (result.job == job) writeCase(out, result);
  out.flush();
}

void writeContactSummary(std::ostream& out, const std::vector<ContactResult>& all,
                         const std::vector<ContactKind>& kinds) {
  Cells header = {"update + query, ms a frame", "triangles", "contacts a frame"};
  for (const ContactKind& kind : kinds) header.push_back(kind.title);
  writeRow(out, header);
  Cells rule(header.size(), "---:");
  rule[0] = "---";
  writeRow(out, rule);
  for (const ContactResult& result : all) {
    Cells cells = {std::string(toString(result.job)) + ": " + caseName(result),
                   std::to_string(result.triangles),
                   result.job == Job::Distance || result.job == Job::Continuous
                       ? ""
                       : perFrame(result.contacts, result.frames)};
    for (const ContactKind& kind : kinds) {
      const ContactMeasurement* m = find(result, kind.key.c_str());
      cells.push_back(
          m ? text("%.2f", median(m->update_ms)) + " + " + text("%.2f", median(m->query_ms)) : "");
    }
    writeRow(out, cells);
  }
}

void writeContactJson(const std::string& path, const std::vector<ContactResult>& all) {
  nlohmann::json root = nlohmann::json::array();
  for (const ContactResult& result : all) {
    nlohmann::json entry = {{"job", toString(result.job)},
                            {"name", result.name},
                            {"resolution", result.resolution},
                            {"frames", result.frames},
                            {"triangles", result.triangles},
                            {"contacts", result.contacts},
                            {"least_distance", result.least_distance},
                            {"largest_distance", result.largest_distance}};
    for (const ContactMeasurement& m : result.methods) entry["methods"].push_back(toJson(m));
    root.push_back(entry);
  }
  opened(path) << root.dump(1) << '\n';
}

void writeContactCsv(const std::string& path, const std::vector<ContactResult>& all) {
  std::ofstream out = opened(path);
  out << "job,scenario,resolution,frames,triangles,method,update_ms,query_ms,box_tests,candidates,"
         "triangle_tests,contacts,missed,extra,wrong_frames,worst_error\n";
  for (const ContactResult& result : all)
    for (const ContactMeasurement& m : result.methods)
      out << toString(result.job) << ',' << result.name << ',' << result.resolution << ','
          << result.frames << ',' << result.triangles << ',' << m.key << ',' << median(m.update_ms)
          << ',' << median(m.query_ms) << ',' << cell(m.counts.box_tests) << ','
          << cell(m.counts.candidates) << ',' << cell(m.counts.triangle_tests) << ','
          << cell(m.counts.contacts) << ',' << cell(m.by_fcl_test ? m.missed : -1) << ','
          << cell(m.by_fcl_test ? m.extra : -1) << ',' << m.wrong_frames << ',' << m.worst_error
          << '\n';
}

}  // namespace adaptive_bvh_bench
