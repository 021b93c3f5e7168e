// In place of a fcl::BVHModel: FCL's calls, codes and habits, and what FCL would get wrong.
#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>

#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/narrowphase/continuous_collision.h>
#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/test_volume.h"
#include "support/trees.h"

namespace adaptive_bvh_test {
namespace drop_in_test {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::HierarchyStrategy;
using adaptive_bvh::RefitPolicy;
using Plain = PlainModel;
using Point = fcl::Vector3d;
using Positions = std::vector<Point>;
using Geometry = fcl::CollisionGeometryd;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

const fcl::Transform3d kIdentity = fcl::Transform3d::Identity();

/// FCL reports misuse on std::cerr; the tests misuse it on purpose.
class QuietFcl {
 public:
  QuietFcl() : saved_(std::cerr.rdbuf(sink_.rdbuf())) {}
  ~QuietFcl() { std::cerr.rdbuf(saved_); }

 private:
  std::ostringstream sink_;
  std::streambuf* saved_;
};

Positions moved(Positions positions, double by = 0.1) {
  for (std::size_t v = 0; v < positions.size(); ++v)
    positions[v] +=
        by * Point(std::sin(7. * double(v)), std::cos(3. * double(v)), std::sin(double(v)));
  return positions;
}

class DropIn : public testing::Test {
 protected:
  DropIn() : mesh_(plate(5, 4)), other_(tube(5, 5)) {
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh_, model_));
    EXPECT_EQ(fcl::BVH_OK, fillModel(other_, obstacle_));
    above_.translation() = Point(0, 0.3, 0.7);
  }

  void expectSound(const AdaptiveModel& model) {
    fcl::DistanceResultd result;
    const double asked =
        fcl::distance(&model, kIdentity, &obstacle_, above_, fcl::DistanceRequestd(), result);
    EXPECT_NEAR(BruteForce(model, kIdentity, obstacle_, above_).distance(), asked, 1e-12);
    std::string reason;
    EXPECT_TRUE(model.validate(&reason)) << reason;
  }

  void expectPositions(const AdaptiveModel& model, const Positions& positions) {
    ASSERT_EQ(int(positions.size()), model.num_vertices);
    for (std::size_t v = 0; v < positions.size(); ++v) EXPECT_EQ(positions[v], model.vertices[v]);
  }

  QuietFcl quiet_;
  TriangleMesh mesh_, other_;
  AdaptiveModel model_;
  Plain obstacle_;
  fcl::Transform3d above_ = kIdentity;
};

// ---- FCL's return codes -------------------------------------------------------------------------

/// beginModel on a model that is not empty leaves FCL's with arrays that the next beginModel leaks.
void freeWhatFclForgets(Plain& m) {
  if (m.build_state != fcl::BVH_BUILD_STATE_EMPTY) return;
  delete[] m.vertices;
  delete[] m.tri_indices;
  m.vertices = nullptr;
  m.tri_indices = nullptr;
}
void freeWhatFclForgets(AdaptiveModel&) {}  // ours forgets nothing

/// Calls out of order, in sequences that FCL survives: both types answer alike, step by step.
template <typename Model>
std::vector<int> codesOf(const std::vector<std::string>& calls, const TriangleMesh& mesh) {
  Model m;
  std::vector<int> codes;
  const Positions& v = mesh.vertices;
  const std::map<std::string, std::function<int()>> call = {
      {"beginModel",
       [&] {
         freeWhatFclForgets(m);
         return m.beginModel();
       }},
      {"addVertex", [&] { return m.addVertex(v[0]); }},
      {"addTriangle", [&] { return m.addTriangle(v[0], v[1], v[2]); }},
      {"addSubModel", [&] { return m.addSubModel(v, mesh.triangles); }},
      {"addPoints", [&] { return m.addSubModel(v); }},
      {"endModel", [&] { return m.endModel(); }},
      {"beginReplace", [&] { return m.beginReplaceModel(); }},
      {"replaceVertex", [&] { return m.replaceVertex(v[0]); }},
      {"replaceTriangle", [&] { return m.replaceTriangle(v[0], v[1], v[2]); }},
      {"replaceAll", [&] { return m.replaceSubModel(v); }},
      {"endReplace", [&] { return m.endReplaceModel(); }},
      {"endReplaceTopDown", [&] { return m.endReplaceModel(true, false); }},
      {"rebuild", [&] { return m.endReplaceModel(false); }},
      {"beginUpdate", [&] { return m.beginUpdateModel(); }},
      {"updateVertex", [&] { return m.updateVertex(v[0]); }},
      {"updateTriangle", [&] { return m.updateTriangle(v[0], v[1], v[2]); }},
      {"updateAll", [&] { return m.updateSubModel(v); }},
      {"endUpdate", [&] { return m.endUpdateModel(); }},
      {"endUpdateRebuild", [&] { return m.endUpdateModel(false); }}};
  for (const std::string& name : calls) codes.push_back(call.at(name)());
  codes.push_back(m.num_vertices);
  codes.push_back(m.num_tris);
  codes.push_back(m.build_state);
  return codes;
}

