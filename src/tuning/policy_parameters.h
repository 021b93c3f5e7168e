#pragma once

#include <functional>
#include <utility>
#include <vector>

#include <pagmo/problem.hpp>

#include "adaptive_bvh/tuning.h"

namespace adaptive_bvh {

/// The parameters that a criterion uses, as a point of the search.
class PolicyParameters {
 public:
  PolicyParameters(FitnessCriterion criterion, const TuningOptions& options) : base_(options.base) {
    base_.criterion = criterion;
    const bool a = criterion == FitnessCriterion::A || criterion == FitnessCriterion::AB ||
                   criterion == FitnessCriterion::ABC || criterion == FitnessCriterion::AOrBC ||
                   criterion == FitnessCriterion::ABOrBC || criterion == FitnessCriterion::AD;
    const bool c = criterion == FitnessCriterion::BC || criterion == FitnessCriterion::ABC ||
                   criterion == FitnessCriterion::AOrBC || criterion == FitnessCriterion::ABOrBC;
    if (a) use(&RefitPolicy::max_inflation, options.max_inflation);
    if (c) use(&RefitPolicy::child_distance_ratio, options.child_distance_ratio);
    if (c) use(&RefitPolicy::min_inflation, options.min_inflation);
  }

  bool none() const { return members_.empty(); }
  const std::pair<pagmo::vector_double, pagmo::vector_double>& bounds() const { return bounds_; }

  RefitPolicy policyAt(const pagmo::vector_double& x) const {
    RefitPolicy policy = base_;
    for (std::size_t i = 0; i < members_.size(); ++i) policy.*members_[i] = x[i];
    return policy;
  }

 private:
  void use(double RefitPolicy::*member, const ParameterRange& range) {
    members_.push_back(member);
    bounds_.first.push_back(range.low);
    bounds_.second.push_back(range.high);
  }

  RefitPolicy base_;
  std::vector<double RefitPolicy::*> members_;
  std::pair<pagmo::vector_double, pagmo::vector_double> bounds_;
};

/// For pagmo, which copies it: the cost at a point.
struct TuningProblem {
  const PolicyParameters* parameters = nullptr;
  const std::function<double(const RefitPolicy&)>* cost = nullptr;

  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    return {(*cost)(parameters->policyAt(x))};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return parameters ? parameters->bounds()
                      : std::pair<pagmo::vector_double, pagmo::vector_double>{{0}, {1}};
  }
  pagmo::thread_safety get_thread_safety() const { return pagmo::thread_safety::none; }
};

}  // namespace adaptive_bvh
