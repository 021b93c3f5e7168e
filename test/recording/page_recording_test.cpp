// recording.h: what a page holds is what the meshes and models held, within the precision that it
// states.
#include "adaptive_bvh/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <nlohmann/json.hpp>

#include "adaptive_bvh/hierarchy.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/shape_mesh.h"
#include "recording/body.h"
#include "support/fcl_float.h"
#include "support/full_disk.h"
#include "support/meshes.h"
#include "support/recorded_page.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace page_recording_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::AdaptiveBVHModeld;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FrameResults;
using adaptive_bvh::Recording;
using adaptive_bvh::RecordingOptions;
using adaptive_bvh::TriangleMesh;
using Page = RecordedPage;
using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kVolumeNumbers = 16;

void expectPositions(const Page& page, std::size_t frame, std::size_t body,
                     const std::vector<fcl::Vector3d>& positions) {
  const json block = page.bodyIn(frame, body, "positions");
  const std::vector<fcl::Vector3d> points = page.points(block);
  ASSERT_EQ(points.size(), positions.size());
  for (std::size_t v = 0; v < points.size(); ++v)
    for (int k = 0; k < 3; ++k) {
      const double size = block["size"][static_cast<std::size_t>(k)].get<double>();
      const double low = block["low"][static_cast<std::size_t>(k)].get<double>();
      const double rounding = 1e-14 * (std::abs(points[v][k]) + std::abs(low));
      ASSERT_NEAR(points[v][k], double(positions[v][k]), size * 0.5 / 65535 + rounding)
          << "frame " << frame << ", vertex " << v;
    }
}
template <typename BV>
void expectPositions(const Page& page, std::size_t frame, std::size_t body,
                     const AdaptiveBVHModel<BV>& model) {
  expectPositions(page, frame, body,
                  std::vector<fcl::Vector3d>(model.vertices, model.vertices + model.num_vertices));
}

/// A recorded volume against the node's, as far as single precision goes.
void expectVolume(const float* volume, const fcl::Vector3d& low, const fcl::RSSd& rss) {
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(volume[k], double(rss.To[k]) - low[k], 1e-6);
    EXPECT_NEAR(volume[3 + k], rss.axis(k, 0), 1e-6);
    EXPECT_NEAR(volume[6 + k], rss.axis(k, 1), 1e-6);
  }
  EXPECT_EQ(volume[9], float(rss.l[0]));
  EXPECT_EQ(volume[10], float(rss.l[1]));
  EXPECT_EQ(volume[11], float(rss.r));
}
void expectVolume(const float* volume, const fcl::Vector3d& low, const fcl::OBBRSSd& both) {
  const fcl::OBBd& box = both.obb;
  const double tolerance = 1e-6;  // 100 away from the origin
  for (int k = 0; k < 3; ++k) {
    const double corner = double(box.To[k]) - double(box.axis(k, 0)) * double(box.extent[0]) -
                          double(box.axis(k, 1)) * double(box.extent[1]);
    EXPECT_NEAR(volume[k], corner - low[k], tolerance);
    EXPECT_NEAR(volume[6 + k], box.axis(k, 1), 1e-6);
  }
  EXPECT_EQ(volume[9], float(2 * box.extent[0]));
  EXPECT_EQ(volume[11], float(box.extent[2]));
}