TEST_F(DropIn, ReturnsFclsCodesInAndOutOfOrder) {
  const std::vector<std::vector<std::string>> sequences = {
      {"beginModel", "addSubModel", "endModel"},
      {"beginModel", "addPoints", "endModel"},
      {"beginModel", "addTriangle", "addTriangle", "endModel"},
      {"beginModel", "endModel"},
      {"endModel"},
      {"addVertex"},
      {"beginReplace"},
      {"replaceVertex"},
      {"replaceTriangle"},
      {"replaceAll"},
      {"endReplace"},
      {"beginUpdate"},
      {"updateVertex"},
      {"updateTriangle"},
      {"updateAll"},
      {"endUpdate"},
      {"beginModel", "addSubModel", "endModel", "endModel"},
      {"beginModel", "addSubModel", "endModel", "addVertex"},
      {"beginModel", "addSubModel", "endModel", "addTriangle"},
      {"beginModel", "addSubModel", "endModel", "addSubModel"},
      {"beginModel", "addSubModel", "endModel", "beginModel"},
      {"beginModel", "addSubModel", "endModel", "beginModel", "beginModel", "addTriangle",
       "endModel"},
      {"beginModel", "beginModel", "beginModel", "addTriangle", "endModel"},
      {"beginModel", "addSubModel", "endModel", "beginReplace", "replaceAll", "endReplace"},
      {"beginModel", "addSubModel", "endModel", "beginReplace", "replaceAll", "endReplaceTopDown",
       "endReplace"},
      {"beginModel", "addSubModel", "endModel", "beginReplace", "replaceAll", "rebuild"},
      {"beginModel", "addSubModel", "endModel", "beginReplace", "beginReplace"},
      {"beginModel", "addSubModel", "endModel", "beginReplace", "updateVertex", "endUpdate"},
      {"beginModel", "addSubModel", "endModel", "beginReplace", "beginUpdate"},
      {"beginModel", "addSubModel", "endModel", "beginUpdate", "updateAll", "endUpdate"},
      {"beginModel", "addSubModel", "endModel", "beginUpdate", "updateAll", "endUpdateRebuild"},
      {"beginModel", "addSubModel", "endModel", "beginUpdate", "updateAll", "endUpdate",
       "beginReplace"},
      {"beginModel", "addSubModel", "endModel", "beginUpdate", "updateAll", "endUpdate",
       "beginUpdate", "updateAll", "endUpdate"},
      {"beginModel", "addSubModel", "endModel", "beginUpdate", "replaceVertex", "endReplace"},
  };
  for (const auto& sequence : sequences) {
    std::string name;
    for (const std::string& call : sequence) name += call + " ";
    EXPECT_EQ(codesOf<Plain>(sequence, mesh_), codesOf<AdaptiveModel>(sequence, mesh_)) << name;
  }
}

TEST_F(DropIn, RefusesWhatFclWouldWriteOutOfBounds) {
  AdaptiveModel empty;
  const Point& p = mesh_.vertices[0];
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, empty.addTriangle(p, p, p));
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, empty.addSubModel(mesh_.vertices));
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, empty.addSubModel(mesh_.vertices, mesh_.triangles));
  EXPECT_EQ(0, empty.num_vertices);

  for (bool by_triangles : {false, true}) {
    EXPECT_EQ(fcl::BVH_OK, model_.beginReplaceModel());
    EXPECT_EQ(fcl::BVH_OK, model_.replaceSubModel(moved(mesh_.vertices)));
    EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA,
              by_triangles ? model_.replaceTriangle(p, p, p) : model_.replaceVertex(p));
    EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.endReplaceModel());
    expectPositions(model_, mesh_.vertices);
    expectSound(model_);
  }
  EXPECT_EQ(fcl::BVH_OK, model_.beginUpdateModel());
  Positions too_many = mesh_.vertices;
  too_many.push_back(p);
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.updateSubModel(too_many));
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.endUpdateModel());
  expectPositions(model_, mesh_.vertices);
  expectSound(model_);
}

TEST_F(DropIn, RefusesTrianglesThatNameNoVertex) {
  AdaptiveModel model;
  EXPECT_EQ(fcl::BVH_OK, model.beginModel());
  EXPECT_EQ(fcl::BVH_OK, model.addSubModel(mesh_.vertices, {fcl::Triangle(0, 1, 5000)}));
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model.endModel());
}

TEST_F(DropIn, AFrameWithVerticesMissingLeavesTheOldOneAndCanBeCompleted) {
  const Positions next = moved(mesh_.vertices);
  const Positions first_half(next.begin(), next.begin() + 10), rest(next.begin() + 10, next.end());
  EXPECT_EQ(fcl::BVH_OK, model_.beginReplaceModel());
  EXPECT_EQ(fcl::BVH_OK, model_.replaceSubModel(first_half));
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.endReplaceModel());
  EXPECT_EQ(fcl::BVH_BUILD_STATE_PROCESSED, model_.build_state);
  expectPositions(model_, mesh_.vertices);
  expectSound(model_);

  EXPECT_EQ(fcl::BVH_OK, model_.replaceSubModel(rest)) << "as in FCL the rest may follow";
  EXPECT_EQ(fcl::BVH_OK, model_.endReplaceModel());
  expectPositions(model_, next);
  expectSound(model_);

  EXPECT_EQ(fcl::BVH_OK, model_.beginReplaceModel());
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.endReplaceModel());
  EXPECT_EQ(fcl::BVH_OK, model_.beginReplaceModel()) << "or one begins anew";
  EXPECT_EQ(fcl::BVH_OK, model_.replaceSubModel(next));
  EXPECT_EQ(fcl::BVH_OK, model_.endReplaceModel());
}

