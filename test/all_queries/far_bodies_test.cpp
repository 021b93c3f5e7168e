// Bodies that are apart: what a distance prunes by along a line, against distances in long double;
// and that the work of a query does not grow with how far apart flat parts are.
#include <gtest/gtest.h>

#include <cmath>

#include "adaptive_bvh/proximity.h"
#include "dispatch/shape_search.h"
#include "query/nearest/nearest_search.h"
#include "query/points/point_search.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace far_bodies_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::DistanceQuery;
using adaptive_bvh::Gaps4x4;
using adaptive_bvh::LineView;
using adaptive_bvh::LocalBoxes;
using adaptive_bvh::MeshShapeSearch;
using adaptive_bvh::NearestPair;
using adaptive_bvh::NearestSearch;
using adaptive_bvh::PlacedMesh;
using adaptive_bvh::PointPair;
using adaptive_bvh::PointSearch;
using adaptive_bvh::RelativePlacement;
using adaptive_bvh::ShapeSearch;
using adaptive_bvh::TreePair;
using adaptive_bvh::WideNode;
using exact::Real;
using Mesh = TriangleMesh;
using Transform = fcl::Transform3d;

/// Two meshes, placed.
struct Parts {
  Mesh first, second;
  Transform tf1 = Transform::Identity(), tf2 = Transform::Identity();
};

struct Answer {
  double distance;
  long work;  ///< tests of boxes and of triangles
};

Answer askedOf(const Parts& parts) {
  const DeformableMesh mesh1(parts.first), mesh2(parts.second);
  const PlacedMesh first(mesh1, parts.tf1), second(mesh2, parts.tf2);
  const fcl::DistanceRequestd request(true);
  fcl::DistanceResultd result;
  NearestPair nearest(first, second, {request, result});
  NearestSearch search(first, second, nearest);
  search.run();
  return {result.min_distance, search.boxTests() + nearest.triangleTests()};
}

/// Of all pairs of triangles.
Real distanceOf(const Parts& parts) {
  const RelativePlacement to_first(parts.tf1, parts.tf2);
  const exact::Placement placed{exact::of(to_first.R), exact::of(to_first.T)};
  const auto corners = [](const Mesh& mesh, const fcl::Triangle& t) -> exact::Triangle {
    return {exact::of(mesh.vertices[t[0]]), exact::of(mesh.vertices[t[1]]),
            exact::of(mesh.vertices[t[2]])};
  };
  Real least = std::numeric_limits<Real>::max();
  for (const fcl::Triangle& a : parts.first.triangles)
    for (const fcl::Triangle& b : parts.second.triangles)
      least = std::min(least,
                       exact::distance(corners(parts.first, a), placed(corners(parts.second, b))));
  return least;
}

class FarBodies : public testing::Test {
 protected:
  enum class Kind { Plate, Rough, Box };

