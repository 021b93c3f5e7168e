// Update + query of a deforming mesh against primitive shapes: this library, and FCL
// with its top-down refit. In one process, in turn; medians over the frames.
#include <algorithm>
#include <cstdio>
#include <memory>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "contact_bodies.h"
#include "fcl_support.h"
#include "median.h"
#include "method.h"
#include "stopwatch.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include "pose_files.h"
#endif

namespace {

using namespace adaptive_bvh_bench;  // NOLINT: this is its program
using Shape = std::shared_ptr<fcl::CollisionGeometryd>;
using Transform = fcl::Transform3d;

struct Query {
  const char* name;
  Shape shape;
  bool is_distance;
  double off;  ///< from a vertex of the mesh, as a share of its size
};

/// `size`: of the mesh.
std::vector<Query> queries(double size) {
  const Shape sphere = std::make_shared<fcl::Sphered>(0.05 * size),
              box = std::make_shared<fcl::Boxd>(0.2 * size, 0.08 * size, 0.05 * size),
              capsule = std::make_shared<fcl::Capsuled>(0.02 * size, 0.4 * size),
              cylinder = std::make_shared<fcl::Cylinderd>(0.03 * size, 0.4 * size),
              below = std::make_shared<fcl::Halfspaced>(fcl::Vector3d::UnitX(), 0);
  std::vector<Query> all;
  for (const auto& [name, shape] :
       {std::pair("sphere", sphere), std::pair("box", box), std::pair("capsule", capsule),
        std::pair("cylinder", cylinder)}) {
    all.push_back({name, shape, false, 0});
    all.push_back({name, shape, false, 0.6});
    all.push_back({name, shape, true, 0});
    all.push_back({name, shape, true, 0.6});
  }
  all.push_back({"half-space", below, false, 0});
  return all;
}

struct Times {
  std::vector<double> update, query;
};

void print(const Query& query, const char* method, const Times& times, std::size_t contacts,
           double distance) {
  std::printf("| %s, %s | %s | %s | %.3f | %.3f | ", query.name,
              query.off > 0 ? "apart" : "touching", query.is_distance ? "distance" : "collide",
              method, median(times.update), median(times.query));
  if (query.is_distance)
    std::printf("%.9g |\n", distance);
  else
    std::printf("%zu contacts |\n", contacts);
}

/// Returns whether the answers agree.
bool measure(const scenarios::Body& body, const Query& query, const Transform& pose) {
  adaptive_bvh::AdaptiveBVHModeld ours;
  fcl::BVHModel<fcl::RSSd> fcls;
  fillModel(body.mesh(), ours);
  fillModel(body.mesh(), fcls);
  const Transform still = Transform::Identity();
  const fcl::CollisionRequestd all(10000000, true);
  const fcl::DistanceRequestd plain;
  Times our_times, fcl_times;
  std::size_t our_contacts = 0, fcl_contacts = 0;
  double our_distance = 0, fcl_distance = 0, difference = 0, excess = 0;
  Positions positions;
  for (int f = 1; f <= body.frames(); ++f) {
    body.positions(f, positions);
    our_times.update.push_back(milliseconds([&] { ours.update(positions); }));
    fcl_times.update.push_back(milliseconds([&] { refitTopDown(fcls, positions); }));
    fcl::CollisionResultd our_result, fcl_result;
    fcl::DistanceResultd our_nearest, fcl_nearest;
    our_times.query.push_back(milliseconds([&] {
      if (query.is_distance)
        our_distance = adaptive_bvh::distance<double>(&ours, still, query.shape.get(), pose, plain,
                                                      our_nearest);
      else
        our_contacts +=
            adaptive_bvh::collide<double>(&ours, still, query.shape.get(), pose, all, our_result);
    }));
    fcl_times.query.push_back(milliseconds([&] {
      if (query.is_distance)
        fcl_distance =
            fcl::distance<double>(&fcls, still, query.shape.get(), pose, plain, fcl_nearest);
      else
        fcl_contacts +=
            fcl::collide<double>(&fcls, still, query.shape.get(), pose, all, fcl_result);
    }));
    // FCL leaves the distance of a sphere that touches uninitialised.
    if (our_distance > 0 || query.shape->getNodeType() != fcl::GEOM_SPHERE) {
      const double more = std::max(our_distance, 0.) - std::max(fcl_distance, 0.);
      difference = std::max(difference, std::abs(more));
      excess = std::max(excess, more);
    }
  }
  print(query, "ours", our_times, our_contacts, our_distance);
  print(query, "FCL", fcl_times, fcl_contacts, fcl_distance);
  std::fflush(stdout);
  constexpr double kGjk = 1e-4;  // FCL's solvers end too far away by as much
  return our_contacts == fcl_contacts && difference < kGjk && excess < 2e-6;
}

scenarios::Body bodyOf(const std::vector<std::string>& poses) {
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  if (!poses.empty())
    return scenarios::turnedGenerically(loadPoses(poses[0], poses[1], false)).first;
#endif
  return scenarios::coilingCable(4);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> poses;
  CLI::App app("Update + queries of a deforming mesh against shapes, ms a frame.");
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  app.add_option("--poses", poses, "Two poses of one mesh: FROM TO; else a coiling cable")
      ->expected(2);
#endif
  CLI11_PARSE(app, argc, argv);
  try {
    const scenarios::Body body = bodyOf(poses);
    const Positions rest = body.positions(1);
    fcl::AABBd box;
    for (const scenarios::Point& p : rest) box += p;
    const double size = (box.max_ - box.min_).norm();
    std::printf(
        "%zu triangles\n\n| shape | query | method | update | query | answer |\n"
        "| --- | --- | --- | ---: | ---: | --- |\n",
        body.triangles().size());
    bool agree = true;
    for (const Query& query : queries(size)) {
      Transform pose = Transform::Identity();
      pose.linear() =
          fcl::AngleAxisd(0.7, scenarios::Point(1, 2, 3).normalized()).toRotationMatrix();
      pose.translation() =
          rest[rest.size() / 3] + query.off * size * scenarios::Point(0.3, 0.5, 0.8).normalized();
      agree &= measure(body, query, pose);
    }
    return agree ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "shape_bench: %s\n", error.what());
    return 1;
  }
}
