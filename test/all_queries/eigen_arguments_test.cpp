// What calls take: matrices in place of vectors of points, rows in place of points, and 0 in place
// of a number. The answers are those of vectors.
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <utility>

#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/scene.h"
#include "support/closed_bodies.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace eigen_arguments_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Motion;

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

Matrix rowsOf(const std::vector<fcl::Vector3d>& points) {
  Matrix rows(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) rows.row(Eigen::Index(i)) = points[i].transpose();
  return rows;
}

class EigenArguments : public testing::Test {
 protected:
  DeformableMesh body_{gridBall(8, 5)};
  std::vector<fcl::Vector3d> start_ = body_.vertices(), end_ = moved(start_);

  static std::vector<fcl::Vector3d> moved(std::vector<fcl::Vector3d> points) {
    for (fcl::Vector3d& p : points) p = fcl::Vector3d(0.1 * p[0], p[1] + 0.25, -2. * p[2]);
    return points;
  }
};

/// Layouts of the same numbers: calls check(matrix) for each.
template <typename Check>
void inEachLayout(const std::vector<fcl::Vector3d>& points, const Check& check) {
  const Matrix rows = rowsOf(points);
  check(rows);
  check(Matrix(rows.transpose()));
  check(RowMajor(rows));
  check(Eigen::Matrix<double, 3, Eigen::Dynamic>(rows.transpose()));
  check(
      Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>(points[0].data(), 3, rows.rows()));
  check(2 * rows - rows);
  check(rows.transpose());
  Matrix wide = Matrix::Constant(rows.rows() + 4, 7, 99);
  wide.block(2, 1, rows.rows(), 3) = rows;
  check(wide.block(2, 1, rows.rows(), 3));
}

TEST_F(EigenArguments, MotionsCopyMatrices) {
  const Motion expected(this->body_, this->start_, this->end_);
  const double impact = selfEarliestImpact(expected).time;
  ASSERT_GT(impact, 0);
  ASSERT_LT(impact, 1);
  std::unique_ptr<Motion> kept;
  inEachLayout(this->end_, [&](const auto& end) {
    const Motion motion(this->body_, rowsOf(this->start_), end);
    EXPECT_EQ(impact, selfEarliestImpact(motion).time);
    kept = std::make_unique<Motion>(this->body_, rowsOf(this->start_), end);
  });
  const Motion copy = *kept;  // shares the positions
  kept.reset();
  EXPECT_EQ(impact, selfEarliestImpact(copy).time);
  EXPECT_EQ(this->end_.back(), copy.end[this->end_.size() - 1]);

  const auto refuses = [&](const auto& from, const auto& to) {
    EXPECT_THROW(Motion(this->body_, from, to), std::invalid_argument);
  };
  const Matrix rows = rowsOf(this->start_);
  refuses(rows, Matrix(rows.topRows(rows.rows() - 1)));
  refuses(Matrix(rows.topRows(5)), Matrix(rows.topRows(5)));
  refuses(Matrix(rows.leftCols(2)), rows);
}

TEST_F(EigenArguments, TwoFrameUpdatesTakeMatrices) {
  inEachLayout(this->end_, [&](const auto& end) {
    this->body_.update(this->start_);
    this->body_.updateTwoFrames(end);
    EXPECT_EQ(this->start_, this->body_.previousVertices());
    EXPECT_EQ(this->end_, this->body_.vertices());
  });
  EXPECT_THROW(this->body_.updateTwoFrames(rowsOf(this->end_).topRows(7)), std::invalid_argument);
  EXPECT_THROW(this->body_.updateTwoFrames(Matrix(rowsOf(this->end_).leftCols(2))),
               std::invalid_argument);
  EXPECT_EQ(this->end_, this->body_.vertices());
}