/// The recorded volumes are the nodes down to `depth`, and refitted ones below.
template <typename BV>
void expectVolumes(const Page& page, std::size_t frame, std::size_t body,
                   const AdaptiveBVHModel<BV>& model, int depth) {
  const json where = page.run["frames"][frame]["bodies"][body]["volumes"];
  const std::size_t count = where[1];
  const auto numbers = page.numbers<float>(where[0], kVolumeNumbers * count);
  const json block = page.bodyIn(frame, body, "positions");
  const fcl::Vector3d low(block["low"][0], block["low"][1], block["low"][2]);
  const std::vector<int> refits = model.refittedNodes();
  std::size_t next = 0, marked = 0;
  const std::function<void(int, int)> expectBelow = [&](int node, int at) {
    ASSERT_LT(next, count);
    const float* const volume = &numbers[kVolumeNumbers * next++];
    expectVolume(volume, low, model.getBV(node).bv);
    EXPECT_EQ(volume[13], float(at));
    EXPECT_EQ(volume[14] != 0, model.getBV(node).isLeaf());
    const bool refitted = std::binary_search(refits.begin(), refits.end(), node);
    EXPECT_EQ(volume[15] != 0, refitted);
    marked += refitted;
    EXPECT_GE(volume[12], 0);
    if (refitted) {
      EXPECT_NEAR(volume[12], 0, 1e-6) << "just fitted";
    }
    if (at == depth || model.getBV(node).isLeaf()) return;
    expectBelow(model.getBV(node).leftChild(), at + 1);
    expectBelow(model.getBV(node).rightChild(), at + 1);
  };
  expectBelow(0, 0);
  EXPECT_EQ(count - next, std::min<std::size_t>(refits.size() - marked, 100));
  for (std::size_t i = next; i < count; ++i) {
    EXPECT_EQ(numbers[kVolumeNumbers * i + 13], float(depth + 1));
    EXPECT_EQ(numbers[kVolumeNumbers * i + 15], 1);
  }
}

template <typename Call>
std::string messageOf(Call&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

template <typename BV>
class PageOf : public testing::Test {};
using Volumes = testing::Types<fcl::RSSd, fcl::OBBRSSd>;
TYPED_TEST_SUITE(PageOf, Volumes);

/// Positions are those of the model within half a step, volumes those of its nodes.
TYPED_TEST(PageOf, HoldsPositionsAndVolumes) {
  constexpr int kDepth = 4, kFrames = 6;
  AdaptiveBVHModel<TypeParam> model;
  fillModel(wavingSheet(17, 0), model);
  RecordingOptions options;
  options.volume_depth = kDepth;
  std::vector<AdaptiveBVHModel<TypeParam>> copies;
  copies.reserve(kFrames);
  Recording recording(options);
  recording.add(model, fcl::Transform3d::Identity(), "sheet");
  std::size_t refits = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame > 0) model.update(wavingSheet(17, 0.3 * frame).vertices);
    copies.push_back(model);
    refits += model.refittedNodes().size();
    recording.frame();
  }
  EXPECT_GT(refits, 0u) << "else this tests little";
  const Page page(recording);
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    expectPositions(page, frame, 0, copies[frame]);
    expectVolumes(page, frame, 0, copies[frame], kDepth);
  }
}

class PageOfMesh : public testing::Test {};
/// Of a DeformableMesh: positions and triangles, how far it moved, and no volumes.
TEST_F(PageOfMesh, HoldsPositionsAndNoVolumes) {
  constexpr int kFrames = 4;
  const TriangleMesh rest = wavingSheet(9, 0);
  DeformableMesh mesh(rest);
  Recording recording;
  recording.add(mesh, fcl::Transform3d(fcl::Transform3d::Identity()), "sheet");
  std::vector<double> displacements;
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame > 0) mesh.update(wavingSheet(9, 0.3 * frame).vertices);
    displacements.push_back(mesh.lastUpdate().largest_displacement);
    recording.frame();
  }
  recording.frame();  // not updated
  const Page page(recording);
  const json body = page.run["bodies"][0];
  EXPECT_EQ(body["volumes"], "none");
  ASSERT_EQ(body["indexBits"], 16);
  const auto corners = page.numbers<std::uint16_t>(body["indices"], 3 * rest.triangles.size());
  for (std::size_t t = 0; t < rest.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_EQ(corners[3 * t + k], rest.triangles[t][static_cast<int>(k)]);
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    expectPositions(page, frame, 0, wavingSheet(9, 0.3 * double(frame)).vertices);
    const json now = page.run["frames"][frame]["bodies"][0];
    EXPECT_EQ(now["volumes"][1], 0);
    ASSERT_EQ(now.contains("update"), frame > 0);
    if (frame == 0) continue;
    EXPECT_EQ(now["update"]["displacement"], displacements[frame]);
    EXPECT_EQ(now["update"]["nodes"], 0);
  }
  EXPECT_FALSE(page.run["frames"][kFrames]["bodies"][0].contains("update"));
  EXPECT_FALSE(page.run["frames"][kFrames]["bodies"][0].contains("positions")) << "as before";
}

