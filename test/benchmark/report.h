#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "runner.h"

namespace adaptive_bvh_bench {

/// All scenarios in one orientation at one resolution and stride.
struct Series {
  int resolution = 1, stride = 1;
  bool aligned = false;
  std::vector<ScenarioResult> scenarios;
};

/// Markdown: one table of the sums over all scenarios, one of milliseconds by scenario.
void writeTables(std::ostream& out, const Series& series, const std::vector<MethodKind>& kinds);

/// Everything measured, frame by frame.
void writeJson(const std::string& path, const std::vector<Series>& all,
               const std::vector<MethodKind>& kinds);

/// One row per series, scenario and method.
void writeCsv(const std::string& path, const std::vector<Series>& all,
              const std::vector<MethodKind>& kinds);

}  // namespace adaptive_bvh_bench
