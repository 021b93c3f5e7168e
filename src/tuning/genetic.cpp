#include "genetic.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include <pagmo/utils/genetic_operators.hpp>

namespace adaptive_bvh {

pagmo::population OverlappingGeneration::evolve(pagmo::population population) const {
  const auto size = population.size();
  const auto parents = population.get_x();
  const auto costs = population.get_f();
  const auto bounds = population.get_problem().get_bounds();
  pagmo::detail::random_engine_type random(seed_);
  std::uniform_int_distribution<std::size_t> anyone(0, size - 1);
  const auto tournament = [&]() -> const pagmo::vector_double& {
    const std::size_t a = anyone(random), b = anyone(random);
    return parents[costs[a][0] <= costs[b][0] ? a : b];
  };

  const auto children = static_cast<std::size_t>(std::ceil((1 - overlap_) * double(size)));
  std::vector<pagmo::vector_double> born;
  while (born.size() < children) {
    constexpr double kSpread = 10;  // distribution index of both operators, pagmo's default
    auto [one, other] =
        pagmo::sbx_crossover(tournament(), tournament(), bounds, 0, crossover_, kSpread, random);
    for (pagmo::vector_double* child : {&one, &other}) {
      pagmo::polynomial_mutation(*child, bounds, 0, mutation_, kSpread, random);
      if (born.size() < children) born.push_back(*child);
    }
  }
  for (const pagmo::vector_double& child : born) population.push_back(child);

  const auto all_costs = population.get_f();
  std::vector<std::size_t> order(population.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return all_costs[a][0] < all_costs[b][0]; });
  const auto all = population.get_x();
  pagmo::population next(population.get_problem(), 0, population.get_seed());
  for (std::size_t i = 0; i < size; ++i) next.push_back(all[order[i]], all_costs[order[i]]);
  return next;
}

}  // namespace adaptive_bvh
