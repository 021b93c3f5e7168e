// DeformableMesh: every way to build, update and copy it, and what it refuses. It answers as brute
// force does for the positions that it was given last.
#include "adaptive_bvh/deformable_mesh.h"

#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <limits>
#include <sstream>
#include <utility>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "deformable/mesh_state.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace deformable_mesh_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::DeformableMesh;

using Points = std::vector<fcl::Vector3d>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic>;

/// What a call throws as std::invalid_argument; empty when it does not.
std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}
bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Columns columnsOf(const Points& points) {
  Columns columns(3, Eigen::Index(points.size()));
  for (std::size_t v = 0; v < points.size(); ++v) columns.col(Eigen::Index(v)) = points[v];
  return columns;
}

bool sameTriangles(const std::vector<fcl::Triangle>& a, const std::vector<fcl::Triangle>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t t = 0; t < a.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (a[t][k] != b[t][k]) return false;
  return true;
}

class Deformable : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Transform = fcl::Transform3d;

  static double epsilon() { return std::numeric_limits<double>::epsilon(); }
  static double tolerance() { return 1e-12; }

  Points moved(Points points, double by = 0.1) {
    for (fcl::Vector3d& p : points) p += by * random_.point();
    return points;
  }

  /// Expects sound boxes, these positions, a box of FCL's around them, and the right distances,
  /// contacts and self-contacts.
  void expectSound(const Mesh& mesh, const Points& positions, bool is_tight = true) {
    ASSERT_EQ(positions, mesh.vertices());
    std::string reason;
    ASSERT_TRUE(mesh.validate(&reason)) << reason;
    expectLocalBox(mesh, is_tight);
    const BruteForce brute(mesh, still_, tool_, beside_);
    fcl::DistanceResultd distance;
    adaptive_bvh::distance(&mesh, still_, &tool_, beside_, fcl::DistanceRequestd(true), distance);
    ASSERT_NEAR(brute.distance(), distance.min_distance, tolerance());
    ASSERT_EQ("", brute.findError(distance, still_, tolerance()));
    fcl::CollisionResultd own;
    selfCollide(mesh, {adaptive_bvh::NeighbourFilter::None}, fcl::CollisionRequestd(100000), own);
    std::set<std::pair<int, int>> pairs;
    for (std::size_t i = 0; i < own.numContacts(); ++i)
      pairs.emplace(int(own.getContact(i).b1), int(own.getContact(i).b2));
    ASSERT_EQ(BruteForce(mesh, still_, mesh, still_).contacts(), pairs);
  }
  static void expectLocalBox(const Mesh& mesh, bool is_tight) {
    Eigen::AlignedBox<double, 3> box;
    for (const fcl::Vector3d& p : mesh.vertices()) box.extend(p);
    const fcl::AABBd& local = mesh.aabb_local;
    if (is_tight) {
      EXPECT_EQ(box.min(), local.min_);
      EXPECT_EQ(box.max(), local.max_);
    } else {
      EXPECT_TRUE((local.min_.array() <= box.min().array()).all());
      EXPECT_TRUE((local.max_.array() >= box.max().array()).all());
    }
    for (const fcl::Vector3d& p : mesh.vertices())
      EXPECT_LE((p - mesh.aabb_center).norm(), mesh.aabb_radius * (1 + 8 * epsilon()));
  }
  static void expectSameAnswers(const Mesh& a, const Mesh& b, const Mesh& tool,
                                const Transform& tf) {
    const Transform still = Transform::Identity();
    fcl::DistanceResultd of_a, of_b;
    adaptive_bvh::distance(&a, still, &tool, tf, fcl::DistanceRequestd(), of_a);
    adaptive_bvh::distance(&b, still, &tool, tf, fcl::DistanceRequestd(), of_b);
    EXPECT_NEAR(of_a.min_distance, of_b.min_distance, tolerance());
  }

  const TriangleMesh sheet_ = plate(6, 5);
  const Mesh tool_{tube(5, 5)};
  const Transform still_ = Transform::Identity();
  Transform beside_ = [] {
    Transform tf = Transform::Identity();
    tf.translation() = fcl::Vector3d(0, 0.3, 0.7);
    return tf;
  }();
  RandomGeometry random_{404};
};

// ---- construction -------------------------------------------------------------------------------

template <typename BV>
DeformableMesh throughModel(const TriangleMesh& mesh) {
  fcl::BVHModel<BV> model;
  fillModel(mesh, model);
  return DeformableMesh(model);
}