TEST_F(DropIn, PositionsThatAreNoNumbersAreRefusedWithoutATrace) {
  for (double bad : {kNan, kInf, -kInf, 1e200})
    for (int axis = 0; axis < 3; ++axis) {
      Positions next = moved(mesh_.vertices);
      next[7][axis] = bad;
      EXPECT_THROW(model_.update(next), std::invalid_argument);
      EXPECT_EQ(fcl::BVH_OK, model_.beginReplaceModel());
      EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.replaceSubModel(next));
      EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.endReplaceModel());
      EXPECT_EQ(fcl::BVH_OK, model_.beginUpdateModel());
      for (const Point& p : next)
        EXPECT_EQ(p.allFinite() && p.cwiseAbs().maxCoeff() < 1e100 && &p <= &next[7]
                      ? fcl::BVH_OK
                      : fcl::BVH_ERR_INCORRECT_DATA,
                  model_.updateVertex(p));
      EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, model_.endUpdateModel());
      EXPECT_EQ(nullptr, model_.prev_vertices);
      expectPositions(model_, mesh_.vertices);
      expectSound(model_);

      AdaptiveModel fresh;
      EXPECT_EQ(fcl::BVH_OK, fresh.beginModel());
      EXPECT_EQ(fcl::BVH_OK, fresh.addSubModel(next, mesh_.triangles));
      EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, fresh.endModel());
    }
  model_.update(moved(mesh_.vertices));
  expectSound(model_);
}

