// The library against itself: without any one of its shortcuts (base/shortcut.h) every query has
// the same answer, and each decision that may need exact arithmetic does so here. Built with
// ADAPTIVE_BVH_SHORTCUT_TESTS only.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/contact_set.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "base/shortcut.h"
#include "support/closed_bodies.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace shortcuts_test {

using namespace adaptive_bvh;
using Mesh = TriangleMesh;
using Body = DeformableMesh;
using Point = fcl::Vector3d;
using Points = std::vector<Point>;

/// Does without a shortcut while it lives.
class Without {
 public:
  explicit Without(Shortcut shortcut) : shortcut_(shortcut) { take(shortcut_, false); }
  ~Without() { take(shortcut_, true); }
  Without(const Without&) = delete;
  Without& operator=(const Without&) = delete;

 private:
  const Shortcut shortcut_;
};

/// What the queries of one input answer.
struct Answers {
  std::vector<std::string> whole_names, real_names;
  std::vector<std::vector<long>> whole;  ///< must be equal
  std::vector<std::vector<double>>
      lengths;  ///< must be equal up to rounding, in sizes of the input

  void addWhole(const char* name, std::vector<long> numbers) {
    whole_names.push_back(name);
    whole.push_back(std::move(numbers));
  }
  void addReal(const char* name, std::vector<double> numbers) {
    real_names.push_back(name);
    lengths.push_back(std::move(numbers));
  }
};

template <typename Pairs>
std::vector<long> sortedPairs(const Pairs& pairs) {
  std::vector<std::pair<long, long>> sorted;
  for (const auto& pair : pairs) sorted.emplace_back(long(pair.first), long(pair.second));
  std::sort(sorted.begin(), sorted.end());
  std::vector<long> numbers;
  for (const auto& pair : sorted) {
    numbers.push_back(pair.first);
    numbers.push_back(pair.second);
  }
  return numbers;
}
std::vector<long> sortedPairs(const NumberedPairs& held) {
  std::vector<FeaturePair> pairs;
  for (unsigned n = 0; n < held.pairs.size(); ++n)
    if (held.contains(n)) pairs.push_back(held.pairs[n]);
  return sortedPairs(pairs);
}
std::vector<long> sortedContacts(const fcl::CollisionResultd& result) {
  std::vector<std::pair<long, long>> pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    pairs.emplace_back(long(result.getContact(i).b1), long(result.getContact(i).b2));
  return sortedPairs(pairs);
}

/// Two bodies, and how they move and are asked.
struct Input {
  Mesh first, second;
  fcl::Transform3d tf1, tf2;
  Points moved;   ///< of the first
  Points points;  ///< and rays from them
  Points directions;
  double size;   ///< largest coordinate in the world
  double limit;  ///< a distance to ask for
  bool is_closed;
};

class Asked {
 public:
  explicit Asked(const Input& input) : in_(input), first_(input.first), second_(input.second) {
    first_.setThreads(3);
    second_.setThreads(3);
  }

  Answers answers() {
    coherent();
    contactSets();
    pairs();
    contacts();
    pointsAndRays();
    motion();
    if (in_.is_closed) closed();
    return std::move(answers_);
  }