TEST_F(Deformable, IsBuiltFromEverySource) {
  using Mesh = Mesh;
  const Points& v = this->sheet_.vertices;
  const std::vector<fcl::Triangle>& f = this->sheet_.triangles;
  const RowMajor rows = columnsOf(v).transpose();
  Eigen::Matrix<int, Eigen::Dynamic, 3> faces(Eigen::Index(f.size()), 3);
  for (std::size_t t = 0; t < f.size(); ++t)
    for (int k = 0; k < 3; ++k) faces(Eigen::Index(t), k) = int(f[t][k]);
  using UnsignedRows = Eigen::Matrix<unsigned, Eigen::Dynamic, 3, Eigen::RowMajor>;
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic> any = rows;
  AdaptiveBVHModel<fcl::RSSd> adaptive;
  fillModel(this->sheet_, adaptive);
  std::vector<Mesh> meshes;
  meshes.emplace_back(v, f);
  meshes.emplace_back(this->sheet_);
  meshes.emplace_back(rows, faces);
  meshes.emplace_back(Rows(rows), UnsignedRows(faces.template cast<unsigned>()));
  meshes.emplace_back(any, faces.template cast<long>().eval());
  meshes.emplace_back(Eigen::Map<const RowMajor>(v[0].data(), Eigen::Index(v.size()), 3), faces);
  meshes.push_back(throughModel<fcl::AABBd>(this->sheet_));
  meshes.push_back(throughModel<fcl::RSSd>(this->sheet_));
  meshes.push_back(throughModel<fcl::OBBRSSd>(this->sheet_));
  meshes.emplace_back(adaptive);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_TRUE(sameTriangles(f, meshes[i].triangles()));
    EXPECT_TRUE(meshes[i].previousVertices().empty());
    ASSERT_NO_FATAL_FAILURE(this->expectSound(meshes[i], v));
    const Points next = this->moved(v);
    meshes[i].update(next);
    ASSERT_NO_FATAL_FAILURE(this->expectSound(meshes[i], next));
    EXPECT_GT(meshes[i].bytes(), v.size() * sizeof(v[0]));
  }
}

TEST_F(Deformable, TakesBothFramesOfAModel) {
  fcl::BVHModel<fcl::OBBRSSd> model;
  fillModel(this->sheet_, model);
  const Points next = this->moved(this->sheet_.vertices);
  model.beginUpdateModel();
  model.updateSubModel(next);
  model.endUpdateModel();
  const DeformableMesh mesh(model);
  EXPECT_EQ(next, mesh.vertices());
  EXPECT_EQ(this->sheet_.vertices, mesh.previousVertices());
  EXPECT_TRUE(mesh.validate());
}

TEST_F(Deformable, IsNotBuiltFromBadData) {
  using Mesh = Mesh;
  const Points v = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<fcl::Triangle> f = {{0, 1, 2}};
  const double inf = std::numeric_limits<double>::infinity(),
               nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(contains(refusal([&] { Mesh(v, {}); }), "no triangles"));
  EXPECT_NE("", refusal([&] { Mesh({}, {}); }));
  EXPECT_NE("", refusal([&] { Mesh({}, f); }));
  EXPECT_TRUE(contains(refusal([&] { Mesh(v, {{0, 1, 2}, {0, 3, 1}}); }), "vertex 3"));
  EXPECT_NE("", refusal([&] { Mesh(v, {{0, ~std::size_t(0), 1}}); }));
  for (const double bad : {nan, inf, -inf, 1e77, -std::numeric_limits<double>::max()})
    for (int k = 0; k < 3; ++k) {
      Points broken = v;
      broken[2][k] = bad;
      EXPECT_TRUE(contains(refusal([&] { Mesh(broken, f); }), "vertex 2"));
    }
  const Rows rows = columnsOf(v).transpose();
  const Eigen::Matrix<int, 1, 3> face(0, 1, 2);
  EXPECT_EQ("", refusal([&] { Mesh(rows, face); }));
  EXPECT_TRUE(contains(refusal([&] { Mesh(rows.leftCols(2), face); }), "3 x 2"));
  EXPECT_TRUE(contains(refusal([&] { Mesh(rows, face.transpose()); }), "3 x 1"));
  EXPECT_NE("", refusal([&] { Mesh(rows, Eigen::Matrix<int, 1, 3>(0, -1, 2)); }));
  EXPECT_NE("", refusal([&] { Mesh(rows, Eigen::Matrix<int, 0, 3>()); }));
  EXPECT_NE("", refusal([&] { Mesh(fcl::BVHModel<fcl::AABBd>()); }));
  fcl::BVHModel<fcl::RSSd> cloud;
  cloud.beginModel();
  cloud.addSubModel(v);
  cloud.endModel();
  EXPECT_NE("", refusal([&] { Mesh{cloud}; })) << "a point cloud";
  EXPECT_EQ("", refusal([&] {
              const double largest = double(0x1p252);
              const Mesh mesh({{0, 0, 0}, {largest, 0, 0}, {0, -largest, 0}}, f);
              EXPECT_TRUE(mesh.validate());
            }));
}

TEST_F(Deformable, OddTrianglesAreFine) {
  const fcl::Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const std::vector<TriangleMesh> meshes = {
      {{a, b, c}, {{0, 1, 2}}},
      {{a, b, c}, std::vector<fcl::Triangle>(9, fcl::Triangle(0, 1, 2))},  // duplicates
      {{a, b, c}, {{0, 0, 0}, {0, 1, 1}, {2, 1, 2}}},                      // degenerate
      {{a, a, a, b, b, b}, {{0, 1, 2}, {3, 4, 5}}},                        // points
      {{a, b, c, fcl::Vector3d(50, 0, 0)}, {{0, 1, 2}}},                   // an unused vertex
      {{a, a, a}, {{0, 1, 2}}},                                            // all in one place
  };
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    SCOPED_TRACE(i);
    const TriangleMesh& mesh = meshes[i];
    DeformableMesh body(mesh);
    ASSERT_NO_FATAL_FAILURE(this->expectSound(body, mesh.vertices));
    for (int frame = 0; frame < 4; ++frame) {
      const Points next = this->moved(mesh.vertices, 0.1 * double(frame % 3));
      frame % 2 ? body.update(next) : body.updateTwoFrames(next);
      ASSERT_NO_FATAL_FAILURE(this->expectSound(body, next));
    }
    const Points one(mesh.vertices.size(), c);
    body.update(one);
    ASSERT_NO_FATAL_FAILURE(this->expectSound(body, one));
  }
}

