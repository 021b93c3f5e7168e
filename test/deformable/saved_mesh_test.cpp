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

template <typename S>
std::string saved(const DeformableMesh<S>& mesh) {
  std::ostringstream out;
  mesh.save(out);
  return out.str();
}
template <typename S>
DeformableMesh<S> loaded(const std::string& data) {
  std::istringstream in(data);
  return DeformableMesh<S>::load(in);
}

/// The message of a refusal; empty where the data were taken.
template <typename S>
std::string refusal(const std::string& data) {
  try {
    loaded<S>(data);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

/// What queries answer, number by number, in their order.
template <typename S>
std::vector<double> answersOf(const DeformableMesh<S>& mesh) {
  std::vector<double> answers;
  adaptive_bvh::ProximityRequest<S> request;
  request.distance = S(0.05);
  request.enable_distances = true;
  adaptive_bvh::TrianglePairs<S> pairs;
  adaptive_bvh::pairsWithin(mesh, request, pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    answers.push_back(pairs.triangles[i].first);
    answers.push_back(pairs.triangles[i].second);
    answers.push_back(double(pairs.distances[i]));
  }
  fcl::CollisionResult<S> contacts;
  adaptive_bvh::selfCollide(mesh, fcl::CollisionRequest<S>(100000, true), contacts);
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    answers.push_back(double(contacts.getContact(i).b1));
    answers.push_back(double(contacts.getContact(i).b2));
    answers.push_back(double(contacts.getContact(i).pos[0]));
  }
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 50; ++i) {
    const Vector3<S> x(S(normal(random)), S(normal(random)), S(normal(random)));
    const auto closest = adaptive_bvh::closestPoint(mesh, x);
    const auto hit = adaptive_bvh::firstHit(mesh, x, Vector3<S>(-x));
    for (int k = 0; k < 3; ++k) answers.push_back(double(closest.point[k]));
    answers.insert(answers.end(), {double(closest.distance), double(closest.triangle),
                                   double(hit.triangle), hit.triangle < 0 ? 0 : double(hit.t)});
  }
  return answers;
}

template <typename S>
std::vector<Vector3<S>> waved(std::vector<Vector3<S>> vertices, S time) {
  for (auto& x : vertices) {
    const Vector3<S> y = x;
    x[0] += S(0.1) * std::sin(3 * y[1] + time);
    x[1] += S(0.1) * std::cos(2 * y[2] - time);
    x[2] += S(0.2) * std::sin(2 * y[0] + time);
  }
  return vertices;
}

/// Meshes of all kinds: closed, open, of many parts, with unused vertices, of one triangle.
template <typename S>
std::vector<TriangleMesh<S>> allMeshes() {
  std::mt19937 random(3);
  std::vector<TriangleMesh<S>> meshes = {plate<S>(12, 9), tube<S>(12, 20), dome<S>(16, 8),
                                         soup<S>(150, random)};
  meshes.push_back(plate<S>(3, 3));
  meshes.back().vertices.insert(meshes.back().vertices.end(), 5, Vector3<S>(1, 2, 3));
  TriangleMesh<S> one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  meshes.push_back(one);
  one.triangles = {{0, 1, 2}, {2, 1, 0}, {1, 1, 1}};
  meshes.push_back(one);
  return meshes;
}

