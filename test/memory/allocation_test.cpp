// A steady-state frame allocates nothing: neither the update, whatever it refits, nor the query.
// Building a model allocates what it keeps.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/trust_region.h"
#include "support/allocations.h"
#include "support/closed_bodies.h"
#include "support/meshes.h"
#include "support/names.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace allocation_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::HierarchyStrategy;
using adaptive_bvh::RefitPolicy;

class Allocation : public testing::TestWithParam<FitnessCriterion> {};

TEST(AllocationCounter, Counts) {
  const long before = allocationCount();
  ::operator delete(::operator new(1));  // not elided, as an expression with `new` may be
  EXPECT_EQ(before + 1, allocationCount());
}

TEST_P(Allocation, NoneInASteadyStateFrame) {
  const TriangleMesh mesh = plate(10, 10);
  AdaptiveModel model(RefitPolicy::thesis(GetParam())), other;
  fillModel(mesh, model);
  fillModel(tube(6, 8), other);
  fcl::Transform3d tf = fcl::Transform3d::Identity(), above = tf;
  above.translation() = Eigen::Vector3d(0, 0.4, 0.5);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);

  long in_updates = 0, in_queries = 0;
  int refitted = 0;
  for (int frame = 0; frame < 30; ++frame) {
    const auto& positions = deformation.next();
    long before = allocationCount();
    if (frame % 3 == 0) {
      model.update(positions);
    } else if (frame % 3 == 1) {
      model.beginReplaceModel();
      model.replaceSubModel(positions);
      model.endReplaceModel();
    } else {
      model.beginReplaceModel();
      for (const auto& p : positions) model.replaceVertex(p);
      model.endReplaceModel();
    }
    if (frame > 1)
      in_updates += allocationCount() - before;  // FCL's calls have met their first frame
    refitted += model.lastUpdate().refitted();

    fcl::DistanceResultd distance;
    before = allocationCount();
    adaptive_bvh::distance(&model, tf, &other, above, fcl::DistanceRequestd(), distance);
    if (frame > 0) in_queries += allocationCount() - before;
    EXPECT_GT(distance.min_distance, 0);
  }
  EXPECT_EQ(0, in_updates);
  EXPECT_EQ(0, in_queries);
  EXPECT_EQ(GetParam() != FitnessCriterion::RefitNone, refitted > 0);
}

/// The same of a model with a mesh, and with updates of a few vertices. Scratch takes the room of
/// the largest search that there was: so the motion is gone through three times, and the last one
/// counts.
TEST(AllocationOfAModelWithAMesh, NoneInASteadyStateFrame) {
  const TriangleMesh mesh = plate(10, 10);
  AdaptiveModel model, other;
  fillModel(mesh, model);
  fillModel(tube(6, 8), other);
  adaptive_bvh::CoherentDistance pair(model.mesh(), other.mesh());
  fcl::Transform3d tf = fcl::Transform3d::Identity(), above = tf;
  above.translation() = Eigen::Vector3d(0, 0.4, 0.5);
  std::vector<std::vector<fcl::Vector3d>> frames;
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);
  for (int frame = 0; frame < 40; ++frame) frames.push_back(deformation.next());
  const std::vector<unsigned> some = {3, 40, 41};
  std::vector<fcl::Vector3d> to(3);

  long in_updates = 0, in_queries = 0;
  int refitted = 0;
  for (int frame = 0; frame < 120; ++frame) {
    const auto& positions = frames[std::size_t(frame) % frames.size()];
    for (std::size_t i = 0; i < some.size(); ++i) to[i] = positions[some[i]] * 1.01;
    const Eigen::Map<const Eigen::Matrix3Xd> columns(positions[0].data(), 3,
                                                     Eigen::Index(positions.size()));
    long before = allocationCount();
    if (frame % 2)
      model.update(positions);
    else
      model.update(columns);
    refitted += model.lastUpdate().refitted();
    model.update(some, to);
    if (frame >= 80) in_updates += allocationCount() - before;
    above.translation()[2] = 0.5 - 0.001 * (frame % 5);
    before = allocationCount();
    fcl::DistanceResultd recorded, of_meshes, coherent;
    adaptive_bvh::distance(&model, tf, &other, above, fcl::DistanceRequestd(), recorded);
    adaptive_bvh::distance(&model.mesh(), tf, &other.mesh(), above, fcl::DistanceRequestd(),
                           of_meshes);
    pair.distance(tf, above, fcl::DistanceRequestd(), coherent);
    if (frame >= 80) in_queries += allocationCount() - before;
    EXPECT_NEAR(recorded.min_distance, coherent.min_distance, 1e-12);
    EXPECT_NEAR(recorded.min_distance, of_meshes.min_distance, 1e-12);
  }
  EXPECT_EQ(0, in_updates);
  EXPECT_EQ(0, in_queries);
  EXPECT_GT(refitted, 0);
}