// ---- updates ------------------------------------------------------------------------------------

TEST_F(Deformable, UpdatesFromVectorsPointersMatricesAndMaps) {
  DeformableMesh mesh(this->sheet_);
  const fcl::Vector3d* const address = mesh.vertices().data();
  const auto n = Eigen::Index(this->sheet_.vertices.size());
  using Any = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  using AnyRowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const std::vector<std::function<void(const Points&)>> updates = {
      [&](const Points& p) { mesh.update(p); },
      [&](const Points& p) { mesh.update(p.data(), p.size()); },
      [&](const Points& p) { mesh.update(columnsOf(p)); },
      [&](const Points& p) { mesh.update(Any(columnsOf(p))); },
      [&](const Points& p) { mesh.update(AnyRowMajor(columnsOf(p))); },
      [&](const Points& p) { mesh.update(Rows(columnsOf(p).transpose())); },
      [&](const Points& p) { mesh.update(RowMajor(columnsOf(p).transpose())); },
      [&](const Points& p) { mesh.update(Any(columnsOf(p).transpose())); },
      [&](const Points& p) { mesh.update(AnyRowMajor(columnsOf(p).transpose())); },
      [&](const Points& p) { mesh.update(columnsOf(p).transpose()); },
      [&](const Points& p) { mesh.update(columnsOf(p) * 1.); },
      [&](const Points& p) { mesh.update(columnsOf(p)); },
      [&](const Points& p) { mesh.update(Eigen::Map<const Columns>(p[0].data(), 3, n)); },
      [&](const Points& p) { mesh.update(Eigen::Map<const RowMajor>(p[0].data(), n, 3)); },
      [&](const Points& p) {  // with a fourth number behind each vertex
        Any padded = Any::Constant(4, n, -77.);
        padded.topRows(3) = columnsOf(p);
        mesh.update(padded.template topRows<3>());
        mesh.update(Eigen::Map<const Columns, 0, Eigen::OuterStride<4>>(padded.data(), 3, n));
      },
      [&](const Points& p) {  // the middle of larger matrices
        Any large = Any::Constant(n + 5, 7, -77.);
        large.block(2, 3, n, 3) = columnsOf(p).transpose();
        mesh.update(large.block(2, 3, n, 3));
        mesh.update(large.template block<Eigen::Dynamic, 3>(2, 3, n, 3));
        const AnyRowMajor other = large;
        mesh.update(other.block(2, 3, n, 3));
      },
      [&](const Points& p) {  // every second number of every second column
        Any sparse = Any::Constant(6, 2 * n, -77.);
        for (Eigen::Index v = 0; v < n; ++v)
          for (int k = 0; k < 3; ++k) sparse(2 * k, 2 * v) = p[std::size_t(v)][k];
        using Strides = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
        mesh.update(Eigen::Map<const Columns, 0, Strides>(sparse.data(), 3, n, Strides(12, 2)));
      },
  };
  for (std::size_t i = 0; i < updates.size(); ++i) {
    SCOPED_TRACE(i);
    const Points next = this->moved(this->sheet_.vertices, 0.2);
    updates[i](next);
    ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, next));
  }
  EXPECT_EQ(address, mesh.vertices().data());
}

/// Refused, with a sentence, and without a trace.
TEST_F(Deformable, RefusesBadUpdatesAndKeepsItsPositions) {
  DeformableMesh mesh(this->sheet_);
  const Points before = this->moved(this->sheet_.vertices), now = this->moved(before);
  mesh.update(before);
  mesh.updateTwoFrames(now);
  const std::size_t n = now.size();
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               inf = std::numeric_limits<double>::infinity();
  const double large = 1e200;
  const auto expectRefused = [&](const std::function<void()>& call, const std::string& part = "") {
    const std::string what = refusal(call);
    EXPECT_NE("", what);
    EXPECT_TRUE(contains(what, part)) << what;
    EXPECT_EQ(before, mesh.previousVertices());
    ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, now));
  };
  const Points next = this->moved(now);
  Points fewer(next.begin(), next.begin() + 3), more = next;
  more.push_back(next[0]);
  for (const Points* wrong : {&fewer, &more}) {
    const std::string count = std::to_string(wrong->size()) + " positions";
    expectRefused([&] { mesh.update(*wrong); }, count);
    expectRefused([&] { mesh.updateTwoFrames(*wrong); }, count);
    if (wrong == &more) {
      expectRefused([&] { mesh.update(columnsOf(*wrong)); }, count);
      expectRefused([&] { mesh.update(Rows(columnsOf(*wrong).transpose())); }, count);
    }
  }
  expectRefused([&] { mesh.update(Points()); });
  for (const double bad : {nan, inf, -inf, large, -large})
    for (int k = 0; k < 3; ++k) {
      Points broken = next;
      broken[7][k] = bad;
      const std::string name = std::string(1, "xyz"[k]) + " of vertex 7";
      expectRefused([&] { mesh.update(broken); }, name);
      expectRefused([&] { mesh.updateTwoFrames(broken); }, name);
      expectRefused([&] { mesh.update(columnsOf(broken)); }, name);
      expectRefused([&] { mesh.update(Rows(columnsOf(broken).transpose())); }, name);
      expectRefused([&] { mesh.update(std::vector<unsigned>{3, 7}, {next[3], broken[7]}); }, name);
    }
  expectRefused([&] { mesh.update(std::vector<unsigned>{0, unsigned(n)}, {next[0], next[1]}); });
  expectRefused([&] { mesh.update(std::vector<int>{0, -1}, {next[0], next[1]}); });
  expectRefused([&] { mesh.update(std::vector<long>{0, 1l << 33}, {next[0], next[1]}); });
  expectRefused([&] { mesh.update(std::vector<unsigned>{0, 1}, {next[0]}); }, "2 indices");
  expectRefused([&] { mesh.update(std::vector<unsigned>{0}, {next[0], next[1]}); });
  using Any = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  expectRefused([&] { mesh.update(Any(4, Eigen::Index(n)).setZero().eval()); },
                "4 x " + std::to_string(n));
  expectRefused([&] { mesh.update(Any(0, 0)); });
  expectRefused(
      [&] { mesh.update(Eigen::Matrix<double, 3, 3>(Eigen::Matrix<double, 3, 3>::Zero())); });
}

