// The border of TrustRegion: positions in the caller's numbers.
#include "adaptive_bvh/trust_region.h"

#include <cmath>
#include <limits>
#include <string>

#include "base/number_text.h"
#include "base/rigid.h"
#include "base/rounding.h"
#include "ccd/near_region.h"

namespace adaptive_bvh {
namespace {

void requireRequest(const TrustRegionRequest& request) {
  requireSeparation(request.distance);
  if (!(request.radius > 0) || !std::isfinite(request.radius))
    refuseMotion("the radius of a trust region is " + textOf(double(request.radius)) +
                 "; a positive length is needed");
  if (!(request.most_held >= 0)) refuseMotion("most_held is negative or not a number");
}

PlacedMotion atRest(const MeshState& mesh, const std::vector<fcl::Vector3d>& positions,
                    const fcl::Transform3d& tf, PlacedMotion::Memory& memory) {
  return {mesh, positions.data(), positions.data(), tf, tf, memory};
}

}  // namespace

struct TrustRegion::State {
  struct Obstacle {
    const Mesh* mesh;
    Transform tf;
  };

  State(const Mesh& moving, const TrustRegionRequest& limits)
      : mesh(moving), request(limits), region(limits.radius, limits.distance) {}

  /// The mesh, then the obstacles as `begin` found them.
  struct Bodies {
    std::vector<PlacedMotion::Memory> memory;
    std::vector<PlacedMotion> placed;
    std::vector<std::shared_ptr<const MeshTopology>> topologies;  ///< of the obstacles
  };

  void read(const Points& positions, std::vector<fcl::Vector3d>& result) const;
  void place(const std::vector<fcl::Vector3d>& positions, Bodies& result) const;
  void moveTo(const std::vector<fcl::Vector3d>& positions);
  TrustRegionReport accept(const Points& wanted, std::size_t held_by_radius, Points& result);

  const Mesh& mesh;
  const TrustRegionRequest request;
  NearRegion region;
  std::vector<Obstacle> obstacles;
  Points accepted, begun;                      ///< the second is memory of `begin`
  std::vector<fcl::Vector3d> proposed, start;  ///< in double precision
  bool has_begun = false;
  bool is_stale = false;  ///< whether to search before the next iterate
  Bodies bodies, next;    ///< the second is memory of `begin`
};

/// Throws std::invalid_argument unless there is a finite position for each vertex.
void TrustRegion::State::read(const Points& positions, std::vector<fcl::Vector3d>& result) const {
  if (positions.size() != mesh.vertices().size())
    refuseMotion(std::to_string(positions.size()) + " positions for " +
                 std::to_string(mesh.vertices().size()) + " vertices");
  for (const fcl::Vector3d& x : positions)
    if (!(x.lpNorm<1>() <= 6 * rounding::largestCoordinate<double>()))
      refuseMotion("a position is not finite, or too large");
  toWorld(positions.data(), positions.size(), fcl::Transform3d::Identity(), result);
}

/// Places the mesh at positions, which are finite, and the obstacles where they are now.
void TrustRegion::State::place(const std::vector<fcl::Vector3d>& positions, Bodies& result) const {
  result.memory.resize(obstacles.size() + 1);
  result.placed.clear();
  result.topologies.clear();
  result.placed.push_back(
      atRest(stateOf(mesh), positions, fcl::Transform3d::Identity(), result.memory[0]));
  for (const Obstacle& obstacle : obstacles) {
    const MeshState& state = stateOf(*obstacle.mesh);
    result.placed.push_back(
        atRest(state, state.vertices, obstacle.tf, result.memory[result.placed.size()]));
    result.topologies.push_back(state.topology);
  }
}

/// Moves the mesh to positions, which are finite, among the obstacles where they were.
void TrustRegion::State::moveTo(const std::vector<fcl::Vector3d>& positions) {
  for (std::size_t i = 0; i < bodies.topologies.size(); ++i) {
    const MeshState& obstacle = stateOf(*obstacles[i].mesh);
    if (obstacle.topology != bodies.topologies[i])
      refuseMotion("obstacle " + std::to_string(i) +
                   " has other triangles than at the last `begin`; call `begin` again");
    bodies.placed[i + 1].findLinks(obstacle);
  }
  bodies.placed[0] =
      atRest(stateOf(mesh), positions, fcl::Transform3d::Identity(), bodies.memory[0]);
}

/// Moves the vertices by their shares.
TrustRegionReport TrustRegion::State::accept(const Points& wanted, std::size_t held_by_radius,
                                             Points& result) {
  TrustRegionReport report;
  report.held_by_radius = held_by_radius;
  for (std::size_t v = 0; v < accepted.size(); ++v) {
    const double share = region.shares()[v];
    report.held_back += share < 1;
    const auto at =
        share == 1 ? wanted[v] : fcl::Vector3d(accepted[v] + share * (wanted[v] - accepted[v]));
    accepted[v] = result[v] = at;
    region.positions()[v] = at;
  }
  return report;
}

TrustRegion::TrustRegion(const Mesh& mesh, const TrustRegionRequest& request) {
  requireRequest(request);
  state_ = std::make_unique<State>(mesh, request);
}

TrustRegion::~TrustRegion() = default;
TrustRegion::TrustRegion(TrustRegion&&) noexcept = default;

std::size_t TrustRegion::addObstacle(const Mesh& obstacle, const Transform& tf) {
  requireRigid(tf);
  state_->obstacles.push_back({&obstacle, tf});
  return state_->obstacles.size() - 1;
}

void TrustRegion::setTransform(std::size_t obstacle, const Transform& tf) {
  requireRigid(tf);
  state_->obstacles.at(obstacle).tf = tf;
}

void TrustRegion::begin(const Points& positions) {
  State& s = *state_;
  s.read(positions, s.start);
  s.begun = positions;
  s.place(s.start, s.next);
  s.region.search(s.next.placed);
  std::swap(s.bodies, s.next);
  s.is_stale = false;
  s.accepted.swap(s.begun);
  s.has_begun = true;
}

TrustRegionReport TrustRegion::truncate(const Points& proposed, Points& accepted) {
  State& s = *state_;
  if (!s.has_begun) refuseMotion("a trust region truncates after `begin`");
  s.read(proposed, s.proposed);
  accepted.resize(proposed.size());
  const bool searches = s.is_stale;
  if (searches) {
    toWorld(s.accepted.data(), s.accepted.size(), fcl::Transform3d::Identity(), s.start);
    s.moveTo(s.start);
    s.region.search(s.bodies.placed);
  }
  TrustRegionReport report = s.accept(proposed, s.region.truncate(s.proposed), accepted);
  report.has_searched = searches;
  s.is_stale = static_cast<double>(report.held_by_radius) >
               s.request.most_held * static_cast<double>(proposed.size());
  return report;
}

const typename TrustRegion::Points& TrustRegion::accepted() const { return state_->accepted; }

std::size_t TrustRegion::numPairs() const { return state_->region.numPairs(); }

}  // namespace adaptive_bvh
