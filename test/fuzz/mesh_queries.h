#pragma once

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/contact_set.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/motion_clearance.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "adaptive_bvh/self_collision.h"
#include "adaptive_bvh/trust_region.h"
#include "fuzz/bytes.h"
#include "support/brute_force.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {

using adaptive_bvh::DeformableMesh;

/// In quadruple precision; of triangles that are smaller by `margin` around their middles.
inline double distanceOf(const BodyView& a, int i, const BodyView& b, int j,
                         const fcl::Transform3d& tf, double margin = 0) {
  const auto triangle = [&](const BodyView& model, int t, const fcl::Transform3d& place) {
    quad::Triangle corners;
    const fcl::Triangle& v = model.tri_indices[t];
    const Point middle = (model.vertices[v[0]] + model.vertices[v[1]] + model.vertices[v[2]]) / 3;
    for (std::size_t k = 0; k < 3; ++k) {
      const Point& x = model.vertices[v[int(k)]];
      corners[k] = quad::of(place * Point(x + margin * (middle - x)));
    }
    return corners;
  };
  return static_cast<double>(
      quad::distance(triangle(a, i, fcl::Transform3d::Identity()), triangle(b, j, tf)));
}

/// What touches is reported, and only that, up to rounding. Of a pair within one model the
/// smaller index comes first.
inline void checkContacts(const BodyView& a, const BodyView& b, const fcl::Transform3d& tf,
                          const std::set<std::pair<int, int>>& touching,
                          const fcl::CollisionResultd& contacts) {
  const bool own = a.geometry == b.geometry;
  std::set<std::pair<int, int>> reported;
  for (std::size_t c = 0; c < contacts.numContacts(); ++c) {
    const int i = int(contacts.getContact(c).b1), j = int(contacts.getContact(c).b2);
    REQUIRE(!own || i < j);
    REQUIRE(reported.emplace(i, j).second);
    REQUIRE(distanceOf(a, i, b, j, tf) < 1e-9);
  }
  for (const auto& [i, j] : touching) {
    if (reported.count({i, j}) || (own && i >= j)) continue;
    REQUIRE(!own && distanceOf(a, i, b, j, tf, 1e-9) > 0);  // barely, as placed
  }
}

/// The pairs of triangles of all contacts.
inline std::set<std::pair<int, int>> pairsOf(const fcl::CollisionResultd& result) {
  std::set<std::pair<int, int>> pairs;
  for (std::size_t c = 0; c < result.numContacts(); ++c)
    pairs.emplace(int(result.getContact(c).b1), int(result.getContact(c).b2));
  return pairs;
}
inline void checkFields(const fcl::CollisionResultd& result) {
  for (std::size_t c = 0; c < result.numContacts(); ++c) {
    const fcl::Contactd& contact = result.getContact(c);
    REQUIRE(contact.pos.allFinite() && contact.normal.allFinite());
    REQUIRE(std::isfinite(contact.penetration_depth));
  }
}

inline bool arePlain(const Points& points) {
  return std::all_of(points.begin(), points.end(), [](const Point& p) {
    return isPlain(p[0]) && isPlain(p[1]) && isPlain(p[2]);
  });
}

/// Queries of a mesh, each judged by brute force where coordinates are plain. One object serves one
/// mesh, whatever happens to it in between.
class MeshQueries {
 public:
  explicit MeshQueries(const DeformableMesh& mesh)
      : mesh_(mesh),
        coherent_(mesh, obstacle()),
        near_obstacle_(mesh, obstacle(), setRequest(adaptive_bvh::ContactElements::Triangles)),
        own_features_(mesh, setRequest(adaptive_bvh::ContactElements::Features)) {}

  /// A body that does not change, to ask distances to.
  static const DeformableMesh& obstacle() {
    static const DeformableMesh mesh(tube(3, 2));
    return mesh;
  }

