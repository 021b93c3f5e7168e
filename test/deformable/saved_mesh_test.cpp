// DeformableMesh::save and load: a loaded mesh is the saved one, whatever is queried or updated
// afterwards; other data are refused.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>
#include <sstream>
#include <string>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/self_collision.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace saved_mesh_test {

using adaptive_bvh::DeformableMesh;

std::string saved(const DeformableMesh& mesh) {
  std::ostringstream out;
  mesh.save(out);
  return out.str();
}

DeformableMesh loaded(const std::string& data) {
  std::istringstream in(data);
  return DeformableMesh::load(in);
}

/// The message of a refusal; empty where the data were taken.
std::string refusal(const std::string& data) {
  try {
    loaded(data);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

/// What queries answer, number by number, in their order.
std::vector<double> answersOf(const DeformableMesh& mesh) {
  std::vector<double> answers;
  adaptive_bvh::ProximityRequest request;
  request.distance = 0.05;
  request.enable_distances = true;
  adaptive_bvh::TrianglePairs pairs;
  adaptive_bvh::selfPairsWithin(mesh, request, pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    answers.push_back(pairs.triangles[i].first);
    answers.push_back(pairs.triangles[i].second);
    answers.push_back(double(pairs.distances[i]));
  }
  fcl::CollisionResultd contacts;
  adaptive_bvh::selfCollide(mesh, fcl::CollisionRequestd(100000, true), contacts);
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    answers.push_back(double(contacts.getContact(i).b1));
    answers.push_back(double(contacts.getContact(i).b2));
    answers.push_back(double(contacts.getContact(i).pos[0]));
  }
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 50; ++i) {
    const fcl::Vector3d x(double(normal(random)), double(normal(random)), double(normal(random)));
    const auto closest = adaptive_bvh::closestPoint(mesh, x);
    const auto hit = adaptive_bvh::firstHit(mesh, x, fcl::Vector3d(-x));
    for (int k = 0; k < 3; ++k) answers.push_back(double(closest.point[k]));
    answers.insert(answers.end(), {double(closest.distance), double(closest.triangle),
                                   double(hit.triangle), hit.triangle < 0 ? 0 : double(hit.t)});
  }
  return answers;
}

std::vector<fcl::Vector3d> waved(std::vector<fcl::Vector3d> vertices, double time) {
  for (auto& x : vertices) {
    const fcl::Vector3d y = x;
    x[0] += 0.1 * std::sin(3 * y[1] + time);
    x[1] += 0.1 * std::cos(2 * y[2] - time);
    x[2] += 0.2 * std::sin(2 * y[0] + time);
  }
  return vertices;
}

/// Meshes of all kinds: closed, open, of many parts, with unused vertices, of one triangle.
std::vector<TriangleMesh> allMeshes() {
  std::mt19937 random(3);
  std::vector<TriangleMesh> meshes = {plate(12, 9), tube(12, 20), dome(16, 8), soup(150, random)};
  meshes.push_back(plate(3, 3));
  meshes.back().vertices.insert(meshes.back().vertices.end(), 5, fcl::Vector3d(1, 2, 3));
  TriangleMesh one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  meshes.push_back(one);
  one.triangles = {{0, 1, 2}, {2, 1, 0}, {1, 1, 1}};
  meshes.push_back(one);
  return meshes;
}

void expectSame(const DeformableMesh& a, const DeformableMesh& b) {
  std::string reason;
  ASSERT_TRUE(b.validate(&reason)) << reason;
  ASSERT_EQ(a.vertices(), b.vertices());
  ASSERT_EQ(a.previousVertices(), b.previousVertices());
  ASSERT_EQ(a.triangles().size(), b.triangles().size());
  for (std::size_t t = 0; t < a.triangles().size(); ++t)
    for (int k = 0; k < 3; ++k) ASSERT_EQ(a.triangles()[t][k], b.triangles()[t][k]);
  ASSERT_EQ(a.aabb_radius, b.aabb_radius);
  ASSERT_EQ(answersOf(a), answersOf(b));  // the same bits
}

TEST(SavedMesh, IsTheMesh) {
  for (const TriangleMesh& arrays : allMeshes()) {
    DeformableMesh mesh(arrays);
    for (int step = 0; step < 3; ++step) {
      DeformableMesh copy = loaded(saved(mesh));
      expectSame(mesh, copy);
      const auto next = waved(arrays.vertices, double(step + 1));
      ASSERT_EQ(mesh.updateTwoFrames(next).largest_displacement,
                copy.updateTwoFrames(next).largest_displacement);
      expectSame(mesh, copy);
      copy = loaded(saved(mesh));  // of two frames
      expectSame(mesh, copy);
    }
  }
}