  Mesh part(Kind kind, int n, double size) {
    Mesh mesh = plate(n, n);
    for (auto& x : mesh.vertices) {
      x -= fcl::Vector3d(0.5, 0.5, 0);
      if (kind == Kind::Rough) x[2] += 1e-3 * random_.point()[2];
    }
    if (kind == Kind::Box) {
      const Mesh face = mesh;
      mesh = Mesh();
      for (int side = 0; side < 6; ++side) {
        const auto first = mesh.vertices.size();
        for (const auto& x : face.vertices) {
          fcl::Vector3d at;
          at[side / 2] = side % 2 - 0.5;
          at[(side / 2 + 1) % 3] = x[0];
          at[(side / 2 + 2) % 3] = x[1];
          mesh.vertices.push_back(at - fcl::Vector3d(0, 0, 0.5));
        }
        for (const fcl::Triangle& t : face.triangles)
          mesh.triangles.emplace_back(t[0] + first, t[1] + first, t[2] + first);
      }
    }
    for (auto& x : mesh.vertices) x *= size;
    return mesh;
  }
  /// A part below z = 0, and one above the gap, along the axes of their frames or not.
  Parts parts(double gap, unsigned seed, int n) {
    RandomGeometry random(seed);
    const Kind kinds[] = {Kind::Plate, Kind::Box, Kind::Plate, Kind::Rough};
    const Kind kind1 = kinds[random.below(4)], kind2 = kinds[random.below(4)];
    const double ratio = random.below(2) ? 1 : random.size(-1, 1);
    const bool is_turned = random.below(2);
    Parts parts{part(kind1, n, 1), part(kind2, n, ratio)};
    for (auto& x : parts.second.vertices) x[2] = gap - x[2];
    const double angle = 6 * random.size(-2, 0), tilt = random.below(3) ? 0 : random.size(-6, -1);
    Transform spin = Transform::Identity();
    spin.linear() = (Eigen::AngleAxisd(angle, fcl::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(tilt, fcl::Vector3d::UnitX()))
                        .toRotationMatrix();
    const fcl::Vector3d aside = random.point() * random.size(-1, 1);
    const fcl::Vector3d foot(0, 0, gap);
    for (auto& x : parts.second.vertices) {
      const fcl::Vector3d from = x - foot;
      x = spin.linear() * from + foot + fcl::Vector3d(aside[0], aside[1], 0);
    }
    const fcl::Matrix3d world = random.rotation();
    parts.tf1.linear() = parts.tf2.linear() = world;
    if (is_turned) {
      turn(random.rotation(), parts.first, parts.tf1);
      turn(random.rotation(), parts.second, parts.tf2);
    }
    // So that the positions have all their digits.
    const fcl::Vector3d middle = parts.second.vertices[0];
    for (auto& x : parts.second.vertices) x -= middle;
    parts.tf2.translation() += parts.tf2.linear() * middle;
    return parts;
  }
  static void turn(const fcl::Matrix3d& R, Mesh& mesh, Transform& tf) {
    for (auto& x : mesh.vertices) x = R * x;
    tf.linear() = tf.linear() * R.transpose();
  }

  RandomGeometry random_{521};
};

/// Of plates, rough ones and boxes, equal in size or not, parallel or tilted, as they lie along
/// their axes or not.
TEST_F(FarBodies, DistanceIsThatOfAllPairs) {
  for (unsigned seed = 1; seed <= unsigned(manySteps(10)); ++seed)
    for (const double gap : {0., 1e-9, 0.1, 1., 30., 1e3, 1e5, 1e7, 1e9, 1e12}) {
      const Parts parts = this->parts(gap, seed, 3);
      const Real exact = distanceOf(parts);
      const double size = 20 + 3 * gap;
      ASSERT_NEAR(askedOf(parts).distance, double(exact), 32 * 0x1p-52 * size)
          << seed << ' ' << gap;
    }
}

/// Also where all triangles of a face are as near as each other. Below 1e-12 positions are rounded
/// by as much as the gap: a contact, which every pair that touches decides.
TEST_F(FarBodies, WorkDoesNotGrowWithTheDistance) {
  const unsigned pairs = isLongMode() ? 700 : 16;
  for (unsigned seed = 1; seed <= pairs; ++seed) {
    constexpr int kSide = 24;
    const Parts near = parts(1, seed, kSide);
    const auto size = long(near.first.triangles.size() + near.second.triangles.size());
    const long most = 10 * std::max(askedOf(near).work, size / 2);
    for (const double gap :
         {1e-12, 1e-9, 1e-6, 1e-2, 3., 10., 30., 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e10, 1e12})
      EXPECT_LE(askedOf(parts(gap, seed, kSide)).work, most) << seed << ' ' << gap;
  }
}

/// Two square grids in any rotation, apart along their normal: a tested pair of triangles as near
/// as the bodies can be ends the search.
TEST_F(FarBodies, ParallelPlatesTakeAFewTests) {
  for (const double gap : {1e-6, 1., 1e3, 1e6, 1e9, 1e12}) {
    Parts parts{part(Kind::Plate, 60, 1), part(Kind::Plate, 60, 1)};
    parts.tf1.linear() = random_.rotation();
    parts.tf2.linear() =
        parts.tf1.linear() * Eigen::AngleAxisd(0.7, fcl::Vector3d::UnitZ()).toRotationMatrix();
    parts.tf2.translation() = parts.tf1.linear() * fcl::Vector3d(0.1, 0.2, gap);
    const Answer answer = askedOf(parts);
    EXPECT_NEAR(answer.distance, gap, 32 * 0x1p-52 * (4 + 3 * gap));
    EXPECT_LE(answer.work, 7200 / 2) << gap;
  }
}

/// The search of a shape, which counts the triangles that are tested.
class CountingSearch final : public ShapeSearch {
 public:
  CountingSearch(const PlacedMesh& mesh, const adaptive_bvh::PlacedSolid& shape,
                 const adaptive_bvh::ShapeCore& core)
      : ShapeSearch(adaptive_bvh::QueryTriangles(mesh), shape), search_(mesh, shape, core) {}

