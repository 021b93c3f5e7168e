// A mesh against an octree, from cells far smaller than triangles to cells far larger: judged by
// every cell and every triangle in long double.
#include <gtest/gtest.h>

#include <functional>

#include <fcl/geometry/octree/octree.h>
#include <octomap/octomap.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/exact_geometry.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace octree_test {

using Model = adaptive_bvh::AdaptiveBVHModel<TestVolume<double>>;
using Octree = std::shared_ptr<fcl::OcTreed>;

/// A wavy sheet of columns^2 cells and some strewn ones, every seventh free.
Octree sheet(double cell, int columns) {
  auto tree = std::make_shared<octomap::OcTree>(cell);
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < columns; ++j) {
      const double x = (i - columns / 2 + 0.5) * cell, y = (j - columns / 2 + 0.5) * cell,
                   z = 3 * cell * std::sin(0.7 * i) * std::cos(0.5 * j);
      const bool occupied = (i + 3 * j) % 7 != 0;
      tree->updateNode(octomap::point3d(float(x), float(y), float(z)), occupied);
    }
  tree->updateInnerOccupancy();
  return std::make_shared<fcl::OcTreed>(tree);
}

/// The surface of a sphere of radius 1.
Octree shell(double cell) {
  auto tree = std::make_shared<octomap::OcTree>(cell);
  const int steps = int(4 / cell);
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j < 2 * steps; ++j) {
      const double polar = M_PI * i / steps, angle = M_PI * j / steps;
      tree->updateNode(
          octomap::point3d(float(std::sin(polar) * std::cos(angle)),
                           float(std::sin(polar) * std::sin(angle)), float(std::cos(polar))),
          true, true);
    }
  tree->updateInnerOccupancy();
  return std::make_shared<fcl::OcTreed>(tree);
}

/// Triangles of all kinds: a dome, a large one, slivers, needles and points.
TriangleMesh mixture() {
  TriangleMesh mesh = dome(6, 3);
  const auto add = [&](const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c) {
    const std::size_t v = mesh.vertices.size();
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
    mesh.triangles.emplace_back(v, v + 1, v + 2);
  };
  const fcl::Vector3d p(-0.4, 0.1, 0.2), q(0.5, -0.3, 0.1);
  add({-1, -1, 0.2}, {1, -0.9, 0}, {0, 1, -0.2});
  add(p, q, (p + q) / 2);                                  // collinear
  add(p, q, p + (q - p) / 3 + fcl::Vector3d(0, 0, 1e-6));  // nearly so
  add(q, p, p);                                            // an edge
  add(p, p, p);                                            // a point
  add({0, 0, 0}, {1, 0, 0}, {0.3, 0, 0});                  // collinear, along an axis
  add({0, 0, 0.01}, {0, 0.7, 0.01}, {0, 0, 0.0101});       // a needle
  return mesh;
}

using CellBox = std::pair<const octomap::OcTreeNode*, fcl::AABBd>;

void addCells(const fcl::OcTreed& octree, const octomap::OcTreeNode* node, const fcl::AABBd& box,
              std::vector<CellBox>& cells) {
  if (!octree.nodeHasChildren(node)) {
    if (octree.isNodeOccupied(node)) cells.emplace_back(node, box);
    return;
  }
  for (unsigned i = 0; i < 8; ++i)
    if (octree.nodeChildExists(node, i)) {
      fcl::AABBd child;
      fcl::computeChildBV(box, i, child);
      addCells(octree, octree.getNodeChild(node, i), child, cells);
    }
}

using Pairs = std::set<std::pair<long, long>>;