  void distance(Bytes& in, const fcl::Transform3d& tf) {
    const fcl::Transform3d still = fcl::Transform3d::Identity();
    const bool is_kept = in.oneIn(2);
    fcl::DistanceResultd result;
    const fcl::DistanceRequestd request(true);
    if (is_kept)
      coherent_.distance(still, tf, request, result);
    else
      adaptive_bvh::distance(&mesh_, still, &obstacle(), tf, request, result);
    derivative(result, tf);
    if (!isPlainFrame()) return;
    const BruteForce brute_force(mesh_, still, obstacle(), tf);
    REQUIRE(std::abs(result.min_distance - brute_force.distance()) < 1e-9);
    REQUIRE(brute_force.findError(result, still, 1e-9).empty());
  }

  /// The gradients of a distance add up to opposite directions; to zero where meshes touch.
  void derivative(const fcl::DistanceResultd& nearest, const fcl::Transform3d& tf) const {
    if (nearest.b1 < 0) return;  // none was nearer than infinity
    adaptive_bvh::DistanceDerivatives g;
    distanceDerivatives(mesh_, fcl::Transform3d::Identity(), obstacle(), tf, nearest, g);
    Point sum = Point::Zero(), of_obstacle = sum;
    for (const Point& x : g.first.gradients) sum += x;
    for (const Point& x : g.second.gradients) of_obstacle += x;
    REQUIRE((sum + tf.linear() * of_obstacle).norm() < 1e-9);
    REQUIRE(sum.norm() < 1 + 1e-9 && (sum.norm() > 1 - 1e-9 || !(nearest.min_distance > 1e-9)));
  }

  /// Contacts have every field, are listed once by selfCollide, and do not depend on the
  /// requested fields.
  void contacts(const fcl::Transform3d& tf) {
    const fcl::Transform3d still = fcl::Transform3d::Identity();
    fcl::CollisionResultd plain, full, own, own_full;
    const fcl::CollisionRequestd all(100000), with_contact(100000, true);
    adaptive_bvh::collide(&mesh_, still, &obstacle(), tf, all, plain);
    selfCollide(mesh_, {adaptive_bvh::NeighbourFilter::None}, all, own);
    if (!isPlainFrame()) return;
    adaptive_bvh::collide(&mesh_, still, &obstacle(), tf, with_contact, full);
    selfCollide(mesh_, {adaptive_bvh::NeighbourFilter::None}, with_contact, own_full);
    REQUIRE(pairsOf(plain) == pairsOf(full));
    REQUIRE(pairsOf(own) == pairsOf(own_full));
    REQUIRE(own_full.numContacts() == pairsOf(own_full).size());
    checkFields(full);
    checkFields(own_full);
    checkContacts(mesh_, obstacle(), tf, BruteForce(mesh_, still, obstacle(), tf).contacts(),
                  plain);
    checkContacts(mesh_, mesh_, still, BruteForce(mesh_, still, mesh_, still).contacts(), own);
  }

  /// A coherent pair is queried far away once, and then near, step by step.
  void excursion(Bytes& in) {
    const double ways[] = {1e3, 1e9, 1e12, 1e13, 1e17, 1e20, 1e200, 1e300};
    fcl::Transform3d tf = pose(in);
    const double way = ways[in.below(8)], step = in.oneIn(2) ? 1e-5 : 1e-2;
    if (!isPlainFrame()) return;
    const auto ask = [&](const fcl::Transform3d& at) {
      fcl::DistanceResultd result;
      return coherent_.distance(fcl::Transform3d::Identity(), at, fcl::DistanceRequestd(), result);
    };
    ask(tf);
    fcl::Transform3d far = tf;
    far.translation()[0] = way;
    ask(far);
    for (int i = 0; i < 12; ++i) {
      tf.translation()[i % 3] += step;
      const double expected =
          BruteForce(mesh_, fcl::Transform3d::Identity(), obstacle(), tf).distance();
      REQUIRE(std::abs(ask(tf) - expected) < 1e-9);
    }
  }