/// Three vertices: only the type of a matrix states whether rows or columns are the vertices.
TEST_F(Deformable, OfThreeVerticesTheTypeTellsRowsFromColumns) {
  using Any = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  const Points start = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  DeformableMesh mesh(start, {{0, 1, 2}});
  Any square(3, 3);
  square << 1, 2, 3, 4, 5, 6, 7, 8, 10;
  EXPECT_TRUE(contains(refusal([&] { mesh.update(square); }), "3 x 3"));
  EXPECT_TRUE(contains(refusal([&] { mesh.update(fcl::Matrix3d(square)); }), "3 x 3"));
  EXPECT_EQ(start, mesh.vertices());
  mesh.update(Columns(square));
  EXPECT_EQ(fcl::Vector3d(2, 5, 8), mesh.vertices()[1]);
  mesh.update(Rows(square));
  EXPECT_EQ(fcl::Vector3d(4, 5, 6), mesh.vertices()[1]);
  mesh.update(RowMajor(square));
  EXPECT_EQ(fcl::Vector3d(7, 8, 10), mesh.vertices()[2]);
}

/// A mesh of which some vertices are updated, beside one that is given all.
TEST_F(Deformable, AnUpdateOfSomeVerticesIsThatOfAll) {
  const TriangleMesh start = dome(9, 5);
  DeformableMesh some(start), all(start);
  Points now = start.vertices;
  for (int step = 0; step < 60; ++step) {
    std::vector<unsigned> indices;
    Points positions;
    const int count = step % 10 == 9 ? 3 * int(now.size()) : this->random_.below(6);
    const double size = this->random_.oneIn(4) ? 1. : 0.02;
    for (int i = 0; i < count; ++i) {
      indices.push_back(unsigned(this->random_.below(int(now.size()))));  // now and then twice
      positions.push_back(now[indices.back()] + size * this->random_.point());
    }
    for (std::size_t i = 0; i < indices.size(); ++i) now[indices[i]] = positions[i];
    if (step % 2) {
      const std::vector<short> other(indices.begin(), indices.end());
      some.update(other, positions);
    } else {
      some.update(indices.data(), positions.data(), indices.size());
    }
    EXPECT_EQ(indices.size(), some.lastUpdate().vertices);
    std::string reason;
    ASSERT_TRUE(some.validate(&reason)) << reason;
    ASSERT_EQ(now, some.vertices());
    if (step % 4 == 0) {
      ASSERT_NO_FATAL_FAILURE(this->expectSound(some, now, false));
    }
    all.update(now);
    this->expectSameAnswers(some, all, this->tool_, this->beside_);
    if (step % 7 == 6) {
      some.update(now);
      this->expectLocalBox(some, true);
    }
  }
}

TEST_F(Deformable, TwoFramesAreKeptUntilTheNextUpdate) {
  DeformableMesh mesh(this->sheet_);
  Points now = this->sheet_.vertices;
  for (int frame = 0; frame < 5; ++frame) {
    const Points last = now;
    now = this->moved(now);
    mesh.updateTwoFrames(now);
    EXPECT_EQ(last, mesh.previousVertices());
    ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, now));
  }
  now[4] += fcl::Vector3d(0, 0, 1);
  mesh.update(std::vector<int>{4}, {now[4]});
  EXPECT_TRUE(mesh.previousVertices().empty());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, now, false));
  mesh.updateTwoFrames(this->sheet_.vertices);
  EXPECT_EQ(now, mesh.previousVertices());
  mesh.update(now);
  EXPECT_TRUE(mesh.previousVertices().empty());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, now));
}

