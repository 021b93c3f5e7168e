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

template <typename S>
void requireRequest(const TrustRegionRequest<S>& request) {
  requireSeparation(static_cast<double>(request.separation));
  if (!(request.radius > 0) || !std::isfinite(request.radius))
    refuseMotion("the radius of a trust region is " + textOf(double(request.radius)) +
                 "; a positive length is needed");
  if (!(request.most_held >= 0)) refuseMotion("most_held is negative or not a number");
}

}  // namespace

template <typename S>
struct TrustRegion<S>::State {
  struct Obstacle {
    const Mesh* mesh;
    Transform tf;
  };

  State(const Mesh& moving, const TrustRegionRequest<S>& limits)
      : mesh(moving),
        request(limits),
        region(static_cast<double>(limits.radius), static_cast<double>(limits.separation),
               static_cast<double>(std::numeric_limits<S>::epsilon()) / 2) {}

  void read(const Points& positions, std::vector<fcl::Vector3d>& result) const;
  void search(const std::vector<fcl::Vector3d>& positions);
  TrustRegionReport accept(const Points& wanted, std::size_t held_by_radius, Points& result);

  const Mesh& mesh;
  const TrustRegionRequest<S> request;
  NearRegion region;
  std::vector<Obstacle> obstacles;
  Points accepted, begun;                      ///< the second is memory of `begin`
  std::vector<fcl::Vector3d> proposed, start;  ///< in double precision
  bool has_begun = false;
  bool is_stale = false;                     ///< whether to search before the next iterate
  std::vector<PlacedMotion::Memory> memory;  ///< of a search: of the mesh, then of the obstacles
  std::vector<PlacedMotion> bodies;
};

/// Throws std::invalid_argument unless there is a finite position for each vertex.
template <typename S>
void TrustRegion<S>::State::read(const Points& positions,
                                 std::vector<fcl::Vector3d>& result) const {
  if (positions.size() != mesh.vertices().size())
    refuseMotion(std::to_string(positions.size()) + " positions for " +
                 std::to_string(mesh.vertices().size()) + " vertices");
  for (const fcl::Vector3<S>& x : positions)
    if (!(x.template lpNorm<1>() <= 6 * rounding::largestCoordinate<S>()))
      refuseMotion("a position is not finite, or too large");
  toWorld(positions.data(), positions.size(), fcl::Transform3d::Identity(), result);
}

/// Finds the pairs around positions of the mesh, which are finite.
template <typename S>
void TrustRegion<S>::State::search(const std::vector<fcl::Vector3d>& positions) {
  memory.resize(obstacles.size() + 1);
  bodies.clear();
  const auto add = [&](const Mesh& body, const std::vector<fcl::Vector3d>& x, const Transform& tf) {
    bodies.emplace_back(stateOf(body), x.data(), x.data(), tf.template cast<double>(),
                        tf.template cast<double>(), memory[bodies.size()]);
  };
  add(mesh, positions, Transform::Identity());
  for (const Obstacle& obstacle : obstacles)
    add(*obstacle.mesh, stateOf(*obstacle.mesh).vertices, obstacle.tf);
  region.search(bodies);
  is_stale = false;
}

/// Moves the vertices by their shares.
template <typename S>
TrustRegionReport TrustRegion<S>::State::accept(const Points& wanted, std::size_t held_by_radius,
                                                Points& result) {
  TrustRegionReport report;
  report.held_by_radius = held_by_radius;
  for (std::size_t v = 0; v < accepted.size(); ++v) {
    const double share = region.shares()[v];
    report.held_back += share < 1;
    const auto at =
        share == 1
            ? wanted[v]
            : fcl::Vector3<S>(accepted[v] + static_cast<S>(share) * (wanted[v] - accepted[v]));
    accepted[v] = result[v] = at;
    region.positions()[v] = at.template cast<double>();
  }
  return report;
}

template <typename S>
TrustRegion<S>::TrustRegion(const Mesh& mesh, const TrustRegionRequest<S>& request) {
  requireRequest(request);
  state_ = std::make_unique<State>(mesh, request);
}
template <typename S>
TrustRegion<S>::~TrustRegion() = default;
template <typename S>
TrustRegion<S>::TrustRegion(TrustRegion&&) noexcept = default;

template <typename S>
std::size_t TrustRegion<S>::addObstacle(const Mesh& obstacle, const Transform& tf) {
  requireRigid(tf);
  state_->obstacles.push_back({&obstacle, tf});
  return state_->obstacles.size() - 1;
}

template <typename S>
void TrustRegion<S>::setTransform(std::size_t obstacle, const Transform& tf) {
  requireRigid(tf);
  state_->obstacles.at(obstacle).tf = tf;
}

template <typename S>
void TrustRegion<S>::begin(const Points& positions) {
  State& s = *state_;
  s.read(positions, s.start);
  s.begun = positions;
  s.search(s.start);
  s.accepted.swap(s.begun);
  s.has_begun = true;
}

template <typename S>
TrustRegionReport TrustRegion<S>::truncate(const Points& proposed, Points& accepted) {
  State& s = *state_;
  if (!s.has_begun) refuseMotion("a trust region truncates after `begin`");
  s.read(proposed, s.proposed);
  accepted.resize(proposed.size());
  const bool searches = s.is_stale;
  if (searches) {
    toWorld(s.accepted.data(), s.accepted.size(), fcl::Transform3d::Identity(), s.start);
    s.search(s.start);
  }
  TrustRegionReport report = s.accept(proposed, s.region.truncate(s.proposed), accepted);
  report.has_searched = searches;
  s.is_stale = static_cast<double>(report.held_by_radius) >
               s.request.most_held * static_cast<double>(proposed.size());
  return report;
}

template <typename S>
const typename TrustRegion<S>::Points& TrustRegion<S>::accepted() const {
  return state_->accepted;
}

template <typename S>
std::size_t TrustRegion<S>::numPairs() const {
  return state_->region.numPairs();
}

template class TrustRegion<float>;
template class TrustRegion<double>;

}  // namespace adaptive_bvh