  /// What is within a distance is what has such a distance, of all pairs; points agree with it.
  void proximity(Bytes& in) {
    const fcl::Transform3d tf = pose(in), still = fcl::Transform3d::Identity();
    const double d = 0.125 * in.below(16);
    const Point x = in.points(1)[0];
    if (!isPlainFrame()) return;
    adaptive_bvh::ProximityRequest request;
    request.distance = std::numeric_limits<double>::infinity();
    request.enable_distances = true;
    adaptive_bvh::TrianglePairs all, near;
    REQUIRE(pairsWithin(mesh_, still, obstacle(), tf, request, all) ==
            std::size_t(numTriangles(mesh_)) * std::size_t(numTriangles(obstacle())));
    request.distance = d;
    pairsWithin(mesh_, still, obstacle(), tf, request, near);
    const auto within = [&](double limit) {
      return std::size_t(std::count_if(all.distances.begin(), all.distances.end(),
                                       [&](double distance) { return distance <= limit; }));
    };
    REQUIRE(within(d - 1e-9) <= near.size() && near.size() <= within(d + 1e-9));
    // The same from within, or an end.
    adaptive_bvh::TrianglePairs outer, inner;
    const bool ends = in.oneIn(4);
    adaptive_bvh::ProximityRequest asking = request;
    asking.ignored.triangles.test = [&](unsigned, unsigned) {
      if (ends) throw std::runtime_error("ended");
      pairsWithin(mesh_, still, obstacle(), tf, request, inner);
      REQUIRE(inner.triangles == near.triangles);
      return false;
    };
    try {
      REQUIRE(pairsWithin(mesh_, still, obstacle(), tf, asking, outer) == near.size());
      REQUIRE(near.size() == 0 || !ends);
    } catch (const std::runtime_error&) {
      REQUIRE(ends);
    }
    const bool is_nearer = isNearer(mesh_, still, obstacle(), tf, d);
    REQUIRE(is_nearer == (near.size() > 0) || within(d - 1e-9) != within(d + 1e-9));
    if (!x.allFinite() || x.cwiseAbs().maxCoeff() > 1e75) return;  // as far as a mesh may reach
    const auto closest = adaptive_bvh::closestPoint(mesh_, x);
    REQUIRE(std::abs((closest.point - x).norm() - closest.distance) <= 1e-9 * (1 + x.norm()));
    nearestTriangle(x, closest, -60 * int(8 * d));
    if (!(closest.distance > 1e-6)) return;
    const auto hit = adaptive_bvh::firstHit(mesh_, x, Point(closest.point - x));
    REQUIRE(!(hit.t < 1 - 1e-6));  // nothing is nearer
  }

  /// The nearest triangle does not depend on what was asked before, nor on the unit of length.
  void nearestTriangle(const Point& x, const adaptive_bvh::ClosestPoint& closest,
                       int exponent) const {
    if (!isPlain(x[0]) || !isPlain(x[1]) || !isPlain(x[2])) return;
    std::vector<adaptive_bvh::ClosestPoint> batch;
    closestPoints(mesh_, {-x, Point(3 * x), x}, batch);
    REQUIRE(batch[2].triangle == closest.triangle);
    const double unit = std::ldexp(1., exponent);
    Points positions = mesh_.vertices();
    for (Point& p : positions) p *= unit;
    DeformableMesh small = mesh_;
    small.update(positions);
    const auto of_small = adaptive_bvh::closestPoint(small, Point(x * unit));
    REQUIRE(of_small.triangle == closest.triangle);
    REQUIRE(std::abs(of_small.distance / unit - closest.distance) <= 1e-9);
  }