/// Queries of what is near write into results that are used again.
TEST(AllocationOfProximity, NoneInASteadyStateFrame) {
  const TriangleMesh mesh = plate(10, 10);
  DeformableMesh model(mesh), other(tube(6, 8));
  fcl::Transform3d tf = fcl::Transform3d::Identity(), above = tf;
  above.translation() = Eigen::Vector3d(0, 0.4, 0.3);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);
  std::vector<std::vector<fcl::Vector3d>> frames;
  for (int frame = 0; frame < 20; ++frame) frames.push_back(deformation.next());

  adaptive_bvh::CoherentProximity pair(model, other);
  adaptive_bvh::TrianglePairs pairs, own;
  adaptive_bvh::FeaturePairs features;
  std::vector<double> numbers;
  std::vector<adaptive_bvh::ClosestPoint> closest;
  std::vector<adaptive_bvh::RayHit> hits, first;
  std::vector<std::uint8_t> any;
  adaptive_bvh::FeaturePairDetails details;
  adaptive_bvh::FeaturePairDerivatives derivatives;
  adaptive_bvh::DistanceDerivatives of_distance;
  fcl::DistanceResultd nearest;
  nearest.b1 = nearest.b2 = 1;
  adaptive_bvh::ProximityRequest request;
  request.distance = 0.2;
  request.enable_distances = request.enable_nearest_points = true;
  long in_queries = 0;
  std::size_t found = 0;
  for (int frame = 0; frame < 60; ++frame) {
    model.update(frames[std::size_t(frame) % frames.size()]);
    const long before = allocationCount();
    pair.isNearer(tf, above, 0.05 * (frame % 3));
    isNearer(model, tf, other, above, 0.1);
    found += pairsWithin(model, tf, other, above, request, pairs);
    selfPairsWithin(model, request, own);
    featurePairsWithin(model, tf, other, above, 0.2, features);
    vertexDistances(model, tf, other, above, 0.5, numbers);
    closestPoints(model, frames[0], closest);
    rayHits(model, fcl::Vector3d(0.3, 0.4, 2), fcl::Vector3d(0, 0.01, -1), hits);
    firstHits(model, frames[0].data(), frames[1].data(), frames[0].size(), first);
    anyHits(model, frames[0].data(), frames[1].data(), frames[0].size(), any);
    featurePairDetails(model, tf, other, above, features, details);
    distanceDerivatives(model, tf, other, above, features, details, derivatives);
    distanceDerivatives(model, tf, other, above, nearest, of_distance);
    if (frame >= 40) in_queries += allocationCount() - before;
  }
  EXPECT_EQ(0, in_queries);
  EXPECT_GT(found, 0u);
}

/// Contacts of vertices with a closed mesh and with a shape; signed distances and winding numbers.
TEST(AllocationOfVertexContacts, NoneInASteadyStateFrame) {
  const TriangleMesh mesh = gridBall(24, 20);
  DeformableMesh model(mesh);
  const DeformableMesh other(gridBall(20, 16)), open(dome(20, 8));
  const fcl::Sphered sphere(1);
  fcl::Transform3d tf = fcl::Transform3d::Identity(), above = tf;
  above.translation() = Eigen::Vector3d(0, 0.4, 1.6);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);
  std::vector<std::vector<fcl::Vector3d>> frames;
  for (int frame = 0; frame < 20; ++frame) frames.push_back(deformation.next());
  adaptive_bvh::VertexContacts of_first, of_second, of_sphere;
  adaptive_bvh::DistanceDerivatives derivatives;
  std::vector<double> distances, numbers;
  std::vector<adaptive_bvh::ClosestFeature> features;
  long in_queries = 0;
  std::size_t found = 0;
  for (int frame = 0; frame < 60; ++frame) {
    model.update(frames[std::size_t(frame) % frames.size()]);
    const long before = allocationCount();
    found += vertexContacts(model, tf, other, above, 0.1, of_first, of_second);
    found += vertexContacts(model, tf, sphere, above, 0.1, of_sphere);
    distanceDerivatives(model, tf, other, above, of_first, derivatives);
    signedDistances(other, frames[0], distances);
    windingNumbers(model, frames[1], numbers);
    windingNumbers(open, frames[1], numbers);
    closestFeatures(model, frames[1], 0.1, features);
    if (frame >= 40) in_queries += allocationCount() - before;
  }
  EXPECT_EQ(0, in_queries);
  EXPECT_GT(found, 1000u);
}

/// Regions of two meshes, and their identity.
TEST(AllocationOfContactRegions, NoneInASteadyStateFrame) {
  const TriangleMesh mesh = gridBall(24, 20);
  DeformableMesh model(mesh);
  const DeformableMesh other(gridBall(20, 16));
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  fcl::Transform3d above = tf;
  above.translation() = Eigen::Vector3d(0, 0.4, 1.6);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);
  std::vector<std::vector<fcl::Vector3d>> frames;
  for (int frame = 0; frame < 20; ++frame) frames.push_back(deformation.next());
  adaptive_bvh::ContactRegions regions;
  adaptive_bvh::ContactTracker tracker;
  long in_queries = 0;
  std::size_t found = 0;
  for (int frame = 0; frame < 60; ++frame) {
    model.update(frames[std::size_t(frame) % frames.size()]);
    const long before = allocationCount();
    found += contactRegions(model, tf, other, above, regions);
    tracker.track(regions);
    if (frame >= 40) in_queries += allocationCount() - before;
  }
  EXPECT_EQ(0, in_queries);
  EXPECT_GE(found, 60u);
}

