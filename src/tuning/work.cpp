#include <algorithm>
#include <chrono>
#include <cmath>

#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/tuning.h"

// SimulationWork and WorkCosts: counted work as a time, with costs measured on this machine.
namespace adaptive_bvh {
namespace {

using Point = fcl::Vector3d;

/// The time of work(i) in nanoseconds: the mean over `calls` calls, the least of seven rounds.
template <typename Work>
double nanoseconds(int calls, Work&& work) {
  double least = 1e300;
  for (int round = 0; round < 7; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) work(i);
    const std::chrono::duration<double, std::nano> elapsed =
        std::chrono::steady_clock::now() - start;
    least = std::min(least, elapsed.count() / calls);
  }
  return least;
}

/// A sheet with hills, 64 x 64 cells.
TriangleMesh hills() {
  constexpr std::size_t kCells = 64;
  TriangleMesh mesh;
  for (std::size_t j = 0; j <= kCells; ++j)
    for (std::size_t i = 0; i <= kCells; ++i) {
      const double x = double(i) / kCells, y = double(j) / kCells;
      mesh.vertices.emplace_back(x, y, 0.2 * std::sin(7 * x) * std::cos(5 * y));
    }
  for (std::size_t j = 0; j < kCells; ++j)
    for (std::size_t i = 0; i < kCells; ++i) {
      const std::size_t v = j * (kCells + 1) + i;
      mesh.triangles.emplace_back(v, v + 1, v + kCells + 2);
      mesh.triangles.emplace_back(v, v + kCells + 2, v + kCells + 1);
    }
  return mesh;
}

/// Measures costs in nanoseconds on two such sheets in many poses, through the public API.
class CostMeasurement {
 public:
  explicit CostMeasurement(Propagation propagation) {
    RefitPolicy policy;
    policy.propagation = propagation;
    policy.criterion = FitnessCriterion::RefitNone;
    for (AdaptiveBVHModeld* model : {&first_, &second_}) {
      model->setRefitPolicy(policy);
      fillModel(hills(), *model);
    }
  }

  WorkCosts run() {
    WorkCosts costs;
    costs.leaf_test = leafTest();
    measureQueries(costs);
    costs.propagated = propagated();
    costs.refitted_leaf = fit(1, 8000);
    // The fit of an inner node: a constant plus a time per primitive.
    const double fit_of_2 = fit(2, 8000), fit_of_512 = fit(512, 100);
    costs.refitted_primitive = std::max(0., (fit_of_512 - fit_of_2) / 510);
    costs.refitted_inner = std::max(0., fit_of_2 - 2 * costs.refitted_primitive);
    if (!std::isfinite(sink_)) costs.bv_test += 1e-9;  // a use of `sink_`
    return costs;
  }

 private:
  /// The time of FCL's distance of two triangles.
  double leafTest() {
    const fcl::Matrix3d R = Eigen::AngleAxisd(0.7, Point(1, 2, 3).normalized()).matrix();
    const Point T(0.2, 0.1, 1.5);
    return nanoseconds(20000, [&](int i) {
      const auto corner = [&](int t, int k) -> const Point& {
        return first_.vertices[first_.tri_indices[t % first_.num_tris][k]];
      };
      const int j = 7 * i + 3;
      Point p, q;
      sink_ += fcl::detail::TriangleDistance<double>::triDistance(
          corner(i, 0), corner(i, 1), corner(i, 2), corner(j, 0), corner(j, 1), corner(j, 2), R, T,
          p, q);
    });
  }

