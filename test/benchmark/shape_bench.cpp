// Update + query of a deforming mesh against primitive shapes: this library, and FCL
// with its top-down refit. In one process, in turn; medians over the frames. Ours is judged in long
// double. Half-spaces have a distance only here.
#include <algorithm>
#include <cstdio>
#include <memory>

#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "contact_bodies.h"
#include "fcl_support.h"
#include "median.h"
#include "method.h"
#include "stopwatch.h"
#include "support/shape_oracle.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include "pose_files.h"
#endif

namespace {

using namespace adaptive_bvh_bench;  // NOLINT: this is its program
using Shape = adaptive_bvh_test::JudgedShape;
using Transform = fcl::Transform3d;
namespace exact = adaptive_bvh_test::exact;

struct Query {
  Shape shape;
  bool is_distance;
  double off;  ///< from a vertex of the mesh, as a share of its size
};

/// `size`: of the mesh.
std::vector<Query> queries(double size) {
  using namespace adaptive_bvh_test::judged_shapes;
  std::vector<Query> all;
  for (const Shape& shape :
       {sphere(0.05 * size), box(fcl::Vector3d(0.2 * size, 0.08 * size, 0.05 * size)),
        capsule(0.02 * size, 0.4 * size), cylinder(0.03 * size, 0.4 * size)}) {
    all.push_back({shape, false, 0});
    all.push_back({shape, false, 0.6});
    all.push_back({shape, true, 0});
    all.push_back({shape, true, 0.6});
  }
  const Shape below = flat(fcl::Vector3d::UnitX(), 0, true);
  all.push_back({below, false, 0});
  all.push_back({below, true, 0});
  return all;
}

struct Times {
  std::vector<double> update, query;
};

void print(const Query& query, const char* method, const Times& times, std::size_t contacts,
           double distance) {
  std::printf("| %s, %s | %s | %s | %.3f | %.3f | ", query.shape.name,
              query.off > 0 ? "apart" : "touching", query.is_distance ? "distance" : "collide",
              method, median(times.update), median(times.query));
  if (query.is_distance)
    std::printf("%.9g |\n", distance);
  else
    std::printf("%zu contacts |\n", contacts);
}

/// What is right in one frame, in long double.
struct Truth {
  double distance;
  std::size_t contacts = 0;

  Truth(const Shape& shape, const Transform& pose, const scenarios::Body& body,
        const Positions& positions) {
    const Transform to_shape = pose.inverse(Eigen::Isometry);
    exact::Real least = 1e30L;
    for (const fcl::Triangle& t : body.triangles()) {
      exact::Triangle triangle;
      for (std::size_t k = 0; k < 3; ++k)
        triangle[k] = exact::of(fcl::Vector3d(to_shape * positions[t[int(k)]]));
      const exact::Point middle = (triangle[0] + triangle[1] + triangle[2]) / 3;
      exact::Real radius = 0;
      for (const exact::Point& x : triangle) radius = std::max(radius, (x - middle).norm());
      if (shape.distance(middle) - radius > least) continue;
      const exact::Real distance = shape.distanceTo(triangle);
      least = std::min(least, distance);
      contacts += distance <= 0;
    }
    distance = static_cast<double>(least);
  }
};

/// Returns whether ours is right.
bool measure(const scenarios::Body& body, const Query& query, const Transform& pose) {
  adaptive_bvh::DeformableMesh ours(body.mesh());
  fcl::BVHModel<fcl::RSSd> fcls;
  fillModel(body.mesh(), fcls);
  const Transform still = Transform::Identity();
  const fcl::CollisionRequestd all(10000000, true);
  const fcl::DistanceRequestd plain;
  const auto* shape = query.shape.geometry.get();
  const bool has_fcl = !query.is_distance || shape->getNodeType() != fcl::GEOM_HALFSPACE;
  Times our_times, fcl_times;
  std::size_t our_contacts = 0, fcl_contacts = 0;
  double our_distance = 0, fcl_distance = 0;
  bool is_right = true;
  Positions positions;
  for (int f = 1; f <= body.frames(); ++f) {
    body.positions(f, positions);
    our_times.update.push_back(milliseconds([&] { ours.update(positions); }));
    fcl_times.update.push_back(milliseconds([&] { refitTopDown(fcls, positions); }));
    fcl::CollisionResultd our_result, fcl_result;
    fcl::DistanceResultd our_nearest, fcl_nearest;
    our_times.query.push_back(milliseconds([&] {
      if (query.is_distance)
        our_distance = adaptive_bvh::distance(&ours, still, shape, pose, plain, our_nearest);
      else
        our_contacts += adaptive_bvh::collide(&ours, still, shape, pose, all, our_result);
    }));
    if (has_fcl)
      fcl_times.query.push_back(milliseconds([&] {
        if (query.is_distance)
          fcl_distance = fcl::distance(&fcls, still, shape, pose, plain, fcl_nearest);
        else
          fcl_contacts += fcl::collide(&fcls, still, shape, pose, all, fcl_result);
      }));
    if (f % 8 != 1) continue;
    const Truth truth(query.shape, pose, body, positions);
    is_right = is_right && (query.is_distance ? std::abs(our_distance - truth.distance) < 1e-9
                                              : our_result.numContacts() == truth.contacts);
  }
  print(query, "ours", our_times, our_contacts, our_distance);
  if (has_fcl) print(query, "FCL", fcl_times, fcl_contacts, fcl_distance);
  std::fflush(stdout);
  return is_right;
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
    bool is_right = true;
    for (const Query& query : queries(size)) {
      Transform pose = Transform::Identity();
      pose.linear() =
          fcl::AngleAxisd(0.7, scenarios::Point(1, 2, 3).normalized()).toRotationMatrix();
      pose.translation() =
          rest[rest.size() / 3] + query.off * size * scenarios::Point(0.3, 0.5, 0.8).normalized();
      is_right &= measure(body, query, pose);
    }
    return is_right ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "shape_bench: %s\n", error.what());
    return 1;
  }
}
