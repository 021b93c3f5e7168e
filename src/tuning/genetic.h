#pragma once

#include <pagmo/population.hpp>
#include <pagmo/rng.hpp>

namespace adaptive_bvh {

/// One generation of the steady-state genetic algorithm of the thesis (GAlib's, with overlapping
/// populations) as an algorithm for pagmo, with pagmo's operators: children of tournament-selected
/// parents by simulated binary crossover and polynomial mutation join the population, then the
/// worst leave it.
class OverlappingGeneration {
 public:
  OverlappingGeneration() = default;
  OverlappingGeneration(double overlap, double crossover, double mutation, unsigned seed)
      : overlap_(overlap), crossover_(crossover), mutation_(mutation), seed_(seed) {}

  pagmo::population evolve(pagmo::population population) const;

 private:
  double overlap_ = 0.5, crossover_ = 0.9, mutation_ = 0.01;
  unsigned seed_ = 1;
};

}  // namespace adaptive_bvh