template <typename S>
void expectSame(const DeformableMesh<S>& a, const DeformableMesh<S>& b) {
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

template <typename S>
class SavedMesh : public testing::Test {};
TYPED_TEST_SUITE(SavedMesh, MeshScalars);

TYPED_TEST(SavedMesh, IsTheMesh) {
  using S = TypeParam;
  for (const TriangleMesh<S>& arrays : allMeshes<S>()) {
    DeformableMesh<S> mesh(arrays);
    for (int step = 0; step < 3; ++step) {
      DeformableMesh<S> copy = loaded<S>(saved(mesh));
      expectSame(mesh, copy);
      const auto next = waved(arrays.vertices, S(step + 1));
      ASSERT_EQ(mesh.updateTwoFrames(next).largest_displacement,
                copy.updateTwoFrames(next).largest_displacement);
      expectSame(mesh, copy);
      copy = loaded<S>(saved(mesh));  // of two frames
      expectSame(mesh, copy);
    }
  }
}

TYPED_TEST(SavedMesh, FollowsAllUpdates) {
  using S = TypeParam;
  const TriangleMesh<S> arrays = tube<S>(12, 20);
  DeformableMesh<S> mesh(arrays);
  mesh.update(waved(arrays.vertices, S(1)));
  mesh.update(std::vector<int>{7}, {Vector3<S>(S(0.5), S(0.5), S(0.5))});
  DeformableMesh<S> copy = loaded<S>(saved(mesh));
  ASSERT_TRUE(copy.validate());
  ASSERT_EQ(mesh.vertices(), copy.vertices());
  for (int step = 2; step < 6; ++step) {  // it turns
    auto next = waved(arrays.vertices, S(step));
    const Eigen::AngleAxis<S> turn(S(step), Vector3<S>::UnitZ());
    for (auto& x : next) x = turn * x;
    mesh.update(next);
    expectSame(mesh, loaded<S>(saved(mesh)));
    copy.update(next);
    copy.update(std::vector<int>{3}, {next[3]});
    ASSERT_TRUE(copy.validate());
    const auto a = answersOf(mesh), b = answersOf(copy);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-6) << i;
  }
}

TYPED_TEST(SavedMesh, LeavesWhatFollowsIt) {
  using S = TypeParam;
  const DeformableMesh<S> plane(plate<S>(4, 5)), round(dome<S>(8, 4));
  std::istringstream in(saved(plane) + saved(round) + "end");
  expectSame(plane, DeformableMesh<S>::load(in));
  expectSame(round, DeformableMesh<S>::load(in));
  std::string rest;
  in >> rest;
  EXPECT_EQ(rest, "end");
}

TYPED_TEST(SavedMesh, RefusesOtherData) {
  using S = TypeParam;
  using Other = std::conditional_t<std::is_same<S, double>::value, float, double>;
  const std::string data = saved(DeformableMesh<S>(plate<S>(4, 5)));
  const auto expect = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(refusal<S>(""), "end too early");
  expect(refusal<S>("a text that is no mesh"), "not those of a saved mesh");
  expect(refusal<Other>(data), "has numbers of type");
  std::string changed = data;
  changed[8] = 9;
  expect(refusal<S>(changed), "version 9; this library reads version 1");
  changed = data;
  std::swap(changed[12], changed[15]);
  std::swap(changed[13], changed[14]);
  expect(refusal<S>(changed), "byte order");
  for (std::size_t size = 0; size < data.size(); ++size)
    expect(refusal<S>(data.substr(0, size)), "end too early");
  std::ostringstream full;
  full.setstate(std::ios::badbit);
  EXPECT_THROW(DeformableMesh<S>(plate<S>(1, 1)).save(full), std::runtime_error);
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
TYPED_TEST(SavedMesh, OfDamagedDataIsRefused) {
  using S = TypeParam;
  std::mt19937 random(11);
  const TriangleMesh<S> arrays = dome<S>(10, 5);
  DeformableMesh<S> mesh(arrays);
  mesh.updateTwoFrames(waved(arrays.vertices, S(1)));
  const std::string data = saved(mesh);
  const std::size_t vertices = mesh.vertices().size() * 3 * sizeof(S),
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
    ASSERT_NE(refusal<S>(changed), "");
    const std::uint64_t fitting = checksumOf(changed, parts);
    std::memcpy(&changed[end], &fitting, 8);
    try {
      DeformableMesh<S> other = loaded<S>(changed);
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
TYPED_TEST(SavedMesh, OfHugeCountsIsRefused) {
  using S = TypeParam;
  std::string data = saved(DeformableMesh<S>(plate<S>(4, 5)));
  const std::uint64_t counts[] = {std::uint64_t(1) << 30, 0, (std::uint64_t(1) << 28) - 1};
  std::memcpy(&data[16], counts, sizeof counts);
  EXPECT_NE(refusal<S>(data).find("end too early"), std::string::npos);
  const std::uint64_t too_many[] = {~std::uint64_t(0), 0, ~std::uint64_t(0)};
  std::memcpy(&data[16], too_many, sizeof too_many);
  EXPECT_NE(refusal<S>(data).find("damaged"), std::string::npos);
}

}  // namespace saved_mesh_test
}  // namespace adaptive_bvh_test