  /// Returns the time of a distance query and sets `work` to its work. The second sheet is rotated
  /// by the angle `turn` and raised by `lift`.
  double query(double turn, double lift, QueryWork& work) {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = Eigen::AngleAxisd(turn, Point(1, 0.2, 3).normalized()).matrix();
    tf.translation() = Point(0.3 * turn, 0.1, lift);
    const QueryWork before = first_.recordedWork();
    const auto ask = [&](int) {
      fcl::DistanceResultd result;
      sink_ += adaptive_bvh::distance(&first_, fcl::Transform3d::Identity(), &second_, tf,
                                      fcl::DistanceRequestd(), result);
    };
    ask(0);
    const double time = nanoseconds(1, ask);
    const QueryWork after = first_.recordedWork();
    const auto each = [&](long QueryWork::*count) {
      return (after.*count - before.*count) / (after.queries - before.queries);
    };
    work.bv_tests = each(&QueryWork::bv_tests);
    work.leaf_tests = each(&QueryWork::leaf_tests);
    return time;
  }

  /// Sets costs.bv_test to the time of queries without their leaf tests, per test of volumes.
  void measureQueries(WorkCosts& costs) {
    constexpr int kPoses = 40;
    double bv_time = 0, bv_tests = 0;
    for (int i = 0; i < kPoses; ++i) {
      const double turn = 0.08 * i, lift = 0.3 + 0.02 * (i % 10);
      QueryWork work;
      bv_time += query(turn, lift, work) - costs.leaf_test * double(work.leaf_tests);
      bv_tests += double(work.bv_tests);
    }
    costs.bv_test = bv_time / bv_tests;
  }

  /// The time per propagated volume. All vertices move to and fro, by different displacements.
  double propagated() {
    std::vector<Point> rest(first_.vertices, first_.vertices + first_.num_vertices), bent = rest;
    for (Point& p : bent) p[2] += 1e-4 * std::sin(20 * p[0]);
    double least = 1e300;
    for (int i = 0; i < 40; ++i) {
      const UpdateReport& report = first_.update(i % 2 == 0 ? bent : rest);
      least = std::min(least, 1e9 * report.propagation_seconds / report.propagated());
    }
    return least;
  }

  /// The time of a fit of `count` triangles, by the fitter that the model gives to FCL.
  double fit(int count, int calls) {
    std::vector<unsigned> primitives(static_cast<std::size_t>(first_.num_tris));
    for (std::size_t i = 0; i < primitives.size(); ++i) primitives[i] = unsigned(i);
    first_.bv_fitter->set(first_.vertices, first_.tri_indices, fcl::BVH_MODEL_TRIANGLES);
    const double time = nanoseconds(calls, [&](int i) {
      const int start = i * count % (first_.num_tris - count);
      sink_ += first_.bv_fitter->fit(&primitives[std::size_t(start)], count).width();
    });
    first_.bv_fitter->clear();
    return time;
  }

  AdaptiveBVHModeld first_, second_;
  double sink_ = 0;  // keeps the compiler from removing unused results
};

}  // namespace

void SimulationWork::add(const UpdateReport& update) {
  propagated += update.propagated();
  refitted_leaves += update.refitted_leaves;
  refitted_inner += update.refitted_inner;
  refitted_primitives += update.refitted_primitives;
}

void SimulationWork::add(const QueryWork& queries) {
  bv_tests += queries.bv_tests;
  leaf_tests += queries.leaf_tests;
}

SimulationWork& SimulationWork::operator+=(const SimulationWork& other) {
  bv_tests += other.bv_tests;
  leaf_tests += other.leaf_tests;
  propagated += other.propagated;
  refitted_leaves += other.refitted_leaves;
  refitted_inner += other.refitted_inner;
  refitted_primitives += other.refitted_primitives;
  seconds += other.seconds;
  return *this;
}

// The costs are in nanoseconds. refitted_leaf includes the leaf's primitive.
double WorkCosts::seconds(const SimulationWork& work) const {
  return 1e-9 *
         (bv_test * double(work.bv_tests) + leaf_test * double(work.leaf_tests) +
          propagated * double(work.propagated) + refitted_leaf * double(work.refitted_leaves) +
          refitted_inner * double(work.refitted_inner) +
          refitted_primitive * double(work.refitted_primitives - work.refitted_leaves));
}

WorkCosts WorkCosts::measured(Propagation propagation) {
  return CostMeasurement(propagation).run();
}

}  // namespace adaptive_bvh
