#pragma once

#include <vector>

#include "adaptive_bvh/tuning.h"

namespace adaptive_bvh {

/// The parameters of a candidate policy, in the order of `parametersOf`, and its cost.
struct Individual {
  std::vector<double> x;
  double cost;
};

/// The progress of a search.
struct SearchState {
  std::size_t criterion = 0;           ///< index of the criterion being searched
  int generation = 0;                  ///< completed generations of this criterion
  std::vector<Individual> population;  ///< of this criterion; empty before the first generation
  std::vector<TunedPolicy>
      done;  ///< results of the previous criteria, and the best so far of this one
};

/// Writes the checkpoint if the options name one. Throws std::runtime_error if that fails.
void saveSearch(const SearchState& state, const TuningOptions& options);

/// The state to start from: the checkpoint if the options name an existing one, otherwise a new
/// search. Throws std::runtime_error if it cannot be read or belongs to other options.
SearchState loadSearch(const TuningOptions& options);

}  // namespace adaptive_bvh