/// Continuous collision keeps its memory in the thread and in the results.
TEST(AllocationOfContinuousCollision, NoneInASteadyStateFrame) {
  using Motion = adaptive_bvh::Motion;
  const TriangleMesh mesh = plate(20, 20), hose = tube(6, 8);
  const DeformableMesh model(mesh), other(hose);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);
  std::vector<std::vector<fcl::Vector3d>> frames;
  for (int frame = 0; frame < 20; ++frame) frames.push_back(deformation.next());
  adaptive_bvh::FeaturePairs pairs, own;
  adaptive_bvh::ImpactTimes times;
  std::vector<double> of_first, of_second;
  long in_queries = 0;
  for (int frame = 0; frame < 57; ++frame) {
    const auto from = std::size_t(frame % 19);
    const Motion motion(model, frames[from], frames[from + 1]);
    const Motion still(other, hose.vertices, hose.vertices);
    const long before = allocationCount();
    candidates(motion, still, 0.1, pairs);
    timesOfImpact(motion, still, pairs, 0.1, times);
    earliestImpact(motion, still, 0.01);
    selfEarliestImpact(motion, 0.001, own);
    safeDisplacements(motion, still, 0.01, of_first, of_second);
    truncateMotion(motion, still, 0.01, of_first, of_second);
    if (frame >= 38) in_queries += allocationCount() - before;
  }
  EXPECT_EQ(0, in_queries);
  EXPECT_FALSE(own.edge_edge.empty());
}

/// Steps of a solver within a trust region, also where it searches again.
TEST(AllocationOfATrustRegion, NoneInASteadyStateFrame) {
  const TriangleMesh mesh = plate(20, 20), hose = tube(6, 8);
  const DeformableMesh model(mesh), other(hose);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 3);
  std::vector<std::vector<fcl::Vector3d>> frames;
  for (int frame = 0; frame < 10; ++frame) frames.push_back(deformation.next());
  adaptive_bvh::TrustRegionRequest request;
  request.radius = 0.01;
  adaptive_bvh::TrustRegion region(model, request);
  region.addObstacle(other);
  std::vector<fcl::Vector3d> accepted;
  long in_region = 0;
  std::size_t searches = 0;
  for (int round = 0; round < 6; ++round) {
    const long before = allocationCount();
    region.begin(frames[0]);
    for (const auto& proposed : frames)
      searches += region.truncate(proposed, accepted).has_searched;
    if (round >= 4) in_region += allocationCount() - before;
  }
  EXPECT_EQ(0, in_region);
  EXPECT_GT(searches, 6u);
}

/// The faces of a cube, two triangles each.
TriangleMesh box() {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.emplace_back(corner & 1, corner >> 1 & 1, corner >> 2);
  const std::size_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    mesh.triangles.emplace_back(f[0], f[1], f[2]);
    mesh.triangles.emplace_back(f[0], f[2], f[3]);
  }
  return mesh;
}

template <typename Model>
long allocationsOfBuild(const TriangleMesh& mesh, Model& model) {
  const long before = allocationCount();
  EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, model));
  return allocationCount() - before;
}

template <typename Model>
long allocationsOfRebuild(const TriangleMesh& mesh, Model& model) {
  const long before = allocationCount();
  model.beginReplaceModel();
  model.replaceSubModel(mesh.vertices);
  EXPECT_EQ(fcl::BVH_OK, model.endReplaceModel(false));
  return allocationCount() - before;
}

class AllocationOfABuild : public testing::TestWithParam<HierarchyStrategy> {};

// What is kept beside FCL's tree costs nine allocations, whatever the size of the model. A few
// dozen more for building it would be most of the time that a small one takes.
TEST_P(AllocationOfABuild, IsThatOfWhatIsKept) {
  for (const TriangleMesh& mesh : {box(), plate(4, 4)}) {
    PlainModel plain;
    AdaptiveModel first(GetParam()), model(GetParam());
    fillModel(mesh, first);  // the thread's own memory
    const long fcls = allocationsOfBuild(mesh, plain), ours = allocationsOfBuild(mesh, model);
    EXPECT_GE(fcls, 4) << "vertices, triangles, nodes and their order";
    EXPECT_LE(ours, fcls + 9);
    allocationsOfRebuild(mesh, model);  // room for a frame
    EXPECT_LE(allocationsOfRebuild(mesh, model), 2 + 4) << "in a copy of FCL's four arrays, so "
                                                           "that one that fails changes nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(Strategies, AllocationOfABuild,
                         testing::Values(HierarchyStrategy::TopDown, HierarchyStrategy::BottomUp));

INSTANTIATE_TEST_SUITE_P(Criteria, Allocation,
                         testing::Values(FitnessCriterion::ABOrBC, FitnessCriterion::A,
                                         FitnessCriterion::RefitAll, FitnessCriterion::RefitNone));

}  // namespace allocation_test
}  // namespace adaptive_bvh_test