  /// A scene of the mesh, a ball and a box: what it says of these two is that of their formulas,
  /// and its calls agree.
  void scene(Bytes& in) {
    const Point middle = in.point(), side = in.point().cwiseAbs(), along = in.point();
    const double radius = std::abs(in.coordinate());
    if (!isPlainFrame() || !arePlain({middle, side, along, Point::Constant(radius)})) return;
    const double refused = std::ldexp(1., -204);  // shapes that are smaller
    if (!(side.minCoeff() > refused) || !(radius > refused) || along.isZero(0)) return;
    const fcl::Sphered ball(radius);
    const fcl::Boxd box(side);
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = middle;
    adaptive_bvh::Scene scene;
    const auto of_box = scene.add(box), of_ball = scene.add(ball, tf);
    scene.ignore(of_box, scene.add(mesh_));
    scene.update();
    const double gap = (middle.cwiseAbs() - side / 2).cwiseMax(Point::Zero()).norm() - radius;
    const auto found = scene.nearest(of_box);
    REQUIRE(found.bodies.second == of_ball);
    REQUIRE(std::abs(found.distance - std::max(gap, 0.)) < 1e-12);
    adaptive_bvh::SceneCollisions touching;
    scene.collide(adaptive_bvh::SceneCollisionRequest(), touching);
    REQUIRE(scene.isNearer(0) == !touching.pairs.empty());
    REQUIRE((scene.distance().distance <= 0) == !touching.pairs.empty());
    REQUIRE(scene.nearestPoint(middle).distance <= radius + 1e-12);
    std::vector<adaptive_bvh::SceneRayHit> hits;
    scene.firstHits(&middle, &along, 1, hits);
    REQUIRE(hits[0].exists() && hits[0].t <= radius / along.norm() + 1e-12);
    if (gap > 1e-9) {
      tf.translation() = Point::Zero();
      scene.beginStep();
      scene.setTransform(of_ball, tf);
      scene.update();
      REQUIRE(scene.largestSafeStep() < 1);
    }
  }

  /// A ray, most often with components that are 0 or -0: every triangle by the signs of volumes, in
  /// quadruple precision. Where that has no digit left, the verdict is open.
  void ray(Bytes& in) {
    const Point origin = in.points(1)[0];
    Point direction = in.points(1)[0];
    for (int k = 0; k < 3; ++k)
      if (in.oneIn(2)) direction[k] = in.oneIn(2) ? -0. : 0.;
    if (!isPlainFrame() || direction.isZero(0)) return;
    if (!isPlain(origin[0]) || !isPlain(origin[1]) || !isPlain(origin[2]) ||
        !isPlain(direction[0]) || !isPlain(direction[1]) || !isPlain(direction[2]))
      return;
    const auto hit = adaptive_bvh::firstHit(mesh_, origin, direction);
    std::vector<adaptive_bvh::RayHit> hits;
    adaptive_bvh::rayHits(mesh_, origin, direction, hits);
    REQUIRE((hit.triangle >= 0) == !hits.empty());
    if (!hits.empty()) REQUIRE(hits[0].triangle == hit.triangle && hits[0].t == hit.t);
    REQUIRE(hit.t >= 0 && !std::signbit(hit.t));
    const quad::Point from = quad::of(origin), along = quad::of(direction);
    for (int t = 0; t < numTriangles(mesh_); ++t) {
      const auto corner = [&](int k) {
        return quad::of(mesh_.vertices()[mesh_.triangles()[std::size_t(t)][k]]) - from;
      };
      const quad::Point p[3] = {corner(0), corner(1), corner(2)};
      quad::Real sides[3], sum = 0;
      bool is_open = false;
      for (std::size_t k = 0; k < 3; ++k) {
        sides[k] = quad::dot(along, quad::cross(p[k], p[(k + 1) % 3]));
        is_open = is_open || quad::absolute(sides[k]) < 1e-25;
        sum += sides[k];
      }
      const quad::Real volume = quad::dot(p[0], quad::cross(p[1], p[2]));
      if (is_open || quad::absolute(volume) < 1e-25) continue;
      const bool meets = (sides[0] > 0) == (sides[1] > 0) && (sides[1] > 0) == (sides[2] > 0) &&
                         (sum > 0) == (volume > 0);
      if (meets) REQUIRE(double(volume / sum) >= hit.t * (1 - 1e-9));
      const bool is_hit = std::any_of(hits.begin(), hits.end(),
                                      [&](const auto& found) { return found.triangle == t; });
      REQUIRE(meets == is_hit);
    }
  }