/// The positions of a call may be the mesh's own: they count as they were.
TEST_F(Deformable, TakesItsOwnPositions) {
  DeformableMesh mesh(this->sheet_);
  const Points first = this->sheet_.vertices, second = this->moved(first);
  mesh.update(mesh.vertices());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, first));
  mesh.updateTwoFrames(mesh.vertices());
  EXPECT_EQ(first, mesh.previousVertices());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, first));
  mesh.updateTwoFrames(second);
  mesh.updateTwoFrames(mesh.previousVertices());
  EXPECT_EQ(second, mesh.previousVertices());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, first));
  mesh.update(mesh.previousVertices());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, second));
  const std::vector<unsigned> indices = {1, 2, 0, 3};
  mesh.update(indices, Points(second.begin(), second.begin() + 4));
  mesh.update(indices.data(), mesh.vertices().data(), indices.size());
  Points expected = second;
  for (std::size_t i = 0; i < 4; ++i) expected[indices[i]] = second[i];
  const Points once = expected;
  for (std::size_t i = 0; i < 4; ++i) expected[indices[i]] = once[i];
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, expected, false));
  mesh.updateTwoFrames(second);
  mesh.update(indices.data(), mesh.previousVertices().data() + 5, indices.size());
  Points from_previous = second;
  for (std::size_t i = 0; i < 4; ++i) from_previous[indices[i]] = expected[5 + i];
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, from_previous, false));
}

TEST_F(Deformable, ReportsWhatAnUpdateDid) {
  DeformableMesh mesh(this->sheet_);
  Points next = this->sheet_.vertices;
  for (fcl::Vector3d& p : next) p[2] += 0.25;
  const auto& report = mesh.update(next);
  EXPECT_EQ(&report, &mesh.lastUpdate());
  EXPECT_EQ(next.size(), report.vertices);
  EXPECT_GE(report.largest_displacement, 0.25);
  EXPECT_LE(report.largest_displacement, 0.25001);
  EXPECT_GT(report.seconds, 0);
  mesh.update(next);
  EXPECT_EQ(0, mesh.lastUpdate().largest_displacement);
  EXPECT_THROW(mesh.setThreads(0), std::invalid_argument);
  EXPECT_THROW(mesh.setThreads(-1), std::invalid_argument);
}

// ---- copies -------------------------------------------------------------------------------------

static_assert(std::is_copy_constructible<DeformableMesh>::value &&
                  std::is_copy_assignable<DeformableMesh>::value,
              "copies are snapshots");
static_assert(std::is_nothrow_move_constructible<DeformableMesh>::value &&
                  std::is_nothrow_move_assignable<DeformableMesh>::value,
              "containers may move meshes");

TEST_F(Deformable, ACopyIsASnapshot) {
  using Mesh = Mesh;
  Mesh mesh(this->sheet_);
  const Points first = this->moved(this->sheet_.vertices), second = this->moved(first);
  mesh.updateTwoFrames(first);
  Mesh copy(mesh);
  EXPECT_EQ(&mesh.triangles(), &copy.triangles()) << "the topology is shared";
  EXPECT_NE(mesh.vertices().data(), copy.vertices().data());
  mesh.update(second);
  ASSERT_NO_FATAL_FAILURE(this->expectSound(copy, first));
  EXPECT_EQ(this->sheet_.vertices, copy.previousVertices());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, second));
  copy.update(this->sheet_.vertices);
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, second));
  ASSERT_NO_FATAL_FAILURE(this->expectSound(copy, this->sheet_.vertices));

  const fcl::Vector3d* const memory = copy.vertices().data();
  copy = mesh;
  EXPECT_EQ(memory, copy.vertices().data()) << "in the memory that was there";
  copy.update(std::vector<int>{2}, {fcl::Vector3d(1, 2, 3)});
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, second));
  const Mesh& same = copy;
  copy = same;  // itself
  EXPECT_TRUE(copy.validate());

  // Assigned from another mesh; the original may be gone.
  {
    const Mesh other(dome(8, 4));
    copy = other;
  }
  ASSERT_NO_FATAL_FAILURE(this->expectSound(copy, dome(8, 4).vertices));
  const Points third = this->moved(copy.vertices());
  copy.update(third);
  ASSERT_NO_FATAL_FAILURE(this->expectSound(copy, third));
}

TEST_F(Deformable, AMoveTakesEverythingAlong) {
  using Mesh = Mesh;
  Mesh mesh(this->sheet_);
  const Points first = this->moved(this->sheet_.vertices), second = this->moved(first);
  mesh.update(first);
  const fcl::Vector3d* const memory = mesh.vertices().data();
  Mesh to(std::move(mesh));
  EXPECT_EQ(memory, to.vertices().data());
  ASSERT_NO_FATAL_FAILURE(this->expectSound(to, first));
  mesh = to;  // NOLINT(bugprone-use-after-move): assigning is what may be done
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, first));
  mesh = std::move(to);
  EXPECT_EQ(memory, mesh.vertices().data());
  mesh.update(second);
  ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, second));
  std::vector<Mesh> meshes;
  for (int i = 1; i < 6; ++i) meshes.emplace_back(plate(i, i));
  meshes.erase(meshes.begin());
  for (int i = 2; i < 6; ++i)
    ASSERT_NO_FATAL_FAILURE(this->expectSound(meshes[std::size_t(i - 2)], plate(i, i).vertices));
}

// ---- motions and sizes --------------------------------------------------------------------------