TEST(PageRecording, TrianglesAreThoseOfTheModel) {
  for (const int n : {3, 260}) {  // indices of 16 and of 32 bits
    const TriangleMesh mesh = wavingSheet(n, 0);
    Recording recording;
    recording.add(mesh, fcl::Transform3d::Identity(), "mesh");
    recording.frame();
    const Page page(recording);
    const json body = page.run["bodies"][0];
    EXPECT_EQ(body["triangles"], mesh.triangles.size());
    EXPECT_EQ(body["indexBits"], mesh.vertices.size() > 65535 ? 32 : 16);
    std::vector<std::uint32_t> corners;
    if (body["indexBits"] == 32) {
      corners = page.numbers<std::uint32_t>(body["indices"], 3 * mesh.triangles.size());
    } else {
      const auto small = page.numbers<std::uint16_t>(body["indices"], 3 * mesh.triangles.size());
      corners.assign(small.begin(), small.end());
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(corners[3 * t + k], mesh.triangles[t][static_cast<int>(k)]);
  }
}

/// A body that does not change takes its positions and volumes once.
TEST(PageRecording, ABodyAtRestIsStoredOnce) {
  AdaptiveBVHModeld model;
  fillModel(wavingSheet(20, 0), model);
  Recording recording;
  recording.add(model, fcl::Transform3d::Identity(), "sheet");
  recording.frame();
  const std::size_t one = Page(recording).data.size();
  for (int frame = 0; frame < 9; ++frame) recording.frame();
  EXPECT_EQ(Page(recording).data.size(), one);
}

/// Numbers come back bit by bit; points within the precision of their own box.
TEST(PageRecording, ResultsAreThoseGiven) {
  AdaptiveBVHModeld a, b;
  fillModel(wavingSheet(8, 0), a);
  fillModel(wavingSheet(8, 2), b);
  fcl::Transform3d below = fcl::Transform3d::Identity();
  below.translation().z() = -0.1;
  Recording recording;
  const int of_a = recording.add(a, fcl::Transform3d::Identity(), "a");
  recording.add(b, below, "b");

  fcl::DistanceResultd nearest;
  fcl::Transform3d far = below;
  far.translation().z() = -3;
  adaptive_bvh::distance(&a, fcl::Transform3d::Identity(), &b, far, fcl::DistanceRequestd(true),
                         nearest);
  fcl::CollisionResultd contacts;
  adaptive_bvh::collide(&a, fcl::Transform3d::Identity(), &b, below,
                        fcl::CollisionRequestd(1000, true), contacts);
  ASSERT_GT(contacts.numContacts(), 3u);
  std::vector<double> distances(static_cast<std::size_t>(a.num_vertices), 0.25);
  distances[7] = -0.125;
  FrameResults results(nearest);
  results.add(contacts).addVertexDistances(of_a, distances).addTimes(1. / 3, 2e-7);
  results.note = "</script> \"quoted\" \\ \n";
  recording.frame(results);
  recording.place(of_a, far);
  recording.frame();
  const std::size_t bytes = recording.bytes();
  recording.frame(FrameResults().addVertexDistances(of_a, distances));
  EXPECT_LT(recording.bytes() - bytes, 2 * distances.size()) << "equal distances are kept once";
  distances[7] = 0;
  recording.frame(FrameResults().addVertexDistances(of_a, distances));

  const Page page(recording);
  const json frame = page.run["frames"][0];
  EXPECT_EQ(frame["distance"], nearest.min_distance);
  EXPECT_EQ(frame["updateMs"], 1. / 3);
  EXPECT_EQ(frame["queryMs"], 2e-7);
  EXPECT_EQ(frame["note"], results.note);
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_EQ(frame["nearest"][0][k], nearest.nearest_points[k / 3][static_cast<int>(k % 3)]);
  EXPECT_EQ(frame["contactCount"], contacts.numContacts());
  const std::vector<fcl::Vector3d> points = page.points(frame["contacts"]);
  ASSERT_EQ(points.size(), contacts.numContacts());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT((points[i] - contacts.getContact(i).pos).norm(), 2e-5);
  const json distances_of_a = frame["bodies"][0]["vertexDistances"];
  EXPECT_EQ(distances_of_a["low"], -0.125);
  EXPECT_EQ(distances_of_a["high"], 0.25);
  const auto steps = page.numbers<std::uint16_t>(distances_of_a["at"], distances.size());
  for (std::size_t v = 0; v < steps.size(); ++v) EXPECT_EQ(steps[v], v == 7 ? 0 : 65535);
  EXPECT_EQ(page.run["frames"][2]["bodies"][0]["vertexDistances"], distances_of_a);
  EXPECT_EQ(page.run["frames"][3]["bodies"][0]["vertexDistances"]["low"], 0);
  EXPECT_EQ(frame["bodies"][1]["pose"][11], -0.1);
  EXPECT_EQ(page.run["frames"][1]["bodies"][0]["pose"][11], -3);
  EXPECT_FALSE(page.run["frames"][1]["bodies"][1].contains("pose")) << "as before";
  EXPECT_FALSE(page.run["frames"][1].contains("distance"));
}

/// Numbers by label, the time of a frame, and the range of colours.
TEST(PageRecording, SeriesAndTimesAreThoseGiven) {
  const DeformableMesh body(wavingSheet(4, 0));
  RecordingOptions options;
  options.time_unit = "ms";
  options.vertex_distance_range = std::array<double, 2>{-1, 0.5};
  Recording recording(options);
  recording.add(body, fcl::Transform3d(fcl::Transform3d::Identity()), "sheet");
  FrameResults results;
  results.addToSeries("energy, J", 1. / 3).addToSeries("<pairs>", 7).addToSeries("gone", kNaN);
  results.time = 0.125;
  recording.frame(results.addToSeries("<pairs>", 8));
  recording.frame();
  const Page page(recording);
  EXPECT_EQ(page.run["timeUnit"], "ms");
  EXPECT_EQ(page.run["vertexDistanceRange"], json({-1, 0.5}));
  EXPECT_EQ(page.run["frames"][0]["series"], json({{"energy, J", 1. / 3}, {"<pairs>", 8}}));
  EXPECT_EQ(page.run["frames"][0]["time"], 0.125);
  EXPECT_FALSE(page.run["frames"][1].contains("series"));
  EXPECT_FALSE(page.run["frames"][1].contains("time"));
}

/// Arrows and segments are those given, within the precision of the box around them; pairs that are
/// not finite are left out.
TEST(PageRecording, ArrowsAndSegmentsAreThoseGiven) {
  const TriangleMesh mesh = wavingSheet(4, 0);
  DeformableMesh body(mesh);
  Recording recording;
  recording.add(body, fcl::Transform3d::Identity(), "sheet");
  const std::vector<fcl::Vector3d> origins = {{1, 2, 3}, {4, 5, 6}, {7, 8, kNaN}},
                                   forces = {{0, 0, 1}, {0, -2, 0.5}, {1, 1, 1}};
  FrameResults results;
  results.addArrows("force", origins, forces, 0.25).addArrows("normal", forces, origins);
  results.addSegments("pair", {{fcl::Vector3d(0, 1, 2), fcl::Vector3d(3, 4, 6)}});
  recording.frame(results);
  recording.frame();
  const Page page(recording);
  const json arrows = page.run["frames"][0]["arrows"], segments = page.run["frames"][0]["segments"];
  ASSERT_EQ(arrows.size(), 2u);
  EXPECT_EQ(arrows[0]["label"], "force");
  EXPECT_EQ(arrows[0]["scale"], 0.25);
  EXPECT_EQ(arrows[1]["scale"], 0);
  const auto from = page.points(arrows[0]["blocks"][0]),
             along = page.points(arrows[0]["blocks"][1]);
  ASSERT_EQ(from.size(), 2u);
  ASSERT_EQ(along.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT((from[i] - origins[i].cast<double>()).norm(), 1e-4);
    EXPECT_LT((along[i] - forces[i].cast<double>()).norm(), 1e-4);
  }
  EXPECT_EQ(segments[0]["label"], "pair");
  EXPECT_EQ(page.points(segments[0]["blocks"][1])[0], fcl::Vector3d(3, 4, 6));
  EXPECT_FALSE(page.run["frames"][1].contains("arrows"));

  results.arrows[0].vectors.pop_back();
  EXPECT_ANY_THROW(recording.frame(results));
  results.arrows[0].vectors.push_back(fcl::Vector3d::Zero());
  results.arrows[0].scale = -1;
  EXPECT_ANY_THROW(recording.frame(results));
  EXPECT_EQ(recording.frames(), 2) << "what is refused is not recorded";
}

/// Contact regions colour the triangles that they have, by the identity of a tracker.
TEST(PageRecording, PatchesAreThoseOfTheRegions) {
  const TriangleMesh box = adaptive_bvh::shapeMesh(fcl::Boxd(1, 1, 1));
  const DeformableMesh first(box), second(box);
  fcl::Transform3d aside = fcl::Transform3d::Identity();
  aside.translation() = fcl::Vector3d(0.7, 0.1, 0.2);
  adaptive_bvh::ContactRegions regions;
  ASSERT_EQ(adaptive_bvh::contactRegions(first, fcl::Transform3d(fcl::Transform3d::Identity()),
                                         second, aside, regions),
            1u);
  Recording recording;
  recording.add(first, fcl::Transform3d(fcl::Transform3d::Identity()), "first");
  const int body = recording.add(second, aside, "second");
  FrameResults results;
  results.colourTriangles(body, regions.second, {77});
  EXPECT_THROW(results.colourTriangles(body, regions.second, {1, 2}), std::invalid_argument);
  recording.frame(results);
  const Page page(recording);
  EXPECT_FALSE(page.run["frames"][0]["bodies"][0].contains("patches"));
  const json block = page.run["frames"][0]["bodies"][1]["patches"];
  const std::size_t count = block["count"];
  ASSERT_GT(count, 0u);
  const auto numbers = page.numbers<std::uint32_t>(block["at"], 2 * count);
  const std::vector<unsigned>& triangles = regions.second.triangles;
  EXPECT_EQ(std::vector<unsigned>(numbers.begin(), numbers.begin() + long(count)), triangles);
  for (std::size_t i = count; i < 2 * count; ++i) EXPECT_EQ(numbers[i], 77u);

  results.patches[0].triangles[0] = 12;
  EXPECT_ANY_THROW(recording.frame(results)) << "there is no triangle 12";
  results.patches[0].triangles.pop_back();
  EXPECT_ANY_THROW(recording.frame(results)) << "one patch too many";
  EXPECT_EQ(recording.frames(), 1);
}

TEST(PageRecording, ShapesAreBodies) {
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  Recording recording;
  recording.add(fcl::Sphered(2), origin, "ball");  // copied
  recording.add(fcl::Halfspaced(fcl::Vector3d::UnitZ(), -1), origin, "ground");
  recording.frame();
  recording.frame();
  const Page page(recording);
  EXPECT_EQ(page.run["bodies"][0]["unbounded"], false);
  EXPECT_EQ(page.run["bodies"][1]["unbounded"], true);
  expectPositions(page, 1, 0, adaptive_bvh::shapeMesh(fcl::Sphered(2)).vertices);
  EXPECT_FALSE(page.run["frames"][1]["bodies"][0].contains("positions"));
  const fcl::BVHModel<fcl::RSSd> plain;
  EXPECT_THROW(recording.add(plain, origin, "plain"), std::invalid_argument);
}

/// Bodies come and go between frames, and keep their numbers.
TEST(PageRecording, BodiesAppearAndVanish) {
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  DeformableMesh late(wavingSheet(3, 1));
  Recording recording;
  recording.add(fcl::Sphered(2), origin, "ball");
  recording.frame();
  EXPECT_EQ(recording.add(late, origin, "late"), 1);
  recording.frame();
  recording.remove(0);
  FrameResults results;
  results.addVertexDistances(0, std::vector<double>(3, 1.));
  EXPECT_EQ(messageOf([&] { recording.frame(results); }),
            "Recording::frame: distances of vertices of 'ball', which was removed");
  recording.frame();
  EXPECT_EQ(messageOf([&] { recording.place(0, origin); }), "Recording::place: 'ball' was removed");
  const Page page(recording);
  EXPECT_EQ(page.run["frames"][0]["bodies"].size(), 1u);
  EXPECT_EQ(page.run["frames"][1]["bodies"].size(), 2u);
  EXPECT_TRUE(page.run["frames"][2]["bodies"][0].is_null());
  expectPositions(page, 2, 1, late.vertices());
}

/// A scene is recorded with its transforms, names, and the bodies that it has at each frame.
TEST(PageRecording, FollowsAScene) {
  fcl::Transform3d up = fcl::Transform3d::Identity();
  up.translation().z() = 3;
  DeformableMesh cloth(wavingSheet(5, 0));
  adaptive_bvh::Scene scene;
  const auto of_cloth = scene.add(cloth);
  const auto of_ball = scene.add(std::make_shared<fcl::Sphered>(0.5), up);
  Recording recording;
  recording.follow(scene);
  EXPECT_THROW(recording.follow(scene), std::logic_error);
  EXPECT_EQ(recording.bodyOf(of_ball), 1);
  recording.frame();
  cloth.update(wavingSheet(5, 0.4).vertices);
  up.translation().x() = -2;
  scene.setTransform(of_ball, up);
  const auto of_box = scene.add(std::make_shared<fcl::Boxd>(1, 2, 3), up);
  EXPECT_EQ(recording.bodyOf(of_box), 2) << "before a frame has it";
  recording.frame();
  scene.remove(of_ball);
  scene.update();
  recording.frame(FrameResults().add(scene.nearest(of_cloth)));
  EXPECT_ANY_THROW(recording.bodyOf(of_ball));
  const Page page(recording);
  EXPECT_EQ(page.run["bodies"][1]["name"], "body " + std::to_string(of_ball));
  EXPECT_EQ(page.run["frames"][0]["bodies"][1]["pose"][11], 3);
  EXPECT_EQ(page.run["frames"][1]["bodies"][1]["pose"][9], -2);
  EXPECT_EQ(page.run["frames"][0]["bodies"].size(), 2u);
  EXPECT_TRUE(page.run["frames"][2]["bodies"][1].is_null());
  EXPECT_FALSE(page.run["frames"][2]["bodies"][2].is_null());
  expectPositions(page, 0, 0, wavingSheet(5, 0).vertices);
  expectPositions(page, 2, 0, cloth.vertices());
  const json last = page.run["frames"][2];
  EXPECT_EQ(last["distance"].get<double>(), double(scene.nearest(of_cloth).distance));
  EXPECT_EQ(last["nearest"].size(), 1u);
}

/// What a name throws leaves the recording as it was; bodies of the scene leave with it only.
TEST(PageRecording, ANameThatThrowsChangesNothing) {
  const auto ball = std::make_shared<fcl::Sphered>(1);
  adaptive_bvh::Scene scene;
  std::map<adaptive_bvh::BodyId, std::string> names;
  const auto name = [&names](adaptive_bvh::BodyId id) { return names.at(id); };
  scene.add(ball);
  Recording recording;
  EXPECT_THROW(recording.follow(scene, name), std::out_of_range);
  EXPECT_EQ(recording.bodies(), 0);
  names[scene.bodies()[0]] = "first";
  recording.follow(scene, name);
  recording.frame();
  const adaptive_bvh::BodyId late = scene.add(ball);
  EXPECT_THROW(recording.frame(), std::out_of_range);
  EXPECT_THROW(recording.bodyOf(late), std::out_of_range);
  EXPECT_EQ(recording.bodies(), 1);
  EXPECT_EQ(recording.frames(), 1);
  EXPECT_EQ(messageOf([&] { recording.remove(0); }),
            "Recording::remove: 'first' is body 0 of the followed scene");
  names[late] = "late";
  recording.frame();
  EXPECT_EQ(Page(recording).run["bodies"][1]["name"], "late");
}

/// What was not computed is left out, not shown as a number.
TEST(PageRecording, UndefinedNumbersAreLeftOut) {
  AdaptiveBVHModeld model;
  fillModel(wavingSheet(2, 0), model);
  Recording recording;
  recording.add(model, fcl::Transform3d::Identity(), "sheet");
  FrameResults results;
  results.distance = kNaN;
  results.update_ms = std::numeric_limits<double>::infinity();
  results.nearest_points.push_back({fcl::Vector3d(0, 0, kNaN), fcl::Vector3d::Zero()});
  results.contacts = {fcl::Vector3d::Constant(kNaN), fcl::Vector3d(1, 2, 3)};
  results.contact_count = 2;
  recording.frame(results);
  const Page page(recording);
  const json frame = page.run["frames"][0];
  for (const char* name : {"distance", "updateMs", "nearest"}) EXPECT_FALSE(frame.contains(name));
  EXPECT_EQ(frame["contactCount"], 2);
  EXPECT_EQ(frame["contacts"]["count"], 1);
}

/// One file: it holds the licence of three.js, and names nothing to load.
TEST(PageRecording, ThePageIsSelfContained) {
  AdaptiveBVHModeld model;
  fillModel(wavingSheet(2, 0), model);
  RecordingOptions options;
  options.title = "a < b & c";
  Recording recording(options);
  recording.add(model, fcl::Transform3d::Identity(), "</script>");
  recording.frame();
  const Page page(recording);
  EXPECT_NE(page.text.find("<title>a &lt; b &amp; c</title>"), std::string::npos);
  EXPECT_NE(page.text.find("Permission is hereby granted, free of charge"), std::string::npos);
  EXPECT_NE(page.text.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.text.find("{{"), std::string::npos);
  for (const char* loads : {"<script src", "<link rel=\"stylesheet\"", "@import", "<img src"})
    EXPECT_EQ(page.text.find(loads), std::string::npos) << loads;
  EXPECT_EQ(page.run["bodies"][0]["name"], "</script>");
}

/// Below depth 0 there are no volumes, and the positions are recorded all the same.
TEST(PageRecording, WithoutVolumes) {
  for (const int depth : {3, -1}) {
    AdaptiveBVHModeld model;
    fillModel(wavingSheet(12, 0), model);
    RecordingOptions options;
    options.volume_depth = depth;
    Recording recording(options);
    recording.add(model, fcl::Transform3d::Identity(), "sheet");
    model.update(wavingSheet(12, 0, 500).vertices);
    recording.frame();
    const Page page(recording);
    expectPositions(page, 0, 0, model);
    if (depth >= 0)
      expectVolumes(page, 0, 0, model, depth);
    else
      EXPECT_EQ(page.run["frames"][0]["bodies"][0]["volumes"][1], 0);
  }
}

TEST(PageRecording, SaysWhatIsWrong) {
  const auto origin = fcl::Transform3d::Identity();
  AdaptiveBVHModeld model, empty;
  fillModel(wavingSheet(4, 0), model);
  Recording recording;
  EXPECT_EQ(messageOf([&] { recording.frame(); }), "Recording::frame: no body was added");
  EXPECT_EQ(messageOf([&] { recording.add(empty, origin, "e"); }),
            "Recording::add: 'e' has no triangles or is not built");
  EXPECT_EQ(messageOf([&] { recording.place(0, origin); }), "Recording::place: body 0, of 0");
  recording.add(model, origin, "sheet");
  EXPECT_EQ(messageOf([&] { recording.write("page.html"); }),
            "Recording::write: no frame was recorded");

  FrameResults results;
  results.addVertexDistances(0, std::vector<double>(3, 1));
  EXPECT_EQ(messageOf([&] { recording.frame(results); }),
            "Recording::frame: 3 distances given for the 25 vertices of 'sheet'");
  results.vertex_distances[0] = {1, {}};
  EXPECT_EQ(messageOf([&] { recording.frame(results); }),
            "Recording::frame: distances of vertices of body 1, of 1 bodies");
  results.vertex_distances[0] = {0, std::vector<double>(25, kNaN)};
  EXPECT_EQ(messageOf([&] { recording.frame(results); }),
            "Recording::frame: the distance of a vertex is not finite");
  EXPECT_EQ(recording.frames(), 0) << "what is refused is not recorded";

  fcl::Transform3d bad = origin;
  bad.translation().x() = kNaN;
  EXPECT_EQ(messageOf([&] { recording.place(0, bad); }),
            "Recording::place: the transform is not finite");
  recording.frame();
  EXPECT_EQ(messageOf([&] { recording.remove(1); }), "Recording::remove: body 1, of 1");
  fillModel(wavingSheet(5, 0), model);
  EXPECT_EQ(messageOf([&] { recording.frame(); }),
            "Recording::frame: 'sheet' has 36 vertices and 50 triangles, and had 25 and 32 when it "
            "was added");
  EXPECT_EQ(
      messageOf([&] { recording.write("/no/such/folder/page.html"); }),
      "Recording::write: cannot write '/no/such/folder/page.html': No such file or directory");
  EXPECT_NE(messageOf([&] { recording.write("/dev/full"); }).find("No space left"),
            std::string::npos);
}

TEST(PageRecording, LeavesThePageThatWasThereWhenTheDiskIsFull) {
  const TemporaryFile file("page.html", "the page before");
  Recording recording;
  const adaptive_bvh::DeformableMesh mesh(plate(4, 4));
  recording.add(mesh, fcl::Transform3d::Identity(), "sheet");
  recording.frame();
  {
    const FullDisk full(100000);
    EXPECT_THROW(recording.write(file.path()), std::runtime_error);
  }
  std::ostringstream text;
  text << std::ifstream(file.path()).rdbuf();
  EXPECT_EQ("the page before", text.str());
}

TEST(PageRecording, RefusesOptionsWithoutMeaning) {
  const auto refuses = [](void (*change)(RecordingOptions&)) {
    RecordingOptions options;
    change(options);
    EXPECT_THROW(Recording{options}, std::invalid_argument);
  };
  refuses([](RecordingOptions& options) { options.up.setZero(); });
  refuses([](RecordingOptions& options) { options.up[0] = kNaN; });
  refuses([](RecordingOptions& options) { options.frames_per_second = 0; });
  refuses([](RecordingOptions& options) { options.volume_depth = 21; });
  refuses([](RecordingOptions& options) { options.deeper_refits = -1; });
  refuses([](RecordingOptions& options) {
    options.vertex_distance_range = std::array<double, 2>{0, kNaN};
  });
}

}  // namespace page_recording_test
}  // namespace adaptive_bvh_test