TEST_F(DropIn, UpdateThrowsASentence) {
  const auto message = [](const std::function<void()>& call) -> std::string {
    try {
      call();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  Positions short_frame(mesh_.vertices.begin(), mesh_.vertices.begin() + 3);
  EXPECT_NE(std::string::npos, message([&] { model_.update(short_frame); }).find("3 positions"));
  AdaptiveModel empty;
  EXPECT_NE(std::string::npos, message([&] { empty.update(Positions()); }).find("endModel"));
  RefitPolicy policy;
  policy.max_inflation = -1;
  EXPECT_NE(std::string::npos,
            message([&] { model_.setRefitPolicy(policy); }).find("max_inflation"));
  expectPositions(model_, mesh_.vertices);
}

TEST_F(DropIn, UpdateTakesMatricesAndMaps) {
  const std::size_t count = std::size_t(model_.num_vertices);
  std::vector<double> numbers, padded;
  for (std::size_t v = 0; v < count; ++v) {
    const Point p = model_.vertices[v] * 1.5 + Point(0, 0, 0.1 * double(v));
    for (double x : p) numbers.push_back(x);
    padded.insert(padded.end(), {p[0], p[1], p[2], -1});
  }
  const auto n = Eigen::Index(count);
  const auto expectTaken = [&](double z) {
    for (std::size_t v = 0; v < count; ++v)
      EXPECT_EQ(Point(numbers[3 * v], numbers[3 * v + 1], numbers[3 * v + 2] + z),
                model_.vertices[v]);
    EXPECT_TRUE(model_.validate());
  };
  const Eigen::Map<const Eigen::Matrix3Xd> columns(numbers.data(), 3, n);
  model_.update(columns);
  expectTaken(0);
  Eigen::Matrix3Xd matrix = columns;
  matrix.row(2).array() += 1;
  model_.update(matrix);
  expectTaken(1);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  model_.update(Eigen::Map<const RowMajor>(numbers.data(), n, 3).transpose());
  expectTaken(0);
  model_.update(columns.colwise() + Point(0, 0, 2));
  expectTaken(2);
  model_.update(Eigen::Map<const Eigen::Matrix3Xd, 0, Eigen::OuterStride<4>>(padded.data(), 3, n));
  expectTaken(0);
  EXPECT_THROW(model_.update(matrix.leftCols(n - 1)), std::invalid_argument);
  matrix(1, 2) = std::nan("");
  EXPECT_THROW(model_.update(matrix), std::invalid_argument);
  expectTaken(0);
}

/// A vertex is a column or a row, according to type or shape; other shapes are refused.
TEST_F(DropIn, UpdateTakesRowsAndColumns) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  const Positions next = moved(mesh_.vertices);
  const auto n = Eigen::Index(next.size());
  Eigen::MatrixXd columns(3, n);
  for (Eigen::Index v = 0; v < n; ++v) columns.col(v) = next[std::size_t(v)];
  const Eigen::MatrixXd rows = columns.transpose();
  const Eigen::MatrixXf singles = rows.cast<float>();
  const auto expectTaken = [&](double tolerance = 0) {
    for (std::size_t v = 0; v < next.size(); ++v)
      EXPECT_LE((next[v] - model_.vertices[v]).norm(), tolerance);
    expectSound(model_);
    model_.update(mesh_.vertices);
  };
  model_.update(columns);
  expectTaken();
  model_.update(rows);
  expectTaken();
  model_.update(Rows(rows));
  expectTaken();
  model_.update(RowMajor(rows));
  expectTaken();
  const std::vector<double> numbers(columns.data(), columns.data() + 3 * n);
  model_.update(Eigen::Map<const RowMajor>(numbers.data(), n, 3));
  expectTaken();
  model_.update(singles.cast<double>());
  expectTaken(1e-6);

  const auto message = [&](const auto& model, const auto& matrix) -> std::string {
    try {
      model->update(matrix);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(std::string::npos,
            message(&model_, Eigen::MatrixXd::Zero(4, n).eval()).find("4 x " + std::to_string(n)));

  // Three vertices: rows and columns look alike.
  AdaptiveModel triangle;
  triangle.beginModel();
  triangle.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  triangle.endModel();
  Eigen::MatrixXd square(3, 3);
  square << 1, 2, 3, 4, 5, 6, 7, 8, 10;
  EXPECT_NE(std::string::npos, message(&triangle, square).find("3 x 3"));
  EXPECT_NE(std::string::npos, message(&triangle, Eigen::Matrix3d(square)).find("3 x 3"));
  EXPECT_EQ(Point(1, 0, 0), triangle.vertices[1]);
  triangle.update(Eigen::Matrix3Xd(square));
  EXPECT_EQ(Point(2, 5, 8), triangle.vertices[1]);
  triangle.update(Rows(square));
  EXPECT_EQ(Point(4, 5, 6), triangle.vertices[1]);
}

TEST_F(DropIn, AnUnusableCoordinateIsNamed) {
  Positions next = moved(mesh_.vertices);
  next[7][1] = std::nan("");
  const auto message = [&](const std::function<void()>& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(std::string::npos, message([&] { model_.update(next); }).find("y of vertex 7 is nan"));
  EXPECT_NE(std::string::npos, message([&] {
                                 model_.update({3, 5}, {mesh_.vertices[3], Point(0, 0, 1e80)});
                               }).find("z of vertex 5 is 1"));
  expectPositions(model_, mesh_.vertices);
}

TEST_F(DropIn, UpdateAbandonsAFrameThatWasBegun) {
  EXPECT_EQ(fcl::BVH_OK, model_.beginReplaceModel());
  EXPECT_EQ(fcl::BVH_OK, model_.replaceVertex(Point(9, 9, 9)));
  const Positions next = moved(mesh_.vertices);
  model_.update(next);
  expectPositions(model_, next);
  expectSound(model_);
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, model_.replaceVertex(Point(9, 9, 9)));
}

// ---- what FCL leaves stale or moves -------------------------------------------------------------

TEST_F(DropIn, TheLocalAabbIsCurrentAfterEveryUpdate) {
  const auto expectCurrent = [](AdaptiveModel& model) {
    const fcl::AABBd box = model.aabb_local;
    const Point center = model.aabb_center;
    const double radius = model.aabb_radius;
    model.Plain::computeLocalAABB();  // FCL's, from the vertices
    EXPECT_EQ(model.aabb_local.min_, box.min_);
    EXPECT_EQ(model.aabb_local.max_, box.max_);
    EXPECT_EQ(model.aabb_center, center);
    EXPECT_DOUBLE_EQ(model.aabb_radius, radius);
  };
  expectCurrent(model_);
  model_.update(moved(mesh_.vertices, 3));
  expectCurrent(model_);
  model_.beginReplaceModel();
  model_.replaceSubModel(moved(mesh_.vertices, 1));
  model_.endReplaceModel();
  expectCurrent(model_);
  model_.beginReplaceModel();
  model_.replaceSubModel(moved(mesh_.vertices, 2));
  model_.endReplaceModel(false);
  expectCurrent(model_);
  model_.beginUpdateModel();
  model_.updateSubModel(moved(mesh_.vertices, 4));
  model_.endUpdateModel();
  expectCurrent(model_);
}

TEST_F(DropIn, ReplacingKeepsTheAddressOfTheVertices) {
  const Point* const address = model_.vertices;
  model_.update(moved(mesh_.vertices));
  model_.beginReplaceModel();
  model_.replaceSubModel(mesh_.vertices);
  model_.endReplaceModel();
  EXPECT_EQ(address, model_.vertices);
}

TEST_F(DropIn, ATwoFrameUpdateHoldsBothFramesAndUpdateEndsIt) {
  Positions next = mesh_.vertices;
  for (int frame = 0; frame < 6; ++frame) {
    const Positions last = next;
    next = moved(next, 0.2);
    EXPECT_EQ(fcl::BVH_OK, model_.beginUpdateModel());
    EXPECT_EQ(fcl::BVH_OK, model_.updateSubModel(next));
    EXPECT_EQ(fcl::BVH_OK, model_.endUpdateModel(frame != 3));
    EXPECT_EQ(fcl::BVH_BUILD_STATE_UPDATED, model_.build_state);
    expectPositions(model_, next);
    for (std::size_t v = 0; v < last.size(); ++v) EXPECT_EQ(last[v], model_.prev_vertices[v]);
    expectSound(model_);  // validate() looks at both frames here
  }
  model_.update(mesh_.vertices);
  EXPECT_EQ(nullptr, model_.prev_vertices);
  EXPECT_EQ(fcl::BVH_BUILD_STATE_PROCESSED, model_.build_state);
  expectSound(model_);
}

// FCL's rule cuts a volume at the mean of its triangles' centres: so with our volumes, FCL itself
// makes the same tree.
TEST_F(DropIn, TopDownIsFclsOwnTreeAndARebuildMakesANewOne) {
  const Positions start = moved(mesh_.vertices);  // no two directions spread alike: one split only
  Positions rolled = start;
  for (Point& p : rolled) p = Point(0.4 * std::cos(5 * p[0]), p[1], 0.4 * std::sin(5 * p[0]));
  AdaptiveModel model(HierarchyStrategy::TopDown);
  Plain at_start, at_end;
  at_start.bv_fitter = at_end.bv_fitter = model.bv_fitter;
  fillModel(TriangleMesh{start, mesh_.triangles}, model);
  fillModel(TriangleMesh{start, mesh_.triangles}, at_start);
  fillModel(TriangleMesh{rolled, mesh_.triangles}, at_end);
  EXPECT_EQ(groupsOf(at_start), groupsOf(model));

  model.update(rolled);
  EXPECT_EQ(groupsOf(at_start), groupsOf(model));
  model.beginReplaceModel();
  model.replaceSubModel(rolled);
  EXPECT_EQ(fcl::BVH_OK, model.endReplaceModel(false));
  EXPECT_TRUE(model.lastUpdate().resynchronised);
  EXPECT_EQ(groupsOf(at_end), groupsOf(model));
  EXPECT_NE(groupsOf(at_start), groupsOf(model));
  expectSound(model);
}

// ---- copies -------------------------------------------------------------------------------------

static_assert(!std::is_copy_assignable<AdaptiveModel>::value, "FCL's assignment is shallow");
static_assert(std::is_copy_constructible<AdaptiveModel>::value, "copies are deep");
static_assert(std::is_nothrow_move_constructible<AdaptiveModel>::value &&
                  std::is_nothrow_move_assignable<AdaptiveModel>::value,
              "containers may move models");

TEST_F(DropIn, CopiesAreDeep) {
  model_.update(moved(mesh_.vertices));
  AdaptiveModel copy(model_);
  EXPECT_NE(copy.vertices, model_.vertices);
  EXPECT_EQ(copy.refitPolicy().criterion, model_.refitPolicy().criterion);
  const Positions kept = moved(mesh_.vertices);
  model_.update(moved(mesh_.vertices, 2));
  expectPositions(copy, kept);
  expectSound(copy);
  copy.update(mesh_.vertices);
  EXPECT_FALSE(copy.lastUpdate().resynchronised) << "the copy goes on from the original's state";
  expectPositions(model_, moved(mesh_.vertices, 2));
  expectSound(copy);
  expectSound(model_);
}

TEST_F(DropIn, MovesTakeEverythingAlong) {
  model_.update(moved(mesh_.vertices));
  const Point* const vertices = model_.vertices;
  const auto* const root = &model_.getBV(0);
  const int refits = model_.lastUpdate().refitted();
  AdaptiveModel to(std::move(model_));
  EXPECT_EQ(vertices, to.vertices) << "nothing is copied";
  EXPECT_EQ(root, &to.getBV(0));
  EXPECT_EQ(refits, to.lastUpdate().refitted());
  expectSound(to);
  to.update(moved(mesh_.vertices, 2));
  EXPECT_FALSE(to.lastUpdate().resynchronised) << "it tracks on";
  expectSound(to);

  // What was moved from is empty, and can be built anew.
  EXPECT_EQ(nullptr, model_.vertices);  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(fcl::BVH_BUILD_STATE_EMPTY, model_.build_state);
  EXPECT_EQ(fcl::BV_UNKNOWN, model_.getNodeType());
  EXPECT_THROW(model_.update(mesh_.vertices), std::logic_error);
  fillModel(mesh_, model_);
  expectSound(model_);

  // Assignment frees what was there.
  model_ = std::move(to);
  EXPECT_EQ(vertices, model_.vertices);
  expectSound(model_);
  std::vector<AdaptiveModel> models;
  for (int i = 0; i < 5; ++i) {
    models.emplace_back();
    fillModel(mesh_, models.back());
  }
  for (AdaptiveModel& model : models) expectSound(model);
  models.erase(models.begin());
  for (AdaptiveModel& model : models) expectSound(model);
}

TEST_F(DropIn, ACopyOfAPlainModelIsRepairedOnTheWay) {
  Plain plain;
  fillModel(mesh_, plain);
  plain.beginReplaceModel();
  plain.replaceSubModel(moved(mesh_.vertices));
  plain.endReplaceModel();  // FCL's wrong default
  AdaptiveModel model(plain);
  expectSound(model);
  model.update(mesh_.vertices);
  expectSound(model);
  const Plain sliced(model);  // and back
  EXPECT_EQ(model.getNumBVs(), sliced.getNumBVs());
}

// ---- the mesh for the library's own queries
// ------------------------------------------------------

/// Expects a mesh with the model's positions, triangles and frames, that answers as brute force.
void expectMesh(AdaptiveModel& model) {
  const adaptive_bvh::DeformableMesh& mesh = std::as_const(model).mesh();
  const auto count = std::size_t(model.num_vertices);
  EXPECT_EQ(Positions(model.vertices, model.vertices + count), mesh.vertices());
  ASSERT_EQ(std::size_t(model.num_tris), mesh.triangles().size());
  for (int t = 0; t < model.num_tris; ++t)
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(model.tri_indices[t][k], mesh.triangles()[std::size_t(t)][k]);
  if (model.prev_vertices)
    EXPECT_EQ(Positions(model.prev_vertices, model.prev_vertices + count), mesh.previousVertices());
  else
    EXPECT_TRUE(mesh.previousVertices().empty());
  std::string reason;
  EXPECT_TRUE(mesh.validate(&reason)) << reason;
  const adaptive_bvh::DeformableMesh tool(tube(5, 5));
  fcl::Transform3d above = kIdentity;
  above.translation() = Point(0, 0.3, 0.7);
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&mesh, kIdentity, &tool, above, fcl::DistanceRequestd(), result);
  EXPECT_NEAR(BruteForce(model, kIdentity, tool, above).distance(), result.min_distance, 1e-12);
}

TEST_F(DropIn, TheMeshIsMadeOnceAndFollowsEveryUpdate) {
  EXPECT_FALSE(model_.hasMesh());
  EXPECT_THROW(std::as_const(model_).mesh(), std::logic_error);
  const adaptive_bvh::DeformableMesh* const mesh = &model_.mesh();
  EXPECT_TRUE(model_.hasMesh());
  expectMesh(model_);
  model_.update(moved(mesh_.vertices));
  expectMesh(model_);
  model_.update(std::vector<unsigned>{3, 8}, {Point(0.1, 0.2, 0.5), Point(0.7, 0.1, -0.2)});
  expectMesh(model_);
  model_.beginReplaceModel();
  model_.replaceSubModel(moved(mesh_.vertices, 0.2));
  EXPECT_EQ(fcl::BVH_OK, model_.endReplaceModel());
  expectMesh(model_);
  for (int frame = 0; frame < 3; ++frame) {
    model_.beginUpdateModel();
    model_.updateSubModel(moved(mesh_.vertices, 0.1 * frame));
    EXPECT_EQ(fcl::BVH_OK, model_.endUpdateModel());
    expectMesh(model_);
  }
  model_.update(mesh_.vertices);
  expectMesh(model_);
  Positions broken = moved(mesh_.vertices);
  broken[7][2] = kNan;
  EXPECT_THROW(model_.update(broken), std::invalid_argument);
  expectMesh(model_);
  EXPECT_EQ(mesh, &model_.mesh()) << "its address stays";
  expectSound(model_);
}

TEST_F(DropIn, AModelThatIsNotBuiltHasNoMesh) {
  AdaptiveModel empty, cloud;
  EXPECT_THROW(empty.mesh(), std::logic_error);
  cloud.beginModel();
  cloud.addSubModel(mesh_.vertices);
  cloud.endModel();
  EXPECT_THROW(cloud.mesh(), std::logic_error);
  EXPECT_FALSE(empty.hasMesh() || cloud.hasMesh());
}

/// Changes that bypass the adaptive update: the mesh has the new triangles and positions after a
/// call of the non-const mesh().
TEST_F(DropIn, TheMeshFollowsRebuildsAndChangesThroughTheBase) {
  model_.mesh();
  model_.beginReplaceModel();
  model_.replaceSubModel(moved(mesh_.vertices));
  EXPECT_EQ(fcl::BVH_OK, model_.endReplaceModel(false));
  model_.mesh();
  expectMesh(model_);
  Plain& base = model_;
  base.beginReplaceModel();
  base.replaceSubModel(moved(mesh_.vertices, 0.3));
  base.endReplaceModel();
  model_.update(moved(mesh_.vertices, 0.2));
  model_.mesh();
  expectMesh(model_);
  const TriangleMesh other = dome(7, 3);
  fillModel(other, model_);
  model_.mesh();
  expectMesh(model_);
  AdaptiveModel moved_to(std::move(model_));
  moved_to.mesh();
  expectMesh(moved_to);
  AdaptiveModel copy(moved_to);
  copy.mesh();
  copy.update(moved(other.vertices));
  expectMesh(copy);
  expectMesh(moved_to);
}

// ---- changes through a reference to the base ----------------------------------------------------

struct Mutation {
  const char* name;
  std::function<void(Plain&, const Positions& same, const Positions& other)> apply;
};

void replace(Plain& m, const Positions& p, bool refit, bool bottomup) {
  m.beginReplaceModel();
  m.replaceSubModel(p);
  m.endReplaceModel(refit, bottomup);
}
void update(Plain& m, const Positions& p, bool refit, bool bottomup) {
  m.beginUpdateModel();
  m.updateSubModel(p);
  m.endUpdateModel(refit, bottomup);
}

const std::vector<Mutation>& mutations() {
  static const std::vector<Mutation> list = {
      {"replace bottom-up", [](Plain& m, auto&, auto& p) { replace(m, p, true, true); }},
      {"replace top-down", [](Plain& m, auto&, auto& p) { replace(m, p, true, false); }},
      {"replace rebuild", [](Plain& m, auto&, auto& p) { replace(m, p, false, true); }},
      {"replace same bottom-up", [](Plain& m, auto& p, auto&) { replace(m, p, true, true); }},
      {"replace same top-down", [](Plain& m, auto& p, auto&) { replace(m, p, true, false); }},
      {"replace same rebuild", [](Plain& m, auto& p, auto&) { replace(m, p, false, true); }},
      {"update bottom-up", [](Plain& m, auto&, auto& p) { update(m, p, true, true); }},
      {"update top-down", [](Plain& m, auto&, auto& p) { update(m, p, true, false); }},
      {"update rebuild", [](Plain& m, auto&, auto& p) { update(m, p, false, true); }},
      {"update same bottom-up", [](Plain& m, auto& p, auto&) { update(m, p, true, true); }},
      {"update same top-down", [](Plain& m, auto& p, auto&) { update(m, p, true, false); }},
      {"update same rebuild", [](Plain& m, auto& p, auto&) { update(m, p, false, true); }},
      {"update twice",
       [](Plain& m, auto& q, auto& p) {
         update(m, p, true, true);
         update(m, q, true, true);
       }},
      {"replace with FCL's own fitter",
       [](Plain& m, auto& p, auto&) {
         m.bv_fitter.reset(new fcl::detail::BVFitter<TestVolume<double>>());
         replace(m, p, true, false);
       }},
      {"build anew",
       [](Plain& m, auto&, auto& p) {
         const std::vector<fcl::Triangle> triangles(m.tri_indices, m.tri_indices + m.num_tris);
         m.beginModel();
         freeWhatFclForgets(m);
         m.beginModel();
         m.addSubModel(p, triangles);
         m.endModel();
       }},
      {"build another mesh",
       [](Plain& m, auto&, auto&) {
         const TriangleMesh mesh = dome(7, 3);
         m.beginModel();
         freeWhatFclForgets(m);
         m.beginModel();
         m.addSubModel(mesh.vertices, mesh.triangles);
         m.endModel();
       }},
      {"generateBVHModel",
       [](Plain& m, auto&, auto&) {
         m.beginModel();
         freeWhatFclForgets(m);
         fcl::generateBVHModel(m, fcl::Sphered(0.4), kIdentity, 6, 6);
       }},
  };
  return list;
}

TEST_F(DropIn, NoticesChangesMadeThroughTheBase) {
  for (const Mutation& mutation : mutations())
    for (bool inflated : {false, true}) {
      SCOPED_TRACE(mutation.name);
      RefitPolicy none;
      none.criterion = FitnessCriterion::RefitNone;
      AdaptiveModel model(none);
      fillModel(mesh_, model);
      const Positions start = inflated ? moved(mesh_.vertices, 0.3) : mesh_.vertices;
      if (inflated) model.update(start);  // nodes far from a fresh fit, the root included

      mutation.apply(model, start, moved(start, 0.2));
      AdaptiveModel copy(model);
      expectSound(model);  // by the next query, on its own
      expectSound(copy);

      AdaptiveModel again(none);
      fillModel(mesh_, again);
      if (inflated) again.update(start);
      mutation.apply(again, start, moved(start, 0.2));
      Positions next(again.vertices, again.vertices + again.num_vertices);
      next = moved(next, 0.1);
      again.update(next);  // by the next update, without a query in between
      // generateBVHModel ends with computeLocalAABB, a virtual call: repaired by then.
      EXPECT_NE(again.lastUpdate().resynchronised,
                mutation.name == std::string("generateBVHModel"));
      expectPositions(again, next);
      expectSound(again);
      again.update(moved(next, 0.1));
      EXPECT_FALSE(again.lastUpdate().resynchronised);
      expectSound(again);
    }
}

/// FCL's own calls on models in single precision, judged by their meshes, which are in double.
TEST(DropInFloat, AnswersFclsCalls) {
  std::mt19937 random(testSeed(15));
  adaptive_bvh::AdaptiveBVHModel<TestVolume<float>> sheet, ball;
  fillModel(plate(5, 4), sheet);
  fillModel(dome(8, 3), ball);
  Deformation deformation(plate(5, 4), Deformation::Kind::Smooth, 7);
  sheet.mesh();
  const auto& of_ball = ball.mesh();
  const fcl::Transform3f still = fcl::Transform3f::Identity();
  const fcl::CollisionGeometryf &a = sheet, &b = ball;
  int touching = 0;
  for (int frame = 0; frame < 20; ++frame) {
    sheet.update(pointsIn<float>(deformation.next()));
    const fcl::Transform3f tf = randomPose(random, 0.6).cast<float>();
    const BruteForce brute(sheet.mesh(), still.cast<double>(), of_ball, tf.cast<double>());
    fcl::DistanceResultf distance;
    fcl::distance(&a, still, &b, tf, fcl::DistanceRequestf(), distance);
    EXPECT_NEAR(brute.distance(), std::max(0.f, distance.min_distance), 1e-5) << frame;
    fcl::CollisionResultf contacts;
    fcl::collide(&a, still, &b, tf, fcl::CollisionRequestf(), contacts);
    const bool touches = !brute.contacts().empty();
    if (brute.distance() == 0 || brute.distance() > 1e-5) {
      EXPECT_EQ(touches, contacts.isCollision());
    }
    touching += touches;
  }
  EXPECT_GT(touching, 2);
  EXPECT_LT(touching, 18);
}

/// The change detector in single precision, where one step of the radius is 1e-7 of it.
TEST(DropInFloat, NoticesChangesMadeThroughTheBase) {
  const TriangleMesh mesh = plate(5, 4);
  for (bool same : {false, true})
    for (bool refit : {false, true})
      for (bool bottomup : {false, true}) {
        adaptive_bvh::AdaptiveBVHModel<TestVolume<float>> model;
        fillModel(mesh, model);
        Deformation deformation(mesh, Deformation::Kind::Smooth, 6);
        model.update(pointsIn<float>(deformation.next()));
        fcl::BVHModel<TestVolume<float>>& base = model;
        base.beginReplaceModel();
        base.replaceSubModel(pointsIn<float>(same ? deformation.positions() : deformation.next()));
        base.endReplaceModel(refit, bottomup);
        model.update(pointsIn<float>(deformation.next()));
        EXPECT_TRUE(model.lastUpdate().resynchronised);
        std::string reason;
        EXPECT_TRUE(model.validate(&reason)) << reason;
      }
}

TEST_F(DropIn, NoticesFclsOwnPolynomialContinuousCollision) {
  Positions next = mesh_.vertices;
  for (int frame = 0; frame < 5; ++frame) {
    fcl::Transform3d end = kIdentity;
    end.translation() = Point(0.1, 0.2, -1.5);
    fcl::ContinuousCollisionRequestd request(10, 1e-4, fcl::CCDM_LINEAR, fcl::GST_LIBCCD,
                                             fcl::CCDC_POLYNOMIAL_SOLVER);
    fcl::ContinuousCollisionResultd result;
    AdaptiveModel other;
    fillModel(other_, other);
    fcl::continuousCollide<double>(&model_, kIdentity, kIdentity, &other, above_, end, request,
                                   result);
    expectSound(model_);
    next = moved(mesh_.vertices, 0.05 * frame);
    model_.update(next);
    expectPositions(model_, next);
    expectSound(model_);
  }
}

TEST_F(DropIn, RecoversFromPositionsThatWereNoNumbersInTheBase) {
  Positions broken = mesh_.vertices;
  broken[3][1] = kNan;
  replace(model_, broken, true, true);
  model_.update(moved(mesh_.vertices));
  expectSound(model_);
  model_.update(mesh_.vertices);
  EXPECT_FALSE(model_.lastUpdate().resynchronised);
  expectSound(model_);
}

// ---- unusual meshes -----------------------------------------------------------------------------

TEST_F(DropIn, AnEmptyModelIsHarmless) {
  AdaptiveModel empty;
  EXPECT_TRUE(empty.validate());
  EXPECT_EQ(fcl::BV_UNKNOWN, empty.getNodeType());
  EXPECT_EQ(0, empty.lastUpdate().nodes);
  empty.computeLocalAABB();
  const AdaptiveModel copy(empty);
  fcl::DistanceResultd result;
  EXPECT_EQ(std::numeric_limits<double>::max(),
            fcl::distance(&empty, kIdentity, &obstacle_, above_, fcl::DistanceRequestd(), result))
      << "FCL: not supported; it crashes on an empty model of its own";
  EXPECT_THROW(adaptive_bvh::distance(&empty, kIdentity, &obstacle_, above_,
                                      fcl::DistanceRequestd(), result),
               std::invalid_argument);
}

TEST_F(DropIn, APointCloudIsBuiltAndUpdated) {
  AdaptiveModel cloud;
  EXPECT_EQ(fcl::BVH_OK, cloud.beginModel());
  EXPECT_EQ(fcl::BVH_OK, cloud.addSubModel(mesh_.vertices));
  EXPECT_EQ(fcl::BVH_OK, cloud.endModel());
  for (int frame = 0; frame < 5; ++frame) {
    cloud.update(moved(mesh_.vertices, 0.1 * frame));
    std::string reason;
    EXPECT_TRUE(cloud.validate(&reason)) << reason;
  }
  EXPECT_EQ(fcl::BV_UNKNOWN, cloud.getNodeType());
  fcl::CollisionResultd result;
  EXPECT_THROW(adaptive_bvh::collide(&cloud, kIdentity, &obstacle_, above_,
                                     fcl::CollisionRequestd(), result),
               std::invalid_argument);
}

TEST_F(DropIn, OddTrianglesAreFine) {
  const Point a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const std::vector<TriangleMesh> meshes = {
      {{a, b, c}, {fcl::Triangle(0, 1, 2)}},                                   // one
      {{a, b, c}, std::vector<fcl::Triangle>(9, fcl::Triangle(0, 1, 2))},      // duplicates
      {{a, b, c}, {fcl::Triangle(0, 0, 0), fcl::Triangle(0, 1, 1)}},           // degenerate
      {{a, a, a, b, b, b}, {fcl::Triangle(0, 1, 2), fcl::Triangle(3, 4, 5)}},  // points
      {{a, b, c, Point(50, 0, 0)}, {fcl::Triangle(0, 1, 2)}},                  // unused vertex
  };
  for (const auto& mesh : meshes) {
    AdaptiveModel model;
    ASSERT_EQ(fcl::BVH_OK, fillModel(mesh, model));
    for (int frame = 0; frame < 6; ++frame) {
      model.update(moved(mesh.vertices, 0.1 * (frame % 3)));
      expectSound(model);
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&model, kIdentity, &obstacle_, above_, fcl::DistanceRequestd(),
                             result);
    }
  }
  AdaptiveModel unused;
  fillModel(meshes.back(), unused);
  EXPECT_EQ(50, unused.aabb_local.max_[0]) << "as in FCL";
}

TEST_F(DropIn, WorksWithTheUsersOwnSplitterAndFitter) {
  for (auto method : {fcl::detail::SPLIT_METHOD_MEAN, fcl::detail::SPLIT_METHOD_MEDIAN,
                      fcl::detail::SPLIT_METHOD_BV_CENTER}) {
    AdaptiveModel model;
    model.bv_splitter.reset(new fcl::detail::BVSplitter<TestVolume<double>>(method));
    model.bv_fitter.reset(new fcl::detail::BVFitter<TestVolume<double>>());
    ASSERT_EQ(fcl::BVH_OK, fillModel(mesh_, model));
    expectSound(model);
    model.update(moved(mesh_.vertices));
    expectSound(model);
  }
}

TEST_F(DropIn, ReportsWhatAnUpdateDid) {
  EXPECT_TRUE(model_.lastUpdate().resynchronised) << "a build";
  const auto& report = model_.update(moved(mesh_.vertices, 0.01));
  EXPECT_EQ(&report, &model_.lastUpdate());
  EXPECT_EQ(model_.getNumBVs(), report.nodes);
  EXPECT_EQ(report.nodes, report.moved);
  EXPECT_EQ(report.nodes, report.inflated);
  EXPECT_GT(report.largest_displacement, 0.005);
  EXPECT_LT(report.largest_displacement, 0.02);
  EXPECT_GT(report.seconds(), 0);
  model_.update(moved(mesh_.vertices, 0.01));
  EXPECT_EQ(0, model_.lastUpdate().largest_displacement);
  EXPECT_EQ(0, model_.lastUpdate().moved) << "nothing moved";
  EXPECT_EQ(0, model_.lastUpdate().inflated);
  EXPECT_GT(model_.trackingBytes(), sizeof(double) * std::size_t(model_.getNumBVs()));
}

}  // namespace drop_in_test
}  // namespace adaptive_bvh_test
