#pragma once

#include <vector>

#include "adaptive_bvh/tuning.h"

// The state of `tune` (tuning.cpp), and the file from which an interrupted search resumes.
namespace adaptive_bvh {

/// A candidate policy of the genetic algorithm.
struct Individual {
  std::vector<double> x;  ///< values of the parameters, in the order of `parametersOf`
  double cost;
};

/// The progress of a search.
struct SearchState {
  std::size_t criterion = 0;           ///< index of the criterion being searched
  int generation = 0;                  ///< completed generations of this criterion
  std::vector<Individual> population;  ///< of this criterion, best first; empty before it begins
  /// The best policy of each previous criterion, and the best so far of this one.
  std::vector<TunedPolicy> done;
};

/// Writes the checkpoint if the options name one. Throws std::runtime_error if that fails.
void saveSearch(const SearchState& state, const TuningOptions& options);

/// The state to start from: the checkpoint if the options name an existing one, otherwise a new
/// search. Throws std::runtime_error if it cannot be read or belongs to other options.
SearchState loadSearch(const TuningOptions& options);

}  // namespace adaptive_bvh