 private:
  /// A distance, and three in turn by one object; with a step of the first mesh before the last.
  void coherent() {
    fcl::DistanceRequestd request(true);
    std::vector<double> lengths;
    std::vector<long> nearer;
    CoherentDistance distance(first_, second_);
    CoherentProximity proximity(first_, second_);
    for (int step = 0; step < 3; ++step) {
      fcl::DistanceResultd alone, kept;
      lengths.push_back(
          adaptive_bvh::distance(&first_, in_.tf1, &second_, in_.tf2, request, alone));
      lengths.push_back(distance.distance(in_.tf1, in_.tf2, request, kept));
      // At a tie with the limit rounding decides.
      const bool is_tie = std::fabs(lengths.back() - in_.limit) < 1e-12 * in_.size;
      if (!is_tie) nearer.push_back(proximity.isNearer(in_.tf1, in_.tf2, in_.limit));
      if (step == 1) first_.update(in_.moved);
    }
    answers_.addReal("distances", lengths);
    answers_.addWhole("isNearer", nearer);
  }
  /// Sets through the step of the first mesh and back, and a little beside both.
  void contactSets() {
    for (const ContactElements elements : {ContactElements::Triangles, ContactElements::Features}) {
      ContactSetRequest request;
      request.distance = in_.limit;
      request.elements = elements;
      Body moving(in_.first);
      moving.setThreads(3);
      ContactSet own(moving, request), both(moving, second_, request);
      for (const double part : {0., 1e-3, 1., 1., 0.}) {
        Points now = in_.first.vertices;
        for (std::size_t v = 0; v < now.size(); ++v) now[v] += part * (in_.moved[v] - now[v]);
        moving.update(now);
        own.update();
        both.update(in_.tf1, in_.tf2);
        for (const ContactSet* set : {&own, &both}) {
          answers_.addWhole("ContactSet, triangles", sortedPairs(set->triangles()));
          for (const FeatureKind kind :
               {FeatureKind::VertexFace, FeatureKind::FaceVertex, FeatureKind::EdgeEdge})
            answers_.addWhole("ContactSet, features", sortedPairs(set->features(kind)));
        }
      }
    }
  }
  void pairs() {
    ProximityRequest request;
    request.distance = in_.limit;
    TrianglePairs found;
    pairsWithin(first_, in_.tf1, second_, in_.tf2, request, found);
    answers_.addWhole("pairsWithin of two", sortedPairs(found.triangles));
    selfPairsWithin(first_, request, found);
    answers_.addWhole("pairsWithin of one", sortedPairs(found.triangles));
    FeaturePairs features;
    featurePairsWithin(first_, in_.tf1, second_, in_.tf2, in_.limit, features);
    answers_.addWhole("vertex and face", sortedPairs(features.vertex_face));
    answers_.addWhole("face and vertex", sortedPairs(features.face_vertex));
    answers_.addWhole("edges", sortedPairs(features.edge_edge));
    selfFeaturePairsWithin(first_, in_.limit, features);
    answers_.addWhole("own vertex and face", sortedPairs(features.vertex_face));
    answers_.addWhole("own edges", sortedPairs(features.edge_edge));
  }
  void contacts() {
    constexpr std::size_t kAll = 1000000;
    fcl::CollisionResultd result, any, own;
    adaptive_bvh::collide(&first_, in_.tf1, &second_, in_.tf2, fcl::CollisionRequestd(kAll, true),
                          result);
    answers_.addWhole("collide", sortedContacts(result));
    adaptive_bvh::collide(&first_, in_.tf1, &second_, in_.tf2, fcl::CollisionRequestd(1), any);
    answers_.addWhole("collide, one", {long(any.numContacts())});
    for (const auto filter : {NeighbourFilter::SharedVertex, NeighbourFilter::SharedEdge,
                              NeighbourFilter::BeyondShared}) {
      own.clear();
      selfCollide(first_, {filter}, fcl::CollisionRequestd(kAll, true), own);
      answers_.addWhole("selfCollide", sortedContacts(own));
    }
  }
  void pointsAndRays() {
    std::vector<ClosestPoint> nearest;
    closestPoints(first_, in_.points, nearest);
    std::vector<RayHit> hits;
    firstHits(first_, in_.points.data(), in_.directions.data(), in_.points.size(), hits);
    std::vector<long> triangles, hit;
    std::vector<double> distances, turns;
    for (std::size_t i = 0; i < in_.points.size(); ++i) {
      triangles.push_back(nearest[i].triangle);
      distances.push_back(nearest[i].distance);
      std::vector<RayHit> all;
      rayHits(first_, in_.points[i], in_.directions[i], all);
      hit.push_back(long(all.size()));
      // Hits whose t are equal up to rounding may change places.
      hit.push_back(hits[i].triangle >= 0);
      hit.push_back(anyHit(first_, in_.points[i], in_.directions[i]));
    }
    windingNumbers(first_, in_.points, turns);
    for (double& turn : turns) turn *= in_.size;
    answers_.addWhole("nearest triangles", triangles);
    answers_.addReal("nearest distances", distances);
    answers_.addWhole("hits", hit);
    answers_.addReal("winding numbers", turns);
  }
  void motion() {
    const Motion first(first_, in_.first.vertices, in_.moved, in_.tf1, in_.tf1),
        second(second_, in_.second.vertices, in_.second.vertices, in_.tf2, in_.tf2);
    FeaturePairs features;
    candidates(first, second, 0, features);
    answers_.addWhole("candidates", sortedPairs(features.edge_edge));
    std::vector<double> times;
    for (const double separation : {0., in_.limit / 8}) {
      times.push_back(std::min(2., earliestImpact(first, second, separation).time) * in_.size);
      times.push_back(std::min(2., selfEarliestImpact(first, separation).time) * in_.size);
    }
    answers_.addReal("times of impact", times);
    std::vector<double> safe;
    selfSafeDisplacements(first, 0, safe);
    answers_.addReal("safe displacements", safe);
    selfTruncateMotion(first, 0, safe);
    answers_.addReal("shares of ways", safe);
  }
  void closed() {
    std::vector<double> distances, volumes;
    signedDistances(first_, in_.points, distances);
    answers_.addReal("signed distances", distances);
    ContactRegions regions;
    contactRegions(first_, in_.tf1, second_, in_.tf2, regions);
    std::sort(regions.volumes.begin(), regions.volumes.end());
    double sum = 0;
    for (const double volume : regions.volumes) sum += volume;
    answers_.addWhole("regions", {long(regions.size()), long(regions.curve_points.size())});
    // 1e-12 of the size's cube, at least.
    answers_.addReal("volume", {sum / (in_.size * in_.size)});
    VertexContacts contacts;
    vertexContacts(first_, in_.tf1, second_, in_.tf2, in_.limit, contacts);
    answers_.addWhole("vertex contacts",
                      std::vector<long>(contacts.triangles.begin(), contacts.triangles.end()));
    answers_.addReal("vertex distances", contacts.distances);
  }