TEST(SavedMesh, FollowsAllUpdates) {
  const TriangleMesh arrays = tube(12, 20);
  DeformableMesh mesh(arrays);
  mesh.update(waved(arrays.vertices, 1.));
  mesh.update(std::vector<int>{7}, {fcl::Vector3d(0.5, 0.5, 0.5)});
  DeformableMesh copy = loaded(saved(mesh));
  ASSERT_TRUE(copy.validate());
  ASSERT_EQ(mesh.vertices(), copy.vertices());
  for (int step = 2; step < 6; ++step) {  // it turns
    auto next = waved(arrays.vertices, double(step));
    const Eigen::AngleAxis<double> turn(double(step), fcl::Vector3d::UnitZ());
    for (auto& x : next) x = turn * x;
    mesh.update(next);
    expectSame(mesh, loaded(saved(mesh)));
    copy.update(next);
    copy.update(std::vector<int>{3}, {next[3]});
    ASSERT_TRUE(copy.validate());
    const auto a = answersOf(mesh), b = answersOf(copy);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-6) << i;
  }
}

TEST(SavedMesh, LeavesWhatFollowsIt) {
  const DeformableMesh plane(plate(4, 5)), round(dome(8, 4));
  std::istringstream in(saved(plane) + saved(round) + "end");
  expectSame(plane, DeformableMesh::load(in));
  expectSame(round, DeformableMesh::load(in));
  std::string rest;
  in >> rest;
  EXPECT_EQ(rest, "end");
}

TEST(SavedMesh, RefusesOtherData) {
  const std::string data = saved(DeformableMesh(plate(4, 5)));
  const auto expect = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(refusal(""), "end too early");
  expect(refusal("a text that is no mesh"), "not those of a saved mesh");
  std::string changed = data;
  changed[7] = 'f';
  expect(refusal(changed), "was saved in single precision");
  changed = data;
  changed[8] = 9;
  expect(refusal(changed), "version 9; this library reads version 1");
  changed = data;
  std::swap(changed[12], changed[15]);
  std::swap(changed[13], changed[14]);
  expect(refusal(changed), "byte order");
  for (std::size_t size = 0; size < data.size(); ++size)
    expect(refusal(data.substr(0, size)), "end too early");
  std::ostringstream full;
  full.setstate(std::ios::badbit);
  EXPECT_THROW(DeformableMesh(plate(1, 1)).save(full), std::runtime_error);
}

/// The checksum that the format prescribes, by code of the test.
std::uint64_t checksumOf(const std::string& data, const std::vector<std::size_t>& parts) {
  std::uint64_t sum = 0xcbf29ce484222325;
  std::size_t at = 0;
  for (const std::size_t part : parts)
    for (const std::size_t end = at + part; at < end;) {
      std::uint64_t word = 0;
      const std::size_t size = std::min<std::size_t>(8, end - at);
      std::memcpy(&word, data.data() + at, size);
      sum = (sum ^ word) * 0x100000001b3;
      sum ^= sum >> 32;
      at += size;
    }
  return sum;
}

/// A byte, or some, are changed at random. A checksum finds that; and where the checksum is made to
/// fit, what is read is a mesh, or refused.
TEST(SavedMesh, OfDamagedDataIsRefused) {
  std::mt19937 random(11);
  const TriangleMesh arrays = dome(10, 5);
  DeformableMesh mesh(arrays);
  mesh.updateTwoFrames(waved(arrays.vertices, 1.));
  const std::string data = saved(mesh);
  const std::size_t vertices = mesh.vertices().size() * 3 * sizeof(double),
                    triangles = mesh.triangles().size();
  const std::vector<std::size_t> parts = {
      8, 104, vertices, vertices, 12 * triangles, 4 * triangles, (2 * triangles - 1 + 7) / 8};
  const std::size_t end = data.size() - 8;
  std::uint64_t sum = 0;
  std::memcpy(&sum, data.data() + end, 8);
  ASSERT_EQ(sum, checksumOf(data, parts));
  int taken = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string changed = data;
    for (int flips = 1 + int(random() % 3); flips-- > 0;) {
      // Half of them where the header, the indices or the tree are.
      const std::size_t from = random() % 2 ? 0 : 112 + 2 * vertices;
      const std::size_t at = from + random() % (end - from);
      changed[at] = static_cast<char>(changed[at] ^ (1 << random() % 8));
    }
    if (changed == data) continue;
    ASSERT_NE(refusal(changed), "");
    const std::uint64_t fitting = checksumOf(changed, parts);
    std::memcpy(&changed[end], &fitting, 8);
    try {
      DeformableMesh other = loaded(changed);
      std::string reason;
      ASSERT_TRUE(other.validate(&reason)) << reason;
      if (i % 16 == 0) answersOf(other);
      ++taken;
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GT(taken, 100);
  EXPECT_GT(refused, 100);
}

/// Data that claim to be huge take no memory before they turn out to be short.
TEST(SavedMesh, OfHugeCountsIsRefused) {
  std::string data = saved(DeformableMesh(plate(4, 5)));
  const std::uint64_t counts[] = {std::uint64_t(1) << 30, 0, (std::uint64_t(1) << 28) - 1};
  std::memcpy(&data[16], counts, sizeof counts);
  EXPECT_NE(refusal(data).find("end too early"), std::string::npos);
  const std::uint64_t too_many[] = {~std::uint64_t(0), 0, ~std::uint64_t(0)};
  std::memcpy(&data[16], too_many, sizeof too_many);
  EXPECT_NE(refusal(data).find("damaged"), std::string::npos);
}

}  // namespace saved_mesh_test
}  // namespace adaptive_bvh_test