/// The boxes turn with the body, by several full turns, slow and fast.
TEST_F(Deformable, StaysExactWhileItTumbles) {
  for (const double step : {0.07, 1.3, 3.1}) {
    const TriangleMesh start = tube(6, 9);
    DeformableMesh mesh(start);
    const fcl::Vector3d axis = this->random_.direction();
    int turns = 0;
    const int frames = step < 0.1 ? 280 : 60;
    for (int frame = 1; frame <= frames; ++frame) {
      const fcl::Matrix3d R =
          Eigen::AngleAxis<double>(step * double(frame), axis).toRotationMatrix();
      Points next = this->moved(start.vertices, 0.003);
      for (fcl::Vector3d& p : next) p = R * p;
      if (frame % 5 == 0) {
        std::vector<unsigned> all(next.size());
        for (unsigned v = 0; v < all.size(); ++v) all[v] = v;
        mesh.update(all, next);
      } else {
        mesh.update(next);
      }
      turns += mesh.lastUpdate().turned;
      if (frame % (frames / 20) == 0) {
        ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, next, frame % 5 != 0));
      }
    }
    EXPECT_GT(turns, 3);
  }
}

/// Two meshes of any size, at any place in their frames.
TEST_F(Deformable, IsExactAtAnySizeAndPlace) {
  const std::vector<double> sizes = std::vector<double>{1e-90, 1e-20, 1, 1e20, 1e70};
  for (const double size : sizes)
    for (const double place : {0., 1., 1e3}) {
      const fcl::Vector3d offset =
          fcl::Vector3d(1, -0.7, 0.3) * double(size * (size < 1e6 ? place : 0));
      TriangleMesh first = dome(8, 5), second = tube(5, 6);
      for (fcl::Vector3d& p : first.vertices) p = p * double(size) + offset;
      for (fcl::Vector3d& p : second.vertices)
        p = (p * 0.4 + fcl::Vector3d(0.2, 0.3, 0.9)) * double(size) + offset;
      DeformableMesh a(first);
      const DeformableMesh b(second);
      for (int frame = 0; frame < 4; ++frame) {
        a.update(this->moved(first.vertices, double(0.05 * size)));
        std::string reason;
        ASSERT_TRUE(a.validate(&reason)) << size << ": " << reason;
        fcl::DistanceResultd result;
        adaptive_bvh::distance(&a, this->still_, &b, this->still_, fcl::DistanceRequestd(), result);
        const double expected = BruteForce(a, this->still_, b, this->still_).distance();
        ASSERT_NEAR(expected / double(size), result.min_distance / double(size), this->tolerance())
            << size << ' ' << place;
        ASSERT_GT(result.min_distance, 0);
      }
    }
}

/// So far away that single precision cannot distinguish boxes, or cannot represent their distance.
TEST_F(Deformable, HasADistanceFromBodiesFarAway) {
  for (int round = 0; round < 60; ++round) {
    const double way = double(std::pow(10., (1.25) * round));
    const DeformableMesh mesh(soup(1 + round % 9, this->random_.engine()));
    adaptive_bvh::CoherentDistance pair(mesh, this->tool_);
    fcl::Transform3d tf = randomPose(this->random_.engine(), 1);
    tf.translation()[0] = way;
    fcl::DistanceResultd result, kept;
    adaptive_bvh::distance(&mesh, this->still_, &this->tool_, tf, fcl::DistanceRequestd(), result);
    pair.distance(this->still_, tf, fcl::DistanceRequestd(), kept);
    fcl::CollisionResultd none;
    if (way > 100) {
      EXPECT_EQ(0u, adaptive_bvh::collide(&mesh, this->still_, &this->tool_, tf,
                                          fcl::CollisionRequestd(), none));
      ASSERT_NEAR(1, result.min_distance / way, 0.1) << way;
      ASSERT_NEAR(1, kept.min_distance / way, 0.1) << way;
    }
  }
}

/// From far away into place, and back, by updates of all, of some, and of two frames.
TEST_F(Deformable, ForgetsWhereItCameFrom) {
  DeformableMesh mesh(this->sheet_);
  adaptive_bvh::CoherentDistance pair(mesh, this->tool_);
  const Points& here = this->sheet_.vertices;
  for (int round = 0; round < 24; ++round) {
    const double way = double(std::pow(10., round % 8));
    Points there = here;
    for (fcl::Vector3d& p : there)
      p = p * (round % 3 == 0 ? way : 1.) + fcl::Vector3d(way, -way, way);
    mesh.update(there);
    fcl::DistanceResultd far;
    if (round % 2) pair.distance(this->still_, this->beside_, fcl::DistanceRequestd(), far);
    if (round % 3 == 1) {
      std::vector<unsigned> all(here.size());
      for (unsigned v = 0; v < all.size(); ++v) all[v] = v;
      mesh.update(all, here);
    } else {
      round % 3 ? mesh.updateTwoFrames(here) : mesh.update(here);
    }
    ASSERT_NO_FATAL_FAILURE(this->expectSound(mesh, here, round % 3 != 1));
    fcl::DistanceResultd kept;
    pair.distance(this->still_, this->beside_, fcl::DistanceRequestd(), kept);
    ASSERT_NEAR(BruteForce(mesh, this->still_, this->tool_, this->beside_).distance(),
                kept.min_distance, this->tolerance());
  }
}