  const Input& in_;
  Body first_, second_;
  Answers answers_;
};

/// Small whole numbers: triangles share planes, edges lie along each other, distances are ties.
Mesh latticeSoup(RandomGeometry& random, int triangles) {
  Mesh mesh;
  for (int i = 0; i < 3 * triangles; ++i)
    mesh.vertices.emplace_back(random.below(5), random.below(5), random.below(5));
  for (int i = 0; i < triangles; ++i)
    mesh.triangles.emplace_back(std::size_t(3 * i), std::size_t(3 * i + 1), std::size_t(3 * i + 2));
  return mesh;
}
/// A sheet on whole numbers that is folded back on itself, so that halves coincide.
Mesh foldedSheet(RandomGeometry& random) {
  Mesh mesh = plate(8, 4, 8, 4);
  const double fold = random.below(8), up = random.below(2);
  for (Point& p : mesh.vertices)
    if (p[0] > fold) p = Point(2 * fold - p[0], p[1], up);
  return mesh;
}

Input makeInput(RandomGeometry& random) {
  Input in;
  const int kind = random.below(5);
  const bool on_lattice = kind == 1 || kind == 2 || kind == 4;
  in.is_closed = kind == 0 || kind == 4;
  const auto make = [&]() -> Mesh {
    switch (kind) {
      case 0: return closedBody(random);
      case 1: return latticeSoup(random, 60);
      case 2: return foldedSheet(random);
      case 3: return soup(80, random.engine());
      default: return latticeBox(2 + random.below(3));
    }
  };
  in.first = make();
  in.second = make();
  const auto pose = [&]() -> fcl::Transform3d {
    fcl::Transform3d tf = random.pose(1.5);
    if (!on_lattice) return tf;
    tf.linear() = Eigen::AngleAxisd(M_PI / 2 * random.below(4), Point::Unit(random.below(3)))
                      .toRotationMatrix();
    tf.linear() = tf.linear().array().round().matrix().eval();
    tf.translation() = Point(random.below(7) - 3, random.below(7) - 3, random.below(7) - 3);
    return tf;
  };
  in.tf1 = pose();
  in.tf2 = random.oneIn(3) ? in.tf1 : pose();
  if (random.oneIn(8)) in.tf2.translation() += Point(random.size(1, 6), 0, 0);
  double step = 0.1;
  if (kind == 0 && random.oneIn(2)) {  // two lentils that nearly coincide
    for (Mesh* mesh : {&in.first, &in.second}) {
      *mesh = gridBall(9, 7);
      for (Point& p : mesh->vertices) p[2] *= 1e-6;
    }
    in.tf2 = in.tf1 * Eigen::AngleAxisd(1e-7, random.direction());
    step = 1e-8;
  }
  in.moved = in.first.vertices;
  for (Point& p : in.moved) {
    if (on_lattice)
      p[random.below(3)] += random.below(3) - 1;
    else
      p += step * random.point();
  }
  for (int i = 0; i < 24; ++i) {
    Point x = 2 * random.point(), along = random.direction();
    if (on_lattice) {
      x = Point(random.below(11), random.below(11), random.below(11)) / 2;
      do along = Point(random.below(5) - 2, random.below(5) - 2, random.below(5) - 2);
      while (along == Point::Zero());
    }
    if (random.oneIn(8))
      x = in.first.vertices[std::size_t(random.below(int(in.first.vertices.size())))];
    in.points.push_back(x);
    in.directions.push_back(along);
  }
  in.limit = on_lattice ? random.below(3) : random.uniform(0, 0.3);
  in.size = 0;
  for (const auto* tf : {&in.tf1, &in.tf2}) in.size += tf->translation().lpNorm<1>();
  for (const Mesh* mesh : {&in.first, &in.second})
    for (const Point& p : mesh->vertices) in.size = std::max(in.size, 10 + p.lpNorm<1>());
  return in;
}

