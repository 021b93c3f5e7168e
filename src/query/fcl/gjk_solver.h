#pragma once

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/detail/gjk_solver_indep.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>
#include <fcl/narrowphase/distance_request.h>

namespace adaptive_bvh {

/// Calls run(solver) with the solver of FCL's that a request names, set up as FCL does for it.
template <typename S, typename Run>
auto withSolver(const fcl::DistanceRequest<S>& request, Run&& run) {
  if (request.gjk_solver_type == fcl::GST_LIBCCD) {
    fcl::detail::GJKSolver_libccd<S> solver;
    solver.distance_tolerance = request.distance_tolerance;
    return run(solver);
  }
  fcl::detail::GJKSolver_indep<S> solver;
  solver.gjk_tolerance = request.distance_tolerance;
  return run(solver);
}

template <typename S, typename Run>
auto withSolver(const fcl::CollisionRequest<S>& request, Run&& run) {
  if (request.gjk_solver_type == fcl::GST_LIBCCD) {
    fcl::detail::GJKSolver_libccd<S> solver;
    solver.collision_tolerance = request.gjk_tolerance;
    return run(solver);
  }
  fcl::detail::GJKSolver_indep<S> solver;
  solver.gjk_tolerance = request.gjk_tolerance;
  solver.epa_tolerance = request.gjk_tolerance;
  return run(solver);
}

}  // namespace adaptive_bvh