/// Every occupied cell with every triangle, in long double.
class BruteForceOctree {
 public:
  BruteForceOctree(const BodyView& mesh, const fcl::Transform3d& mesh_tf,
                   const fcl::OcTreed& octree, const fcl::Transform3d& octree_tf) {
    std::vector<CellBox> cells;
    addCells(octree, octree.getRoot(), octree.getRootBV(), cells);
    const fcl::Transform3d to_octree = octree_tf.inverse(Eigen::Isometry) * mesh_tf;
    for (int t = 0; t < mesh.num_tris; ++t) {
      exact::Triangle triangle;
      for (std::size_t k = 0; k < 3; ++k)
        triangle[k] =
            exact::of(Eigen::Vector3d(to_octree * mesh.vertices[mesh.tri_indices[t][int(k)]]));
      for (const CellBox& cell : cells) {
        if (gapOfBoxes(cell.second, triangle) > distance) continue;
        const exact::Real d = exactly(cell.second, triangle);
        distance = std::min(distance, d);
        if (d <= 0) contacts.emplace(cell.first - octree.getRoot(), t);
      }
    }
  }

  exact::Real distance = std::numeric_limits<double>::max();
  Pairs contacts;

 private:
  static exact::Real gapOfBoxes(const fcl::AABBd& cell, const exact::Triangle& t) {
    const exact::Point low = t[0].cwiseMin(t[1]).cwiseMin(t[2]) - exact::of(cell.max_),
                       high = exact::of(cell.min_) - t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    return low.cwiseMax(high).cwiseMax(exact::Point::Zero()).norm();
  }
  static exact::Real exactly(const fcl::AABBd& cell, const exact::Triangle& t) {
    const exact::Point ends[2] = {exact::of(cell.min_), exact::of(cell.max_)};
    for (const exact::Point& x : t)
      if ((x.array() >= ends[0].array()).all() && (x.array() <= ends[1].array()).all()) return 0;
    exact::Real least = std::numeric_limits<exact::Real>::max();
    for (int k = 0; k < 3; ++k)
      for (const exact::Point& end : ends) {
        exact::Point corner[4];
        for (int i = 0; i < 4; ++i) {
          corner[i][k] = end[k];
          corner[i][(k + 1) % 3] = ends[i & 1][(k + 1) % 3];
          corner[i][(k + 2) % 3] = ends[i >> 1][(k + 2) % 3];
        }
        for (const int i : {0, 3})
          least = std::min(least, exact::distance(t, {corner[1], corner[2], corner[i]}));
      }
    return least;
  }
};

/// Cell and triangle of every contact; in the result the octree is first.
std::vector<std::pair<long, long>> contactsIn(const fcl::CollisionResultd& result) {
  std::vector<std::pair<long, long>> contacts;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    contacts.emplace_back(result.getContact(i).b1, result.getContact(i).b2);
  return contacts;
}

template <typename Body>
class OctreeTest : public testing::Test {
 protected:
  using Transform = fcl::Transform3d;

  fcl::CollisionResultd ask(bool octree_first, const fcl::OcTreed& octree,
                            const fcl::CollisionRequestd& request) {
    const fcl::CollisionGeometryd *o1 = &model_, *o2 = &octree;
    Transform tf1 = mesh_tf_, tf2 = octree_tf_;
    if (octree_first) {
      std::swap(o1, o2);
      std::swap(tf1, tf2);
    }
    fcl::CollisionResultd result;
    adaptive_bvh::collide(o1, tf1, o2, tf2, request, result);
    return result;
  }

  double distance(bool octree_first, const fcl::OcTreed& octree) {
    fcl::DistanceResultd result;
    const fcl::DistanceRequestd request;
    return octree_first
               ? adaptive_bvh::distance(&octree, octree_tf_, &model_, mesh_tf_, request, result)
               : adaptive_bvh::distance(&model_, mesh_tf_, &octree, octree_tf_, request, result);
  }

  Body model_ = makeBody<Body>(mixture());
  Transform mesh_tf_ = Transform::Identity(), octree_tf_ = Transform::Identity();
  std::mt19937 random_{testSeed(5)};
};

TYPED_TEST_SUITE(OctreeTest, TestBodies);