  void nearest(const DistanceQuery& query, const PointPair& points,
               const Test& test) const override {
    search_.nearest(query, points, [&](int triangle) {
      ++tests_;
      return test(triangle);
    });
  }
  void touching(const Test& test) const override { search_.touching(test); }
  void boxAround(fcl::Boxd& box, fcl::Transform3d& box_tf) const override {
    search_.boxAround(box, box_tf);
  }
  long tests() const { return tests_; }

 private:
  const MeshShapeSearch search_;
  mutable long tests_ = 0;
};

Answer askedOf(const Mesh& mesh, const Transform& tf, const fcl::ShapeBased& shape,
               const Transform& shape_tf) {
  const DeformableMesh deformable(mesh);
  const PlacedMesh placed(deformable, tf);
  const fcl::DistanceRequestd request(true);
  fcl::DistanceResultd result;
  const adaptive_bvh::ShapeSolid solid(shape);
  const CountingSearch search(placed, {*solid, shape_tf}, solid.core());
  distanceToShape(search, {request, result});
  return {result.min_distance, search.tests()};
}

/// A sphere, a box and a half-space above plates, rough ones and boxes, in any rotation: distances
/// by formula, of which a flat part takes no more tests than some of its triangles.
TEST_F(FarBodies, ShapesAreAsFarAsByFormula) {
  constexpr double kRadius = 0.5;
  const fcl::Sphered sphere(kRadius);
  const fcl::Boxd box(4, 4, 1);
  const fcl::Halfspaced half_space(fcl::Vector3d(0, 0, -1), 0);  // all above its origin
  for (int round = 0; round < manySteps(3); ++round)
    for (const double gap : {1e-9, 0.1, 1., 30., 1e3, 1e5, 1e7, 1e9, 1e12})
      for (const Kind kind : {Kind::Plate, Kind::Rough, Kind::Box}) {
        Mesh mesh = part(kind, 24, 1);
        const auto size = long(mesh.triangles.size());
        Real highest = -1, to_center = std::numeric_limits<Real>::max();
        Transform tf = Transform::Identity(), shape_tf = Transform::Identity();
        turn(random_.rotation(), mesh, tf);
        const exact::Placement placed{exact::of(tf.linear()), exact::of(fcl::Vector3d::Zero())};
        const fcl::Vector3d middle(0.1, 0.2, gap + kRadius);
        for (const fcl::Triangle& t : mesh.triangles) {
          const exact::Triangle at =
              placed({exact::of(mesh.vertices[t[0]]), exact::of(mesh.vertices[t[1]]),
                      exact::of(mesh.vertices[t[2]])});
          to_center = std::min(to_center, exact::distance(at, exact::of(middle)));
          for (const exact::Point& x : at) highest = std::max(highest, x[2]);
        }
        const double tolerance = 64 * 0x1p-52 * (4 + 3 * gap);
        const auto check = [&](const fcl::ShapeBased& shape, Real distance, long most) {
          const Answer answer = askedOf(mesh, tf, shape, shape_tf);
          ASSERT_NEAR(answer.distance, std::max(double(distance), 0.), tolerance) << gap;
          ASSERT_LE(answer.work, kind == Kind::Plate ? most : size + size / 4) << gap;
        };
        shape_tf.translation() = middle;
        check(sphere, to_center - kRadius, size / 3);
        check(box, gap - highest, size / 4);
        shape_tf.translation()[2] = gap;
        check(half_space, gap - highest, size / 4);
      }
}

/// A box that stands on a corner above a plate: the corner is as high as by formula.
TEST_F(FarBodies, CornersOfBoxesTakeAFewTests) {
  const fcl::Boxd box(0.4, 0.3, 0.5);
  for (int round = 0; round < manySteps(3); ++round)
    for (const double gap : {1e-3, 0.1, 1., 30., 1e3, 1e5, 1e7, 1e9, 1e12}) {
      Mesh mesh = part(Kind::Plate, 60, 1);
      Transform tf = Transform::Identity(), shape_tf = Transform::Identity();
      turn(random_.rotation(), mesh, tf);
      shape_tf.linear() = random_.rotation();
      const exact::Point up = exact::of(fcl::Vector3d(shape_tf.linear().row(2).transpose()));
      const Real below = up.cwiseAbs().dot(exact::of(fcl::Vector3d(box.side / 2)));
      shape_tf.translation() = fcl::Vector3d(0.1, 0.2, gap + double(below));
      Real highest = -1;
      for (const fcl::Vector3d& x : mesh.vertices)
        highest = std::max(highest, exact::placement(tf)(exact::of(x))[2]);
      const Answer answer = askedOf(mesh, tf, box, shape_tf);
      EXPECT_NEAR(answer.distance, double(Real(shape_tf.translation()[2]) - below - highest),
                  64 * 0x1p-52 * (4 + 3 * gap));
      EXPECT_LE(answer.work, long(mesh.triangles.size() / (gap < 32 ? 4 : 8))) << gap;
      // Searches that begin with a limit, and find nothing as near for long.
      const DeformableMesh deformable(mesh);
      const double distance = double(Real(shape_tf.translation()[2]) - below - highest);
      EXPECT_TRUE(adaptive_bvh::isNearer(deformable, tf, box, shape_tf, distance * (1 + 1e-9)));
      EXPECT_FALSE(adaptive_bvh::isNearer(deformable, tf, box, shape_tf, distance * (1 - 1e-9)));
    }
}

/// Nearest points of points above plates, rough ones and boxes, against quadruple precision: also
/// which of several triangles it is that are as near.
TEST_F(FarBodies, NearestPointsAreThoseOfAllTriangles) {
  for (int round = 0; round < manySteps(4); ++round)
    for (const double gap : {0.1, 30., 40., 1e3, 1e5, 1e7, 1e9, 1e11, 1e13})
      for (const Kind kind : {Kind::Plate, Kind::Rough, Kind::Box}) {
        Mesh mesh = part(kind, 40, 1);
        Transform tf = Transform::Identity();
        if (round % 2) turn(random_.rotation(), mesh, tf);
        const double aside = round % 4 < 2 ? 0.2 : 0.;  // 0: above a corner, with ties
        const fcl::Vector3d x = tf.linear().transpose() * fcl::Vector3d(aside / 3, aside, gap);
        const DeformableMesh deformable(mesh);
        PointSearch search(adaptive_bvh::stateOf(deformable));
        PointSearch::Nearest found;
        search.search(x, found);
        const auto square = [&](int triangle) -> quad::Real {
          const fcl::Triangle& t = mesh.triangles[std::size_t(triangle)];
          return quad::squaredDistance(
              quad::of(x), {quad::of(mesh.vertices[t[0]]), quad::of(mesh.vertices[t[1]]),
                            quad::of(mesh.vertices[t[2]])});
        };
        const int count = int(mesh.triangles.size());
        quad::Real least = square(0);
        for (int i = 1; i < count; ++i) least = std::min(least, square(i));
        ASSERT_NEAR(found.distance, double(quad::root(least)), 0x1p-48 * (2 + gap));
        if (gap > 1e9) continue;  // too far to tell triangles apart
        ASSERT_TRUE(square(found.triangle) <= least * (1 + 2 * quad::Real(0x1p-80))) << gap;
        const quad::Real same = least * quad::Real(0x1p-100);
        for (int i = 0; i < found.triangle; ++i)
          ASSERT_TRUE(quad::absolute(square(i) - square(found.triangle)) > same) << gap << ' ' << i;
        const bool is_flat = kind == Kind::Plate && gap >= 1e3;
        ASSERT_LE(search.triangleTests(), std::size_t(is_flat ? count / 4 : count)) << gap;
      }
}

/// Bounds along any line, of bodies of any sizes and far apart, never exceed the distance of a pair
/// of triangles.
TEST_F(FarBodies, BoundsAlongALineAreThoseOfTriangles) {
  long pruned = 0, all = 0;
  for (int round = 0; round < manySteps(12); ++round) {
    const double gap = round % 4 ? random_.size(-2, 9) : 0;
    const Parts parts = this->parts(gap, unsigned(1000 + round), 4);
    const DeformableMesh mesh1(parts.first), mesh2(parts.second);
    const PlacedMesh first(mesh1, parts.tf1), second(mesh2, parts.tf2);
    const TreePair trees(first, second);
    const LocalBoxes boxes(first, second, trees.toFirst());
    const exact::Placement placed{exact::of(trees.toFirst().R), exact::of(trees.toFirst().T)};
    fcl::Vector3d along = round % 3 ? boxes.line() : fcl::Vector3d(random_.direction());
    if (along.isZero(0)) along = random_.direction();
    LineView view;
    const fcl::Vector3d back = trees.toFirst().R.transpose() * -along;
    view.set(trees, along, boxes.middle1(), boxes.middle2(), boxes.extent1(boxes.middle1(), along),
             boxes.extent2(boxes.middle2(), back));
    const auto corners = [](const PlacedMesh& mesh, int place) -> exact::Triangle {
      const auto points = mesh.pointsAt(unsigned(place));
      return {exact::of(points[0]), exact::of(points[1]), exact::of(points[2])};
    };
    const Real error = Real(8 * 0x1p-52) * Real(trees.toFirst().T.lpNorm<1>() + 100);
    for (int n1 = 0; n1 < trees.first().size(); ++n1)
      for (int n2 = 0; n2 < trees.second().size(); ++n2) {
        const WideNode &a = trees.first().nodes()[n1], &b = trees.second().nodes()[n2];
        if (!a.isLeaf() || !b.isLeaf()) continue;
        Real distances[4][4];
        for (int j = 0; j < int(b.count); ++j)
          for (int i = 0; i < int(a.count); ++i)
            distances[j][i] =
                exact::distance(corners(first, a.first + i), placed(corners(second, b.first + j)));
        const Real some = distances[random_.below(int(b.count))][random_.below(int(a.count))];
        view.setLimit(double(some + error));
        Gaps4x4 keys;
        const unsigned near = view.near(n1, n2, nullptr, keys);
        for (int j = 0; j < int(b.count); ++j)
          for (int i = 0; i < int(a.count); ++i) {
            const bool is_near = near >> (4 * j + i) & 1;
            ++all;
            pruned += !is_near;
            if (distances[j][i] > some) continue;
            ASSERT_TRUE(is_near) << round << ' ' << gap;
            ASSERT_LT(keys(i, j), view.limitOfKeys()) << round << ' ' << gap;
          }
      }
    ASSERT_LE(Real(view.gap()), distanceOf(parts) + error);
  }
  EXPECT_GT(pruned, all / 64);
}

}  // namespace far_bodies_test
}  // namespace adaptive_bvh_test
