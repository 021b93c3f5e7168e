// Self-collision of deforming meshes: our update and selfCollide against FCL's full refit
// (top-down, the sound one) and the same query on it. Both must find the same pairs. Interleaved in
// one process; medians.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>

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

std::size_t plainSelfCollide(const Plain& model, const fcl::CollisionRequestd& request) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  fcl::CollisionResultd result;
  PlainNode node;
  fcl::detail::initialize(static_cast<fcl::detail::MeshCollisionTraversalNodeRSSd&>(node), model,
                          still, model, still, request, result);
  fcl::detail::selfCollide(static_cast<fcl::detail::CollisionTraversalNodeBased*>(&node));
  return result.numContacts();
}

/// A hose that is wound up until its turns go through each other.
scenarios::Body coil(int resolution) {
  return {"coiling cable", scenarios::tube(9 * resolution, 10 * resolution, 0.13, 1), 40,
          [](const Point& rest, double t) -> Point {
            const double along = -rest[2], turn = 0.3 + 14 * t * along;
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

/// True when both found the same number of pairs in every frame.
bool measure(const scenarios::Body& body, int rounds) {
  const fcl::CollisionRequestd all(100000000);
  std::vector<double> ours, fcls, update, refit;
  std::size_t pairs = 0;
  bool same = true;
  for (int round = 0; round < rounds; ++round) {
    adaptive_bvh::AdaptiveBVHModeld adaptive;
    Plain plain;
    fillModel(body.mesh(), adaptive);
    fillModel(body.mesh(), plain);
    double sums[4] = {0, 0, 0, 0};
    pairs = 0;
    for (int frame = 0; frame < body.frames(); ++frame) {
      const Positions positions = body.positions(frame);
      sums[0] += milliseconds([&] { adaptive.update(positions); });
      std::size_t found = 0, expected = 0;
      sums[1] += milliseconds([&] {
        fcl::CollisionResultd result;
        found = selfCollide(adaptive, all, result);
      });
      sums[2] += milliseconds([&] {
        plain.beginReplaceModel();
        plain.replaceSubModel(positions);
        plain.endReplaceModel(true, false);
      });
      sums[3] += milliseconds([&] { expected = plainSelfCollide(plain, all); });
      same &= found == expected;
      pairs += found;
    }
    for (double& sum : sums) sum /= body.frames();
    update.push_back(sums[0]);
    ours.push_back(sums[0] + sums[1]);
    refit.push_back(sums[2]);
    fcls.push_back(sums[2] + sums[3]);
  }
  std::printf("| %s | %zu | %.0f | %.2f | %.2f | %.2f | %.2f | %.1f | %s |\n", body.name().c_str(),
              body.triangles().size(), double(pairs) / body.frames(), median(update), median(ours),
              median(refit), median(fcls), median(fcls) / median(ours), same ? "yes" : "NO");
  return same;
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
      "| times faster | same pairs |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: "
      "| --- |\n");
  bool same = true;
  for (int resolution : resolutions)
    for (const scenarios::Body& body :
         {scenarios::foldingSheet(resolution), coil(resolution), crumple(resolution)})
      same &= measure(body, rounds);
  return same ? 0 : 1;
}