/// Distances after a two-frame update from far away do not keep the rounding of there.
TEST(DeformableTwoFrames, FromFarAwayDistancesAreExact) {
  using Mesh = DeformableMesh;
  RandomGeometry random(38);
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  for (int round = 0; round < 200; ++round) {
    Points near, far;
    std::vector<fcl::Triangle> triangles;
    for (std::size_t t = 0; t < 4; ++t) {
      for (int k = 0; k < 3; ++k) {
        near.push_back(random.point());
        far.push_back(random.point() + fcl::Vector3d(-706974, 643157, 9694));
      }
      triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    Points other;
    for (int k = 0; k < 3; ++k) other.push_back(random.point() + fcl::Vector3d(13.7, -15.1, -1.5));
    Mesh mesh(near, triangles);
    const Mesh tool(other, {{0, 1, 2}});
    adaptive_bvh::CoherentDistance kept(mesh, tool);
    fcl::DistanceResultd before, by_kept, by_fresh, by_distance;
    kept.distance(still, still, fcl::DistanceRequestd(), before);
    mesh.update(far);
    fcl::DistanceResultd away;
    if (round % 2) kept.distance(still, still, fcl::DistanceRequestd(), away);
    mesh.updateTwoFrames(near);
    EXPECT_EQ(far, mesh.previousVertices());
    kept.distance(still, still, fcl::DistanceRequestd(), by_kept);
    adaptive_bvh::CoherentDistance fresh(mesh, tool);
    fresh.distance(still, still, fcl::DistanceRequestd(), by_fresh);
    adaptive_bvh::distance(&mesh, still, &tool, still, fcl::DistanceRequestd(), by_distance);
    const double expected = BruteForce(mesh, still, tool, still).distance();
    for (const auto* result : {&before, &by_kept, &by_fresh, &by_distance})
      ASSERT_DOUBLE_EQ(expected, result->min_distance);
  }
}

// ---- validate -----------------------------------------------------------------------------------

TEST_F(Deformable, ValidateFindsWhatIsWrong) {
  using State = adaptive_bvh::MeshState;
  DeformableMesh mesh(this->sheet_);
  auto& state = const_cast<State&>(adaptive_bvh::detail::MeshAccess::state(std::as_const(mesh)));
  std::string reason;
  ASSERT_TRUE(mesh.validate(&reason)) << reason;
  const fcl::Vector3d kept = state.vertices[11];
  state.vertices[11] += fcl::Vector3d(0, 0, 5);
  EXPECT_FALSE(mesh.validate(&reason));
  EXPECT_TRUE(contains(reason, "does not contain triangle")) << reason;
  EXPECT_FALSE(mesh.validate());
  state.vertices[11] = kept;
  auto* const nodes = const_cast<adaptive_bvh::WideNode*>(state.tree.nodes());
  const auto count = nodes[0].count;
  nodes[0].count = 0;
  EXPECT_FALSE(mesh.validate(&reason));
  EXPECT_TRUE(contains(reason, "links")) << reason;
  nodes[0].count = count;
  for (int n = 0; n < state.tree.size(); ++n) {  // one box a node, a little too small
    const auto high = nodes[n].boxes.high[0][0];
    nodes[n].boxes.high[0][0] = nodes[n].boxes.low[0][0] - 1;
    EXPECT_FALSE(mesh.validate(&reason)) << n;
    EXPECT_TRUE(contains(reason, "node " + std::to_string(n))) << reason;
    nodes[n].boxes.high[0][0] = high;
  }
  EXPECT_TRUE(mesh.validate());
}

// ---- beside FCL ---------------------------------------------------------------------------------

/// FCL's own functions say on std::cerr that they do not support it.
TEST_F(Deformable, FclSaysThatItDoesNotSupportIt) {
  const DeformableMesh mesh(this->sheet_);
  EXPECT_EQ(fcl::BV_UNKNOWN, mesh.getNodeType());
  EXPECT_EQ(fcl::OT_UNKNOWN, mesh.getObjectType());
  const fcl::Sphered sphere(1);
  AdaptiveBVHModel<fcl::RSSd> model;
  fillModel(this->sheet_, model);
  const fcl::CollisionGeometryd* const others[] = {&mesh, &sphere, &model};
  for (const fcl::CollisionGeometryd* other : others)
    for (const bool is_first : {true, false}) {
      const fcl::CollisionGeometryd *a = &mesh, *b = other;
      if (!is_first) std::swap(a, b);
      std::ostringstream said;
      std::streambuf* const saved = std::cerr.rdbuf(said.rdbuf());
      fcl::DistanceResultd distance;
      const double found =
          fcl::distance(a, this->still_, b, this->still_, fcl::DistanceRequestd(), distance);
      const std::string about_distance = said.str();
      said.str("");
      fcl::CollisionResultd contacts;
      const std::size_t touching =
          fcl::collide(a, this->still_, b, this->still_, fcl::CollisionRequestd(), contacts);
      std::cerr.rdbuf(saved);
      EXPECT_TRUE(contains(about_distance, "not supported"));
      EXPECT_TRUE(contains(said.str(), "not supported"));
      EXPECT_TRUE(found == std::numeric_limits<double>::max() || found == -1) << found;
      EXPECT_EQ(0u, touching);
      EXPECT_EQ(0u, contacts.numContacts());
    }
}

/// As a geometry of collision objects, beside models, in either order; the objects of a result are
/// as they were passed.
TEST_F(Deformable, MeetsModelsThatHaveAMesh) {
  const auto mesh = std::make_shared<DeformableMesh>(this->sheet_);
  AdaptiveBVHModel<fcl::OBBRSSd> both;
  const auto model = std::make_shared<AdaptiveBVHModel<fcl::RSSd>>();
  const TriangleMesh hose = tube(5, 6);
  fillModel(hose, *model);
  fillModel(hose, both);
  const fcl::CollisionObjectd one(mesh, this->beside_);
  fcl::CollisionObjectd other(model, this->still_);
  fcl::DistanceResultd refused;
  fcl::CollisionResultd refused_contacts;
  const std::string why =
      refusal([&] { adaptive_bvh::distance(&one, &other, fcl::DistanceRequestd(), refused); });
  EXPECT_TRUE(contains(why, "mesh()")) << why;
  EXPECT_NE("", refusal([&] {
              adaptive_bvh::collide(&other, &one, fcl::CollisionRequestd(), refused_contacts);
            }));
  model->mesh();
  both.mesh();
  int touching = 0;
  for (int frame = 0; frame < 12; ++frame) {
    mesh->update(this->moved(this->sheet_.vertices));
    const Points bent = this->moved(hose.vertices, 0.02);
    model->update(bent);
    both.update(bent);
    fcl::Transform3d tf = randomPose(this->random_.engine(), 0.3);
    tf.translation() += this->beside_ * fcl::Vector3d(0.5, 0.5, 0);
    other.setTransform(tf);
    for (const bool is_first : {true, false}) {
      const fcl::CollisionObjectd &a = is_first ? one : other, &b = is_first ? other : one;
      fcl::DistanceResultd distance;
      adaptive_bvh::distance(&a, &b, fcl::DistanceRequestd(true), distance);
      const BodyView of_mesh(*mesh), of_model(*model);
      const BruteForce brute(is_first ? of_mesh : of_model, a.getTransform(),
                             is_first ? of_model : of_mesh, b.getTransform());
      ASSERT_NEAR(brute.distance(), distance.min_distance, this->tolerance());
      ASSERT_EQ("", brute.findError(distance, a.getTransform(), this->tolerance()));
      fcl::CollisionResultd contacts;
      adaptive_bvh::collide(&a, &b, fcl::CollisionRequestd(100000), contacts);
      std::set<std::pair<int, int>> pairs;
      for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
        const fcl::Contactd& contact = contacts.getContact(i);
        EXPECT_EQ(a.collisionGeometry().get(), contact.o1);
        EXPECT_EQ(b.collisionGeometry().get(), contact.o2);
        pairs.emplace(int(contact.b1), int(contact.b2));
      }
      EXPECT_EQ(brute.contacts(), pairs);
      touching += !pairs.empty();
    }
    fcl::DistanceResultd with_both;
    adaptive_bvh::distance(mesh.get(), this->beside_, &both, tf, fcl::DistanceRequestd(),
                           with_both);
    EXPECT_NEAR(BruteForce(*mesh, this->beside_, both, tf).distance(), with_both.min_distance,
                this->tolerance());
  }
  EXPECT_GT(touching, 0);
}