void expectEqual(const Answers& with, const Answers& without, double size) {
  ASSERT_EQ(with.whole_names, without.whole_names);
  ASSERT_EQ(with.real_names, without.real_names);
  for (std::size_t i = 0; i < with.whole.size(); ++i)
    EXPECT_EQ(with.whole[i], without.whole[i]) << with.whole_names[i];
  for (std::size_t i = 0; i < with.lengths.size(); ++i) {
    ASSERT_EQ(with.lengths[i].size(), without.lengths[i].size()) << with.real_names[i];
    for (std::size_t k = 0; k < with.lengths[i].size(); ++k)
      EXPECT_NEAR(with.lengths[i][k], without.lengths[i][k], 1e-12 * size)
          << with.real_names[i] << ' ' << k;
  }
}

/// Queries have the same answers without any one shortcut.
TEST(Shortcuts, DoNotChangeAnswers) {
  RandomGeometry random(54003);
  for (int trial = 0; trial < manySteps(24); ++trial) {
    const Input input = makeInput(random);
    const Answers with = Asked(input).answers();
    for (int i = 0; i < int(Shortcut::kCount); ++i) {
      const auto shortcut = Shortcut(i);
      SCOPED_TRACE("trial " + std::to_string(trial) + " without " + nameOf(shortcut));
      const Without without(shortcut);
      expectEqual(with, Asked(input).answers(), input.size + input.size);
      if (testing::Test::HasFailure()) return;
    }
  }
}

/// Updates write the same bits with four and eight volumes at once, and on one thread and several.
TEST(Shortcuts, DoNotChangeVolumes) {
  using Model = AdaptiveBVHModel<fcl::RSSd>;
  const auto volumes = [](const Mesh& mesh) -> std::vector<fcl::RSSd> {
    Model model;
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, model));
    model.setThreads(3);
    Deformation deformation(mesh, Deformation::Kind::Jerky, 7);
    for (int step = 0; step < 6; ++step) model.update(deformation.next());
    std::vector<fcl::RSSd> all;
    for (int i = 0; i < model.getNumBVs(); ++i) all.push_back(model.getBV(i).bv);
    return all;
  };
  const Mesh mesh = tube(24, 40);
  const std::vector<fcl::RSSd> with = volumes(mesh);
  for (const Shortcut shortcut : {Shortcut::Avx2, Shortcut::Threads}) {
    const Without without(shortcut);
    const std::vector<fcl::RSSd> other = volumes(mesh);
    ASSERT_EQ(with.size(), other.size());
    for (std::size_t i = 0; i < with.size(); ++i) {
      EXPECT_EQ(with[i].axis, other[i].axis) << nameOf(shortcut);
      EXPECT_EQ(with[i].To, other[i].To) << nameOf(shortcut);
      EXPECT_EQ(with[i].r, other[i].r) << nameOf(shortcut);
      EXPECT_EQ(with[i].l[0], other[i].l[0]) << nameOf(shortcut);
      EXPECT_EQ(with[i].l[1], other[i].l[1]) << nameOf(shortcut);
    }
  }
}

/// Lattices make every decision use exact arithmetic, and without rounded predicates each does so
/// far more often.
TEST(Shortcuts, EveryExactDecisionIsTaken) {
  const auto counted = [](bool is_rounded) -> std::vector<long> {
    std::vector<long> counts;
    for (int d = 0; d < int(ExactDecision::kCount); ++d)
      counts.push_back(exactDecisions(ExactDecision(d)));
    take(Shortcut::RoundedPredicates, is_rounded);
    RandomGeometry random(54004);
    for (int trial = 0; trial < 24; ++trial) Asked(makeInput(random)).answers();
    take(Shortcut::RoundedPredicates, true);
    for (int d = 0; d < int(ExactDecision::kCount); ++d)
      counts[std::size_t(d)] = exactDecisions(ExactDecision(d)) - counts[std::size_t(d)];
    return counts;
  };
  const std::vector<long> usual = counted(true), forced = counted(false);
  for (int d = 0; d < int(ExactDecision::kCount); ++d) {
    const char* name = nameOf(ExactDecision(d));
    const auto i = static_cast<std::size_t>(d);
    std::printf("%-18s %8ld %8ld\n", name, usual[i], forced[i]);
    EXPECT_GT(usual[i], 0) << name;
    // The angle of a boundary edge has no rounded form near 180 degrees.
    if (ExactDecision(d) == ExactDecision::BoundaryAngle) continue;
    EXPECT_GT(forced[i], usual[i]) << name;
  }
}

}  // namespace shortcuts_test
}  // namespace adaptive_bvh_test
