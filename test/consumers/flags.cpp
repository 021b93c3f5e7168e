// A user's program that flags.sh compiles with one set of flags after another: distances and
// contacts of meshes that deform, refitted volumes, and FCL's own distance of two models, whose
// traversal's node is made here. Prints every bit of what the library finds.
#include <cmath>
#include <cstdio>

#include <adaptive_bvh/adaptive_bvh_model.h>
#include <adaptive_bvh/coherent_distance.h>
#include <adaptive_bvh/query.h>
#include <fcl/narrowphase/distance.h>

namespace {

constexpr int kSide = 12;

/// A wavy square. Its coordinates are multiples of 2^-20: whatever a compiler makes of the sines,
/// they are the same in every program.
std::vector<fcl::Vector3d> positionsAt(int step) {
  std::vector<fcl::Vector3d> positions;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j)
      positions.emplace_back(
          i * 0.125, j * 0.125,
          std::round(std::ldexp(std::sin(0.7 * i + 0.3 * step) * std::cos(0.9 * j), 20)) /
              (1 << 20));
  return positions;
}

std::vector<fcl::Triangle> triangles() {
  std::vector<fcl::Triangle> triangles;
  for (int i = 0; i + 1 < kSide; ++i)
    for (int j = 0; j + 1 < kSide; ++j) {
      const auto a = static_cast<std::size_t>(i * kSide + j), b = a + kSide;
      triangles.emplace_back(a, b, a + 1);
      triangles.emplace_back(b, b + 1, a + 1);
    }
  return triangles;
}

/// Turned, and away. The compiler computes these numbers.
fcl::Transform3d otherPose() {
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  pose.linear() << 2. / 3, -1. / 3, 2. / 3, 2. / 3, 2. / 3, -1. / 3, -1. / 3, 2. / 3, 2. / 3;
  pose.translation() = fcl::Vector3d(0.25, 0.125, 2.75);
  return pose;
}

using Model = adaptive_bvh::AdaptiveBVHModel<fcl::RSSd>;

/// fcl::distance in its two steps: this program makes the traversal's node, libfcl fills it.
double distanceByTraversal(const Model& first, const fcl::Transform3d& tf1, const Model& second,
                           const fcl::Transform3d& tf2, fcl::DistanceResultd& result) {
  fcl::detail::MeshDistanceTraversalNodeRSSd node;
  fcl::detail::initialize(node, first, tf1, second, tf2, fcl::DistanceRequestd(true), result);
  fcl::detail::distance(&node);
  return result.min_distance;
}

}  // namespace

int main() {
  adaptive_bvh::DeformableMesh first(positionsAt(0), triangles()), second(first);
  Model model;
  model.beginModel();
  model.addSubModel(positionsAt(0), triangles());
  model.endModel();
  const Model still(model);
  adaptive_bvh::CoherentDistance pair(first, second);
  const fcl::Transform3d here = fcl::Transform3d::Identity(), there = otherPose();
  for (int step = 1; step <= 10; ++step) {
    first.update(positionsAt(step));
    model.update(positionsAt(step));
    fcl::DistanceResultd coherent, fcl_result;
    pair.distance(here, there, fcl::DistanceRequestd(true), coherent);
    const double by_fcl = distanceByTraversal(model, here, still, there, fcl_result);
    std::printf("%d: %a at", step, coherent.min_distance);
    for (const double x : coherent.nearest_points[0]) std::printf(" %a", x);
    const fcl::RSSd& root = model.getBV(0).bv;
    std::printf(", root %a %a %a\n", root.l[0], root.l[1], root.r);
    if (!(coherent.min_distance > 0) || std::abs(coherent.min_distance - by_fcl) > 1e-9) return 1;
  }
  fcl::Transform3d crossing = there;
  crossing.translation().z() = 0.5;
  fcl::CollisionResultd contacts;
  adaptive_bvh::collide(&first, here, &second, crossing, fcl::CollisionRequestd(1 << 12, true),
                        contacts);
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    const fcl::Contactd& contact = contacts.getContact(i);
    std::printf("%d %d: %a deep at %a\n", int(contact.b1), int(contact.b2),
                contact.penetration_depth, contact.pos.x());
  }
  return model.validate() && contacts.numContacts() > 100 ? 0 : 1;
}