TEST_F(Deformable, IsRefusedWithWhatCannotBeAnswered) {
  const DeformableMesh mesh(this->sheet_);
  fcl::BVHModel<fcl::RSSd> plain;
  fcl::BVHModel<fcl::AABBd> aligned;
  fillModel(this->sheet_, plain);
  fillModel(this->sheet_, aligned);
  const AdaptiveBVHModel<fcl::RSSd> unbuilt;
  const fcl::CollisionGeometryd* const others[] = {&plain, &aligned, &unbuilt};
  for (const fcl::CollisionGeometryd* other : others)
    for (const bool is_first : {true, false}) {
      const fcl::CollisionGeometryd *a = &mesh, *b = other;
      if (!is_first) std::swap(a, b);
      fcl::DistanceResultd distance;
      fcl::CollisionResultd contacts;
      EXPECT_THROW(adaptive_bvh::distance(a, this->still_, b, this->still_, fcl::DistanceRequestd(),
                                          distance),
                   std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::collide(a, this->still_, b, this->still_, fcl::CollisionRequestd(),
                                         contacts),
                   std::invalid_argument);
    }
}

/// A result that brings a smaller distance keeps it, as in FCL; a mesh may meet itself elsewhere.
TEST_F(Deformable, FollowsFclsConventions) {
  const DeformableMesh mesh(this->sheet_);
  fcl::DistanceResultd smaller(0.01), own;
  adaptive_bvh::distance(&mesh, this->still_, &this->tool_, this->beside_, fcl::DistanceRequestd(),
                         smaller);
  EXPECT_EQ(0.01, smaller.min_distance);
  EXPECT_EQ(nullptr, smaller.o1);
  fcl::Transform3d above = this->still_;
  above.translation()[2] = 0.5;
  adaptive_bvh::distance(&mesh, this->still_, &mesh, above, fcl::DistanceRequestd(true), own);
  EXPECT_NEAR(0.5, own.min_distance, this->tolerance());
  EXPECT_EQ(
      "",
      BruteForce(mesh, this->still_, mesh, above).findError(own, this->still_, this->tolerance()));
  fcl::CollisionResultd none;
  EXPECT_EQ(
      0u, adaptive_bvh::collide(&mesh, this->still_, &mesh, above, fcl::CollisionRequestd(), none));
  fcl::CollisionResultd some;
  EXPECT_EQ(1u, adaptive_bvh::collide(&mesh, this->still_, &mesh, this->still_,
                                      fcl::CollisionRequestd(), some));
  EXPECT_EQ(0u, adaptive_bvh::collide(&mesh, this->still_, &mesh, this->still_,
                                      fcl::CollisionRequestd(0), none));
}

}  // namespace deformable_mesh_test
}  // namespace adaptive_bvh_test