TYPED_TEST(OctreeTest, EveryPairIsFoundWhateverTheSizes) {
  int apart = 0, touching = 0;
  for (double cell : {0.02, 0.1, 0.5, 2.}) {
    const Octree octree = sheet(cell, cell < 1 ? 12 : 4);
    const double reach = double(std::max(0.6, 4 * cell));
    for (int i = 0; i < 24; ++i) {
      this->mesh_tf_ = randomPose(this->random_, reach);
      this->octree_tf_ = randomPose(this->random_, 0.3);
      const BruteForceOctree expected(this->model_, this->mesh_tf_, *octree, this->octree_tf_);
      ++(expected.contacts.empty() ? apart : touching);
      for (bool octree_first : {false, true}) {
        for (bool with_points : {false, true}) {
          const fcl::CollisionRequestd all(100000, with_points);
          const auto found = contactsIn(this->ask(octree_first, *octree, all));
          EXPECT_EQ(expected.contacts, Pairs(found.begin(), found.end()));
          EXPECT_EQ(expected.contacts.size(), found.size());
        }
        EXPECT_NEAR(double(expected.distance), double(this->distance(octree_first, *octree)),
                    64 * std::numeric_limits<double>::epsilon() * reach);
      }
    }
  }
  EXPECT_GT(apart, 10);
  EXPECT_GT(touching, 10);
}

/// With the fields that a request for all gives.
TYPED_TEST(OctreeTest, ARequestForFewContactsGetsSome) {
  const Octree octree = sheet(0.05, 16);
  std::size_t found = 0;
  for (int i = 0; i < 20; ++i) {
    this->mesh_tf_ = randomPose(this->random_, 0.3);
    const auto all = this->ask(false, *octree, fcl::CollisionRequestd(100000, true));
    const auto names = contactsIn(all);
    for (std::size_t most : {1, 4}) {
      const auto result = this->ask(false, *octree, fcl::CollisionRequestd(most, true));
      ASSERT_EQ(std::min(most, names.size()), result.numContacts());
      for (std::size_t k = 0; k < result.numContacts(); ++k) {
        const auto named = std::find(names.begin(), names.end(), contactsIn(result)[k]);
        ASSERT_NE(names.end(), named);
        const auto& expected = all.getContact(std::size_t(named - names.begin()));
        EXPECT_EQ(expected.pos, result.getContact(k).pos);
        EXPECT_EQ(expected.penetration_depth, result.getContact(k).penetration_depth);
      }
      found += result.numContacts();
    }
  }
  EXPECT_GT(found, 40u);
}

/// Two triangles and tens of thousands of cells: the cells that touch are tested, few others.
TEST(OctreeWork, FewMorePairsAreTestedThanTouch) {
  const Octree octree = shell(0.02);
  TriangleMesh square = plate(1, 1, 2.2, 2.2);
  for (fcl::Vector3d& p : square.vertices) p -= fcl::Vector3d(1.1, 1.1, 0);
  Model model;
  fillModel(square, model);
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  fcl::Transform3d pose = still;
  pose.linear() = fcl::AngleAxisd(0.4, fcl::Vector3d(1, 2, 3).normalized()).toRotationMatrix();

  fcl::CollisionResultd contacts;
  adaptive_bvh::collide(&model, pose, octree.get(), still, fcl::CollisionRequestd(100000),
                        contacts);
  EXPECT_GT(contacts.numContacts(), 300u);
  EXPECT_LE(model.recordedWork().leaf_tests, long(contacts.numContacts() * 5 / 4));

  long before = model.recordedWork().leaf_tests;
  fcl::DistanceResultd none, nearest;
  adaptive_bvh::distance(&model, pose, octree.get(), still, fcl::DistanceRequestd(), none);
  EXPECT_LE(none.min_distance, 0);
  EXPECT_EQ(1, model.recordedWork().leaf_tests - before);

  pose.translation() << 0.1, 0.2, 2.5;
  before = model.recordedWork().leaf_tests;
  adaptive_bvh::distance(&model, pose, octree.get(), still, fcl::DistanceRequestd(), nearest);
  EXPECT_GT(nearest.min_distance, 0);
  EXPECT_LE(model.recordedWork().leaf_tests - before, 200);
}

}  // namespace octree_test
}  // namespace adaptive_bvh_test
