// Self-collision of deforming meshes: our update and selfCollide against FCL's full refit
// (top-down, the sound one) and the same query on it. Both must find the same pairs. Interleaved in
// one process; medians.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>

#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/self_collision.h"
#include "bodies.h"
#include "median.h"

namespace {

using adaptive_bvh_bench::median;
using scenarios::Point;
using Plain = fcl::BVHModel<fcl::RSSd>;
using Positions = std::vector<Point>;

double milliseconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

/// FCL's own self-collision, neighbours left out.
class PlainNode : public fcl::detail::MeshCollisionTraversalNodeRSSd {
 public:
  void leafTesting(int b1, int b2) const override {
    const fcl::Triangle& a = tri_indices1[model1->getBV(b1).primitiveId()];
    const fcl::Triangle& b = tri_indices1[model1->getBV(b2).primitiveId()];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (a[i] == b[j]) return;
    fcl::detail::MeshCollisionTraversalNodeRSSd::leafTesting(b1, b2);
  }
};

void plainSelfCollide(const Plain& model, const fcl::CollisionRequestd& request,
                      fcl::CollisionResultd& result) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  PlainNode node;
  fcl::detail::initialize(static_cast<fcl::detail::MeshCollisionTraversalNodeRSSd&>(node), model,
                          still, model, still, request, result);
  fcl::detail::selfCollide(static_cast<fcl::detail::CollisionTraversalNodeBased*>(&node));
}

using Pairs = std::vector<std::pair<long, long>>;

/// In order.
Pairs pairsOf(const fcl::CollisionResultd& result) {
  Pairs pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    pairs.push_back(std::minmax<long>(result.getContact(i).b1, result.getContact(i).b2));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Those in `a` that are not in `b`.
std::size_t missing(const Pairs& a, const Pairs& b) {
  Pairs difference;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(difference));
  return difference.size();
}

/// A hose that is wound up until its turns go through each other.
scenarios::Body coil(int resolution) {
  return {"coiling cable", scenarios::tube(9 * resolution, 10 * resolution, 0.13, 1), 40,
          [](const Point& rest, double t) -> Point {
            const double along = -rest[2], turn = (2 + 12 * t) * along;
            const double radius = 1 - 0.2 * t + rest[0];
            return {radius * std::cos(turn), radius * std::sin(turn), 0.3 * along + rest[1]};
          }};
}

/// Every vertex goes its own way, by less than half of the size.
scenarios::Body crumple(int resolution) {
  return {"crumpled sheet", scenarios::grid(9 * resolution, 9 * resolution, 1, 1), 20,
          [](const Point& rest, double t) -> Point {
            const double a = 37 * rest[0], b = 41 * rest[1];
            return rest +
                   0.1 * t * Point(std::sin(3 * a + b), std::cos(a - 2 * b), std::sin(a * b));
          }};
}

/// True when we found every pair that FCL found, in every frame. FCL may miss some: its distance of
/// nearly parallel volumes may be too large.
bool measure(const scenarios::Body& body, int rounds) {
  const fcl::CollisionRequestd all(100000000);
  std::vector<double> both, fcls, update, refit;
  std::size_t pairs = 0;
  std::size_t missed = 0, missed_by_fcl = 0;
  for (int round = 0; round < rounds; ++round) {
    adaptive_bvh::AdaptiveBVHModeld adaptive;
    Plain plain;
    fillModel(body.mesh(), adaptive);
    fillModel(body.mesh(), plain);
    double sums[4] = {0, 0, 0, 0};
    pairs = missed = missed_by_fcl = 0;
    for (int frame = 0; frame < body.frames(); ++frame) {
      const Positions positions = body.positions(frame);
      sums[0] += milliseconds([&] { adaptive.update(positions); });
      fcl::CollisionResultd found, expected;
      sums[1] += milliseconds([&] { selfCollide(adaptive, all, found); });
      sums[2] += milliseconds([&] {
        plain.beginReplaceModel();
        plain.replaceSubModel(positions);
        plain.endReplaceModel(true, false);
      });
      sums[3] += milliseconds([&] { plainSelfCollide(plain, all, expected); });
      const Pairs ours = pairsOf(found), theirs = pairsOf(expected);
      missed += missing(theirs, ours);
      missed_by_fcl += missing(ours, theirs);
      pairs += ours.size();
    }
    for (double& sum : sums) sum /= body.frames();
    update.push_back(sums[0]);
    both.push_back(sums[0] + sums[1]);
    refit.push_back(sums[2]);
    fcls.push_back(sums[2] + sums[3]);
  }
  std::printf("| %s | %zu | %.0f | %.2f | %.2f | %.2f | %.2f | %.1f | %zu | %zu |\n",
              body.name().c_str(), body.triangles().size(), double(pairs) / body.frames(),
              median(update), median(both), median(refit), median(fcls),
              median(fcls) / median(both), missed, missed_by_fcl);
  return missed == 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Update + self-collision against FCL's refit + the same query, ms a frame.");
  std::vector<int> resolutions = {1, 4, 12};
  int rounds = 3;
  app.add_option("--resolution", resolutions, "Triangles times this squared; several do");
  app.add_option("--rounds", rounds, "Medians of so many")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);

  std::printf(
      "| body | triangles | pairs a frame | our update | and query | FCL's refit | and query "
      "| times faster | missed | by FCL |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: "
      "| ---: | ---: |\n");
  bool same = true;
  for (int resolution : resolutions)
    for (const scenarios::Body& body :
         {scenarios::foldingSheet(resolution), coil(resolution), crumple(resolution)})
      same &= measure(body, rounds);
  return same ? 0 : 1;
}
