#include "ccd/placed_motion.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "base/rounding.h"

namespace adaptive_bvh {

void refuseMotion(const std::string& what) {
  throw std::invalid_argument("adaptive_bvh, continuous collision: " + what);
}

double toWorld(const fcl::Vector3d* positions, std::size_t count, const fcl::Transform3d& tf,
               std::vector<fcl::Vector3d>& world) {
  world.resize(count);
  const fcl::Matrix3d R = tf.linear();
  const fcl::Vector3d T = tf.translation();
  const bool is_identity = R == fcl::Matrix3d::Identity() && T.isZero(0);
  double largest = 0, sum = 0;  // `sum` is NaN if a coordinate is not finite, else 0
  for (std::size_t i = 0; i < count; ++i) {
    const fcl::Vector3d x = positions[i];
    world[i] = is_identity ? x : fcl::Vector3d(R * x + T);
    sum += world[i].lpNorm<1>() * 0;
    largest = std::max({largest, x.lpNorm<1>(), world[i].lpNorm<1>()});
  }
  if (!(sum == 0) || !(largest <= 6 * rounding::largestCoordinate<double>()))
    refuseMotion("a position is not finite, or too large");
  return is_identity ? 0 : R.cwiseAbs().maxCoeff() * largest + T.lpNorm<1>();
}

PlacedMotion::PlacedMotion(const MeshState& mesh, const fcl::Vector3d* start,
                           const fcl::Vector3d* end, const fcl::Transform3d& start_tf,
                           const fcl::Transform3d& end_tf, Memory& memory)
    : threads_(mesh.threads) {
  const std::size_t count = mesh.vertices.size();
  const bool is_still = start == end && start_tf.matrix() == end_tf.matrix();
  const double size = std::max(toWorld(start, count, start_tf, memory.start),
                               is_still ? 0 : toWorld(end, count, end_tf, memory.end));
  const MeshTopology& topology = *mesh.topology;
  mesh_ = {mesh.tree.nodes(),
           topology.leaves.corners.data(),
           &topology.leaves.slots,
           &topology.owners,
           &topology.features,
           memory.start.data(),
           is_still ? memory.start.data() : memory.end.data(),
           topology.triangles.data(),
           static_cast<unsigned>(count),
           static_cast<unsigned>(topology.triangles.size()),
           mesh.tree.size(),
           mesh.tree.depth(),
           8 * std::numeric_limits<double>::epsilon() * size,
           16 * std::numeric_limits<double>::epsilon() * size};
}

}  // namespace adaptive_bvh