  /// The regions of two tetrahedra of any coordinates, which may face inward, in either order: as
  /// large together, no larger than the smaller body, and with opposite normals.
  static void regions(Bytes& in) {
    const Points corners[] = {in.points(4), in.points(4)};
    const fcl::Transform3d tf = in.oneIn(2) ? pose(in) : fcl::Transform3d::Identity(),
                           still = fcl::Transform3d::Identity();
    if (!isUsable(corners[0]) || !isUsable(corners[1])) return;
    const std::vector<fcl::Triangle> faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const DeformableMesh first(corners[0], faces), second(corners[1], faces);
    adaptive_bvh::ContactRegions found, swapped;
    contactRegions(first, still, second, tf, found);
    contactRegions(second, tf, first, still, swapped);
    if (!arePlain(corners[0]) || !arePlain(corners[1])) return;
    double volume = 0, same_volume = 0, smaller = std::numeric_limits<double>::infinity();
    for (const double part : found.volumes) volume += part;
    for (const double part : swapped.volumes) same_volume += part;
    for (const Points& p : corners)
      smaller =
          std::min(smaller, std::abs((p[1] - p[0]).dot((p[2] - p[0]).cross(p[3] - p[0])) / 6));
    REQUIRE(std::abs(volume - same_volume) < 1e-8 && volume > -1e-8 && volume < smaller + 1e-8);
    if (volume < 1e-3 || found.size() != 1 || swapped.size() != 1) return;
    const double area = found.first.areas[0] + found.second.areas[0];
    REQUIRE((found.normals[0] + swapped.normals[0]).norm() < 1e-6 * area ||
            found.normals[0].isZero(0) || swapped.normals[0].isZero(0));
  }

  /// Sets that go through all updates of the mesh hold the pairs of new queries.
  void contactSets(Bytes& in) {
    const fcl::Transform3d still = fcl::Transform3d::Identity();
    if (in.oneIn(2)) obstacle_tf_ = pose(in);
    adaptive_bvh::ProximityRequest request;
    request.distance = kNear;
    adaptive_bvh::TrianglePairs triangles;
    REQUIRE(pairsWithin(mesh_, still, obstacle(), obstacle_tf_, request, triangles) ==
            near_obstacle_.update(still, obstacle_tf_));
    REQUIRE(areHeld(triangles.triangles, near_obstacle_.triangles()));
    adaptive_bvh::FeaturePairs features;
    REQUIRE(selfFeaturePairsWithin(mesh_, kNear, features) == own_features_.update());
    using adaptive_bvh::FeatureKind;
    REQUIRE(areHeld(features.vertex_face, own_features_.features(FeatureKind::VertexFace)));
    REQUIRE(areHeld(features.edge_edge, own_features_.features(FeatureKind::EdgeEdge)));
    adaptive_bvh::Renumbering moved;
    if (in.oneIn(4)) own_features_.compact(moved);
  }

  /// Bounds of the least distance on a way of the obstacle: a tolerance apart, and no farther than
  /// it is at both ends.
  void vertexDistances(Bytes& in) const {
    const fcl::Transform3d still = fcl::Transform3d::Identity(), start = pose(in), end = pose(in);
    const auto path =
        in.oneIn(2) ? adaptive_bvh::FramePath::Screw : adaptive_bvh::FramePath::Straight;
    if (!isPlainFrame()) return;
    constexpr double kTolerance = 1e-3;
    const auto least =
        leastDistance(adaptive_bvh::Motion::rigid(mesh_, still, still),
                      adaptive_bvh::Motion::rigid(obstacle(), start, end, path), kTolerance);
    REQUIRE(least.exists() && least.lower >= 0 && least.time >= 0 && least.time <= 1);
    REQUIRE(least.lower <= least.upper && least.upper <= least.lower + kTolerance);
    for (const fcl::Transform3d& tf : {start, end})
      REQUIRE(least.lower <= BruteForce(mesh_, still, obstacle(), tf).distance() + 1e-9);
  }

