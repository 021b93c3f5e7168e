#pragma once

#include <functional>
#include <string>
#include <vector>

#include "method.h"

namespace adaptive_bvh_bench {

/// One method on one scenario. Sums over all frames; one entry a repeat.
struct Measurement {
  std::vector<double> update_ms, query_ms;
  Work work;
  int wrong_frames = 0;    ///< whose distance differs from the oracle's by more than 1e-9 relative
  double worst_error = 0;  ///< largest difference
  double bytes_per_triangle = 0;
  std::vector<double> frame_ms;  ///< update + query by frame, least of the repeats
  double touching_ms = 0;        ///< of those, the ones with distance 0

  double total(std::size_t repeat) const { return update_ms[repeat] + query_ms[repeat]; }
};

struct ScenarioResult {
  std::string name;
  int frames = 0;
  std::size_t triangles = 0;
  int touching_frames = 0;           ///< distance 0
  std::vector<Measurement> methods;  ///< in the order of the kinds given
};

struct RunOptions {
  int repeats = 3;
  bool moving = false;  ///< the objects too: transforms that change in every frame
  unsigned seed = 1;    ///< of the order in which the methods take turns
  /// Called with the share done, 0 to 1, and what is being run.
  std::function<void(double, const std::string&)> progress;
};

/// All methods on one scenario, in one process and thread. In each repeat every method runs through
/// all frames, in an order drawn anew; positions are computed outside of the clock.
ScenarioResult runScenario(const scenarios::Scenario& scenario,
                           const std::vector<MethodKind>& kinds, const RunOptions& options);

}  // namespace adaptive_bvh_bench
