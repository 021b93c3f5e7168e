#pragma once

#include <vector>

#include "adaptive_bvh/tuning.h"

namespace adaptive_bvh {

/// The parameters of a policy that is tried, in the order of `parametersOf`, and what it costs.
struct Individual {
  std::vector<double> x;
  double cost;
};

/// Where a search is.
struct SearchState {
  std::size_t criterion = 0;           ///< index of the one being searched
  int generation = 0;                  ///< generations done of it
  std::vector<Individual> population;  ///< of this criterion; empty before the first generation
  std::vector<TunedPolicy> done;       ///< of the criteria before it, and its best so far
};

/// Writes the checkpoint, if the options name one. Throws std::runtime_error when that fails.
void saveSearch(const SearchState& state, const TuningOptions& options);

/// The state to start from: that of the checkpoint, if the options name one that is there. Throws
/// std::runtime_error when it cannot be read or belongs to other options.
SearchState loadSearch(const TuningOptions& options);

}  // namespace adaptive_bvh