  /// Between this frame and another: refused, or the earliest impact is that of the earliest pair,
  /// and no vertex that stays within its bounds brings anything together.
  void trustRegion(const Points& start, const Points& end, double separation, double radius) {
    adaptive_bvh::TrustRegionRequest request;
    request.radius = radius;
    request.distance = separation;
    try {
      adaptive_bvh::TrustRegion region(mesh_, request);
      region.addObstacle(obstacle());
      region.begin(start);
      Points accepted;
      REQUIRE(radius > 0);
      const auto report = region.truncate(end, accepted);
      REQUIRE(report.held_by_radius <= report.held_back && report.held_back <= start.size());
      double largest = radius;
      for (const Point& x : start) largest = std::max(largest, x.lpNorm<1>());
      for (std::size_t v = 0; v < start.size(); ++v)
        REQUIRE((accepted[v] - start[v]).norm() <= radius + 1e-14 * largest);
    } catch (const std::invalid_argument&) {
      REQUIRE(radius == 0 || !isUsable(end));
    }
  }
  void continuous(Bytes& in) {
    using Motion = adaptive_bvh::Motion;
    const Points& start = mesh_.vertices();
    const Points end = in.points(in.oneIn(8) ? in.below(20) : numVertices(mesh_));
    const fcl::Transform3d still = fcl::Transform3d::Identity(),
                           end_tf = in.oneIn(2) ? pose(in) : still;
    const double separation = in.oneIn(4) ? in.coordinate() : in.below(4) / 16.;
    adaptive_bvh::FeaturePairs pairs, again;
    adaptive_bvh::ImpactTimes times;
    std::vector<double> safe, of_obstacle;
    try {
      const Motion motion(mesh_, start, end, still, end_tf);
      const Points& of_rest = obstacle().vertices();
      const Motion rest(obstacle(), of_rest, of_rest);
      const adaptive_bvh::Impact first = selfEarliestImpact(motion, separation);
      REQUIRE(isUsable(end) && separation >= 0 && std::isfinite(separation));
      const adaptive_bvh::Impact listed = selfEarliestImpact(motion, separation, pairs);
      selfCandidates(motion, separation, again);
      REQUIRE(pairs.vertex_face == again.vertex_face && pairs.edge_edge == again.edge_edge);
      selfTimesOfImpact(motion, pairs, separation, times);
      double earliest = adaptive_bvh::Impact::kNever;
      for (const auto* of : {&times.vertex_face, &times.edge_edge})
        for (const double time : *of) earliest = std::min(earliest, time);
      safeDisplacements(motion, rest, separation, safe, of_obstacle);
      REQUIRE(safe.size() == start.size());
      for (const double length : safe) REQUIRE(length >= 0);
      truncateMotion(motion, rest, separation, safe, of_obstacle);
      REQUIRE(safe.size() == start.size());
      for (const double share : safe) REQUIRE(share >= 0 && share <= 1);
      for (const double share : of_obstacle) REQUIRE(share == 1);
      trustRegion(start, end, separation, in.below(8) / 8.);
      REQUIRE(largestSafeStep(motion, rest, separation) >= 0);
      if (!isPlainFrame() || !arePlain(end)) return;
      REQUIRE(first.time == earliest && listed.time == earliest);
      if (!first.exists()) return;
      REQUIRE(first.kind == listed.kind && first.pair == listed.pair);
      REQUIRE(selfTimeOfImpact(motion, first.kind, first.pair, separation) == first.time);
    } catch (const std::invalid_argument&) {
      REQUIRE(!isUsable(end) || end.size() != start.size() ||
              !(separation >= 0 && std::isfinite(separation)));
    }
  }

 private:
  static constexpr double kNear = 0.375;  // distance of the sets

  static adaptive_bvh::ContactSetRequest setRequest(adaptive_bvh::ContactElements elements) {
    adaptive_bvh::ContactSetRequest request;
    request.distance = kNear;
    request.elements = elements;
    return request;
  }
  static bool areHeld(std::vector<adaptive_bvh::FeaturePair> found,
                      const adaptive_bvh::NumberedPairs& held) {
    std::vector<adaptive_bvh::FeaturePair> pairs;
    for (unsigned n = 0; n < held.pairs.size(); ++n)
      if (held.contains(n)) pairs.push_back(held.pairs[n]);
    std::sort(pairs.begin(), pairs.end());
    std::sort(found.begin(), found.end());
    return pairs == found;
  }
  bool isPlainFrame() const { return arePlain(mesh_.vertices()); }

  const DeformableMesh& mesh_;
  adaptive_bvh::CoherentDistance coherent_;
  adaptive_bvh::ContactSet near_obstacle_, own_features_;
  fcl::Transform3d obstacle_tf_ = fcl::Transform3d::Identity();  ///< of the sets
};

}  // namespace adaptive_bvh_test