TEST_F(EigenArguments, PointsAndRays) {
  const DeformableMesh& mesh = this->body_;
  std::vector<fcl::Vector3d> along;
  for (const fcl::Vector3d& p : this->end_) along.push_back(fcl::Vector3d(0.3, 0.1, 0) - p);
  std::vector<adaptive_bvh::ClosestPoint> nearest, nearest_of_matrix;
  std::vector<adaptive_bvh::ClosestFeature> features, features_of_matrix;
  std::vector<double> distances, distances_of_matrix, windings, windings_of_matrix;
  std::vector<adaptive_bvh::RayHit> hits, hits_of_matrix;
  std::vector<std::uint8_t> met, met_of_matrix;
  closestPoints(mesh, this->end_, nearest);
  closestFeatures(mesh, this->end_, 1, features);
  signedDistances(mesh, this->end_, distances);
  windingNumbers(mesh, this->end_, windings);
  firstHits(mesh, this->end_.data(), along.data(), along.size(), hits);
  anyHits(mesh, this->end_, along, {0, 0.5}, met);
  inEachLayout(this->end_, [&](const auto& points) {
    closestPoints(mesh, points, nearest_of_matrix);
    closestFeatures(mesh, points, 1, features_of_matrix);
    signedDistances(mesh, points, distances_of_matrix);
    windingNumbers(mesh, points, windings_of_matrix);
    firstHits(mesh, points, rowsOf(along), hits_of_matrix);
    anyHits(mesh, points, along, {0, 0.5}, met_of_matrix);
    ASSERT_EQ(nearest.size(), nearest_of_matrix.size());
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      EXPECT_EQ(nearest[i].point, nearest_of_matrix[i].point);
      EXPECT_EQ(features[i].number, features_of_matrix[i].number);
      EXPECT_EQ(hits[i].t, hits_of_matrix[i].t);
    }
    EXPECT_EQ(distances, distances_of_matrix);
    EXPECT_EQ(windings, windings_of_matrix);
    EXPECT_EQ(met, met_of_matrix);
  });
  closestPoints(mesh, {this->end_[3], -this->end_[4]}, nearest_of_matrix);
  ASSERT_EQ(2u, nearest_of_matrix.size());
  EXPECT_EQ(nearest[3].point, nearest_of_matrix[0].point);
  closestPoints(mesh, {this->end_[3]}, nearest_of_matrix);
  ASSERT_EQ(1u, nearest_of_matrix.size());
  EXPECT_EQ(nearest[3].point, nearest_of_matrix[0].point);
  const Matrix rows = rowsOf(this->end_);
  EXPECT_EQ(nearest[3].point, closestPoint(mesh, rows.row(3)).point);
  EXPECT_EQ(hits[3].t, firstHit(mesh, rows.row(3), rowsOf(along).row(3)).t);
  EXPECT_THROW(firstHits(mesh, rows, rows.topRows(3), hits), std::invalid_argument);
  EXPECT_THROW(closestPoints(mesh, Matrix(rows.leftCols(2)), nearest), std::invalid_argument);
  const Matrix square = Matrix::Identity(3, 3);
  EXPECT_THROW(closestPoints(mesh, square, nearest), std::invalid_argument);
  closestPoints(mesh, RowMajor(square), nearest);
  EXPECT_EQ(3u, nearest.size());

  adaptive_bvh::Scene scene;
  scene.add(mesh);
  scene.update();
  std::vector<adaptive_bvh::SceneRayHit> of_scene;
  scene.firstHits(rows, along, of_scene);
  ASSERT_EQ(hits.size(), of_scene.size());
  EXPECT_EQ(hits[3].t, of_scene[3].t);
}

/// An int is taken for the number.
TEST_F(EigenArguments, NumbersMayBeWrittenAsIntegers) {
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  const DeformableMesh other(gridBall(6, 4));
  const fcl::Sphered ball(1);
  adaptive_bvh::VertexContacts contacts, of_other;
  EXPECT_GT(vertexContacts(this->body_, origin, ball, origin, 0, contacts) + 1, 0u);
  vertexContacts(this->body_, origin, other, origin, 0, contacts);
  vertexContacts(this->body_, origin, other, origin, 0, contacts, of_other);
  EXPECT_LT(signedDistance(this->body_, origin, other, origin, 1).lower, 0);
  EXPECT_LT(signedDistance(this->body_, origin, ball, origin, 1).lower, 0);
  EXPECT_TRUE(isNearer(this->body_, origin, other, origin, 1));
  EXPECT_TRUE(isNearer(this->body_, origin, ball, origin, 1));
  adaptive_bvh::FeaturePairs pairs;
  EXPECT_EQ(0u, selfFeaturePairsWithin(this->body_, 0, pairs));
  featurePairsWithin(this->body_, origin, other, origin, 0, pairs);
  std::vector<double> clearances;
  vertexDistances(this->body_, origin, other, origin, 1, clearances);
  signedVertexDistances(this->body_, origin, other, origin, 1, clearances);
  EXPECT_EQ(this->start_.size(), clearances.size());
  TriangleMesh mesh = gridBall(4, 3);
  weldVertices(mesh, 0);
}

}  // namespace eigen_arguments_test
}  // namespace adaptive_bvh_test
