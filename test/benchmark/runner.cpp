#include "runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <random>

#include "distance_judge.h"

namespace adaptive_bvh_bench {
namespace {

/// Milliseconds since the last lap.
class Clock {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

class Run {
 public:
  Run(const scenarios::Scenario& scenario, const std::vector<MethodKind>& kinds,
      const RunOptions& options)
      : scenario_(scenario), kinds_(kinds), options_(options) {
    result_.name = scenario.name;
    result_.frames = scenario.frames();
    result_.triangles = scenario.triangles();
    result_.methods.resize(kinds.size());
    steps_ = 1 + double(kinds.size()) * options.repeats;
  }

  ScenarioResult all() {
    askOracle();
    std::vector<std::size_t> order(kinds_.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::mt19937 random(options_.seed);
    for (int repeat = 0; repeat < options_.repeats; ++repeat) {
      std::shuffle(order.begin(), order.end(), random);
      for (std::size_t k : order) {
        step(kinds_[k].title);
        runMethod(kinds_[k], repeat == 0, result_.methods[k]);
      }
    }
    return std::move(result_);
  }

 private:
  void step(const std::string& what) {
    if (options_.progress) options_.progress(done_++ / steps_, scenario_.name + ": " + what);
  }

  /// The scenario's frame. Where objects move as well, both go round together, and the second turns
  /// a little about its middle and goes away from the first and back.
  void load(int frame) {
    scenario_.first.positions(frame, frame_.first);
    scenario_.second.positions(frame, frame_.second);
    if (!options_.moving) return;
    const double t = 2 * M_PI * frame / scenario_.frames();
    const Point middle = frame_.second[frame_.second.size() / 2];
    const Point away = (middle - frame_.first[frame_.first.size() / 2]).normalized();
    const auto turn = [](double angle, const Point& axis) {
      return fcl::Transform3d(Eigen::AngleAxisd(angle, axis.normalized()));
    };
    const fcl::Transform3d round =
        Eigen::Translation3d(2 * std::cos(t), 0, std::sin(t)) * turn(t, Point(0.3, 1, 0.2));
    frame_.tf1 = round;
    frame_.tf2 = round * Eigen::Translation3d(middle + 0.1 * (1 - std::cos(3 * t)) * away) *
                 turn(0.1 * std::sin(2 * t), Point(1, 0.4, -0.6)) * Eigen::Translation3d(-middle);
  }

  void askOracle() {
    step("oracle");
    for (int frame = 1; frame <= scenario_.frames(); ++frame) {
      load(frame);
      Positions p = frame_.first, q = frame_.second;
      for (Point& point : p) point = frame_.tf1 * point;
      for (Point& point : q) point = frame_.tf2 * point;
      exact_.push_back(exactDistance({std::move(p), scenario_.first.triangles()},
                                     {std::move(q), scenario_.second.triangles()}));
      result_.touching_frames += exact_.back() <= 0;
    }
  }

  void runMethod(const MethodKind& kind, bool first_time, Measurement& m) {
    const std::unique_ptr<Method> method = kind.make(scenario_);
    double update = 0, query = 0;
    m.frame_ms.resize(exact_.size(), std::numeric_limits<double>::max());
    for (std::size_t i = 0; i < exact_.size(); ++i) {
      load(int(i) + 1);
      Clock clock;
      method->update(frame_);
      const double update_ms = clock.lap();
      const double distance = method->distance(frame_);
      const double query_ms = clock.lap();
      update += update_ms;
      query += query_ms;
      m.frame_ms[i] = std::min(m.frame_ms[i], update_ms + query_ms);

      if (!first_time) continue;
      m.work += method->work(frame_);
      const double error = std::abs(distance - exact_[i]);
      m.worst_error = std::max(m.worst_error, error);
      m.wrong_frames += !(error <= 1e-9 * (1 + exact_[i]));
    }
    m.update_ms.push_back(update);
    m.query_ms.push_back(query);
    m.touching_ms = 0;
    for (std::size_t i = 0; i < exact_.size(); ++i)
      if (exact_[i] <= 0) m.touching_ms += m.frame_ms[i];
    m.bytes_per_triangle = double(method->bytes()) / double(scenario_.triangles());
  }

  const scenarios::Scenario& scenario_;
  const std::vector<MethodKind>& kinds_;
  const RunOptions& options_;
  ScenarioResult result_;
  Frame frame_;
  std::vector<double> exact_;  // by frame
  double steps_, done_ = 0;
};

}  // namespace

ScenarioResult runScenario(const scenarios::Scenario& scenario,
                           const std::vector<MethodKind>& kinds, const RunOptions& options) {
  return Run(scenario, kinds, options).all();
}

}  // namespace adaptive_bvh_bench
