// A mesh against an octree, from cells far smaller than triangles to cells far larger: judged by
// every cell and every triangle in long double.
#include <gtest/gtest.h>

#include <functional>

#include <fcl/geometry/octree/octree.h>
#include <octomap/octomap.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "dispatch/octree_cells.h"
#include "fcl/fcl_nodes.h"
#include "support/exact_geometry.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/test_volume.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh_test {
namespace octree_test {

template <typename S>
using Model = adaptive_bvh::AdaptiveBVHModel<TestVolume<S>>;
template <typename S>
using Octree = std::shared_ptr<fcl::OcTree<S>>;

/// A wavy sheet of columns^2 cells and some strewn ones, every seventh free.
template <typename S>
Octree<S> sheet(double cell, int columns) {
  auto tree = std::make_shared<octomap::OcTree>(cell);
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < columns; ++j) {
      const double x = (i - columns / 2 + 0.5) * cell, y = (j - columns / 2 + 0.5) * cell,
                   z = 3 * cell * std::sin(0.7 * i) * std::cos(0.5 * j);
      const bool occupied = (i + 3 * j) % 7 != 0;
      tree->updateNode(octomap::point3d(float(x), float(y), float(z)), occupied);
    }
  tree->updateInnerOccupancy();
  return std::make_shared<fcl::OcTree<S>>(tree);
}

/// The surface of a sphere of radius 1.
template <typename S>
Octree<S> shell(double cell) {
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
  return std::make_shared<fcl::OcTree<S>>(tree);
}

/// Triangles of all kinds: a dome, a large one, slivers, needles and points.
template <typename S>
TriangleMesh<S> mixture() {
  TriangleMesh<S> mesh = dome<S>(6, 3);
  const auto add = [&](const Vector3<S>& a, const Vector3<S>& b, const Vector3<S>& c) {
    const std::size_t v = mesh.vertices.size();
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
    mesh.triangles.emplace_back(v, v + 1, v + 2);
  };
  const Vector3<S> p(S(-0.4), S(0.1), S(0.2)), q(S(0.5), S(-0.3), S(0.1));
  add({-1, -1, S(0.2)}, {1, S(-0.9), 0}, {0, 1, S(-0.2)});
  add(p, q, (p + q) / 2);                                         // collinear
  add(p, q, p + (q - p) / 3 + Vector3<S>(0, 0, S(1e-6)));         // nearly so
  add(q, p, p);                                                   // an edge
  add(p, p, p);                                                   // a point
  add({0, 0, 0}, {1, 0, 0}, {S(0.3), 0, 0});                      // collinear, along an axis
  add({0, 0, S(0.01)}, {0, S(0.7), S(0.01)}, {0, 0, S(0.0101)});  // a needle
  return mesh;
}

template <typename S>
using CellBox = std::pair<const octomap::OcTreeNode*, fcl::AABB<S>>;

template <typename S>
void addCells(const fcl::OcTree<S>& octree, const octomap::OcTreeNode* node,
              const fcl::AABB<S>& box, std::vector<CellBox<S>>& cells) {
  if (!octree.nodeHasChildren(node)) {
    if (octree.isNodeOccupied(node)) cells.emplace_back(node, box);
    return;
  }
  for (unsigned i = 0; i < 8; ++i)
    if (octree.nodeChildExists(node, i)) {
      fcl::AABB<S> child;
      fcl::computeChildBV(box, i, child);
      addCells(octree, octree.getNodeChild(node, i), child, cells);
    }
}

using Pairs = std::set<std::pair<long, long>>;

/// Every occupied cell with every triangle, in long double.
template <typename S>
class BruteForceOctree {
 public:
  BruteForceOctree(const BodyView<S>& mesh, const fcl::Transform3<S>& mesh_tf,
                   const fcl::OcTree<S>& octree, const fcl::Transform3<S>& octree_tf) {
    std::vector<CellBox<S>> cells;
    addCells(octree, octree.getRoot(), octree.getRootBV(), cells);
    const fcl::Transform3d to_octree = octree_tf.template cast<double>().inverse(Eigen::Isometry) *
                                       mesh_tf.template cast<double>();
    for (int t = 0; t < mesh.num_tris; ++t) {
      exact::Triangle triangle;
      for (std::size_t k = 0; k < 3; ++k)
        triangle[k] = exact::of(Eigen::Vector3d(
            to_octree * mesh.vertices[mesh.tri_indices[t][int(k)]].template cast<double>()));
      for (const CellBox<S>& cell : cells) {
        if (gapOfBoxes(cell.second, triangle) > distance) continue;
        const exact::Real d = exactly(cell.second, triangle);
        distance = std::min(distance, d);
        if (d <= 0) contacts.emplace(cell.first - octree.getRoot(), t);
      }
    }
  }

  exact::Real distance = std::numeric_limits<S>::max();
  Pairs contacts;

 private:
  static exact::Real gapOfBoxes(const fcl::AABB<S>& cell, const exact::Triangle& t) {
    const exact::Point low = t[0].cwiseMin(t[1]).cwiseMin(t[2]) - exact::of(cell.max_),
                       high = exact::of(cell.min_) - t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    return low.cwiseMax(high).cwiseMax(exact::Point::Zero()).norm();
  }
  static exact::Real exactly(const fcl::AABB<S>& cell, const exact::Triangle& t) {
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
template <typename S>
std::vector<std::pair<long, long>> contactsIn(const fcl::CollisionResult<S>& result) {
  std::vector<std::pair<long, long>> contacts;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    contacts.emplace_back(result.getContact(i).b1, result.getContact(i).b2);
  return contacts;
}

template <typename Body>
class OctreeTest : public testing::Test {
 protected:
  using S = ScalarOf<Body>;
  using Transform = fcl::Transform3<S>;

  fcl::CollisionResult<S> ask(bool octree_first, const fcl::OcTree<S>& octree,
                              const fcl::CollisionRequest<S>& request) {
    const fcl::CollisionGeometry<S>*o1 = &model_, *o2 = &octree;
    Transform tf1 = mesh_tf_, tf2 = octree_tf_;
    if (octree_first) {
      std::swap(o1, o2);
      std::swap(tf1, tf2);
    }
    fcl::CollisionResult<S> result;
    adaptive_bvh::collide<S>(o1, tf1, o2, tf2, request, result);
    return result;
  }

  S distance(bool octree_first, const fcl::OcTree<S>& octree) {
    fcl::DistanceResult<S> result;
    const fcl::DistanceRequest<S> request;
    return octree_first
               ? adaptive_bvh::distance<S>(&octree, octree_tf_, &model_, mesh_tf_, request, result)
               : adaptive_bvh::distance<S>(&model_, mesh_tf_, &octree, octree_tf_, request, result);
  }

  Body model_ = makeBody<Body>(mixture<S>());
  Transform mesh_tf_ = Transform::Identity(), octree_tf_ = Transform::Identity();
  std::mt19937 random_{testSeed(5)};
};

TYPED_TEST_SUITE(OctreeTest, TestBodies);

TYPED_TEST(OctreeTest, EveryPairIsFoundWhateverTheSizes) {
  using S = ScalarOf<TypeParam>;
  int apart = 0, touching = 0;
  for (double cell : {0.02, 0.1, 0.5, 2.}) {
    const Octree<S> octree = sheet<S>(cell, cell < 1 ? 12 : 4);
    const S reach = S(std::max(0.6, 4 * cell));
    for (int i = 0; i < 24; ++i) {
      this->mesh_tf_ = randomPose<S>(this->random_, reach);
      this->octree_tf_ = randomPose<S>(this->random_, S(0.3));
      const BruteForceOctree<S> expected(this->model_, this->mesh_tf_, *octree, this->octree_tf_);
      ++(expected.contacts.empty() ? apart : touching);
      for (bool octree_first : {false, true}) {
        for (bool with_points : {false, true}) {
          const fcl::CollisionRequest<S> all(100000, with_points);
          const auto found = contactsIn(this->ask(octree_first, *octree, all));
          EXPECT_EQ(expected.contacts, Pairs(found.begin(), found.end()));
          EXPECT_EQ(expected.contacts.size(), found.size());
        }
        EXPECT_NEAR(double(expected.distance), double(this->distance(octree_first, *octree)),
                    64 * std::numeric_limits<S>::epsilon() * reach);
      }
    }
  }
  EXPECT_GT(apart, 10);
  EXPECT_GT(touching, 10);
}

/// With the fields that a request for all gives.
TYPED_TEST(OctreeTest, ARequestForFewContactsGetsSome) {
  using S = ScalarOf<TypeParam>;
  const Octree<S> octree = sheet<S>(0.05, 16);
  std::size_t found = 0;
  for (int i = 0; i < 20; ++i) {
    this->mesh_tf_ = randomPose<S>(this->random_, S(0.3));
    const auto all = this->ask(false, *octree, fcl::CollisionRequest<S>(100000, true));
    const auto names = contactsIn(all);
    for (std::size_t most : {1, 4}) {
      const auto result = this->ask(false, *octree, fcl::CollisionRequest<S>(most, true));
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
  const Octree<double> octree = shell<double>(0.02);
  TriangleMesh<double> square = plate<double>(1, 1, 2.2, 2.2);
  for (Vector3<double>& p : square.vertices) p -= Vector3<double>(1.1, 1.1, 0);
  Model<double> model;
  fillModel(square, model);
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  fcl::Transform3d pose = still;
  pose.linear() = fcl::AngleAxisd(0.4, fcl::Vector3d(1, 2, 3).normalized()).toRotationMatrix();

  fcl::CollisionResultd contacts;
  adaptive_bvh::collide<double>(&model, pose, octree.get(), still, fcl::CollisionRequestd(100000),
                                contacts);
  EXPECT_GT(contacts.numContacts(), 300u);
  EXPECT_LE(model.recordedWork().leaf_tests, long(contacts.numContacts() * 5 / 4));

  long before = model.recordedWork().leaf_tests;
  fcl::DistanceResultd none, nearest;
  adaptive_bvh::distance<double>(&model, pose, octree.get(), still, fcl::DistanceRequestd(), none);
  EXPECT_LE(none.min_distance, 0);
  EXPECT_EQ(1, model.recordedWork().leaf_tests - before);

  pose.translation() << 0.1, 0.2, 2.5;
  before = model.recordedWork().leaf_tests;
  adaptive_bvh::distance<double>(&model, pose, octree.get(), still, fcl::DistanceRequestd(),
                                 nearest);
  EXPECT_GT(nearest.min_distance, 0);
  EXPECT_LE(model.recordedWork().leaf_tests - before, 200);
}

/// A mesh and an octree, both far from the world's origin, and where points of the one lie in the
/// other's coordinates, in more digits than S.
template <typename S>
struct Placement {
  using Wide = Eigen::Matrix<long double, 3, 1>;

  Placement(std::mt19937& random, S far) {
    octree_tf = randomPose<S>(random, far);
    mesh_tf = randomPose<S>(random, S(2));
    mesh_tf.translation() += octree_tf.translation();
  }

  Wide inOctree(const Wide& p) const {
    const Wide world = mesh_tf.linear().template cast<long double>() * p +
                       (mesh_tf.translation().template cast<long double>() -
                        octree_tf.translation().template cast<long double>());
    return octree_tf.linear().template cast<long double>().transpose() * world;
  }

  /// A direction of the octree's coordinates in the mesh's.
  Wide toMesh(const Wide& v) const {
    return mesh_tf.linear().template cast<long double>().transpose() *
           (octree_tf.linear().template cast<long double>() * v);
  }

  adaptive_bvh::IntoOctree into() const {
    return {mesh_tf.template cast<double>(), octree_tf.template cast<double>()};
  }

  fcl::Transform3<S> mesh_tf, octree_tf;
};

template <typename S>
fcl::AABBd inDouble(const fcl::AABB<S>& box) {
  return {box.min_.template cast<double>(), box.max_.template cast<double>()};
}

template <typename S>
class CellSeparation : public testing::Test {
 protected:
  using Wide = typename Placement<S>::Wide;

  S uniform(S low, S high) { return std::uniform_real_distribution<S>(low, high)(random_); }
  Vector3<S> point() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  /// A cell that just reaches to a point, from a side, an edge or a corner, or some way off.
  fcl::AABB<S> cellAt(const Wide& p) {
    const S side = std::pow(S(10), uniform(-2, 1));
    const S off = uniform(0, 1) < S(0.5) ? 0 : uniform(0, 1);
    fcl::AABB<S> cell;
    for (int k = 0; k < 3; ++k) {
      const int choice = std::uniform_int_distribution<int>(0, 2)(random_);
      const S from = choice == 0 ? -side - off : choice == 1 ? off : -uniform(0, side);
      cell.min_[k] = S(p[k]) + from;
      cell.max_[k] = cell.min_[k] + side;
    }
    return cell;
  }

  static long double distance(const Wide& p, const fcl::AABB<S>& cell) {
    const Wide low = cell.min_.template cast<long double>(),
               high = cell.max_.template cast<long double>();
    return (low - p).cwiseMax(p - high).cwiseMax(Wide::Zero()).norm();
  }

  /// `isApart` and `bound` of a body that holds p.
  void judge(const Wide& p, const fcl::AABB<S>& cell, bool is_apart, double bound) {
    const long double d = distance(p, cell);
    if (d == 0) {
      EXPECT_FALSE(is_apart);
      ++touching_;
    }
    apart_ += is_apart;
    EXPECT_LE(bound, d);
    tight_ += bound > 0 && bound > 0.5 * double(d);
  }

  std::mt19937 random_{testSeed(17)};
  int touching_ = 0, apart_ = 0, tight_ = 0;
};

TYPED_TEST_SUITE(CellSeparation, TestScalars);

TYPED_TEST(CellSeparation, BoundsOfTrianglesHoldForTheirPoints) {
  using S = TypeParam;
  using Wide = typename Placement<S>::Wide;
  for (int i = 0; i < 20000; ++i) {
    const Placement<S> placement(this->random_, i % 2 ? S(1000) : S(1));
    Vector3<S> a = this->point(), b = this->point(), c = this->point();
    if (i % 5 == 1) c = (a + b) / 2;
    if (i % 5 == 2) c = a + S(1e-5) * c;
    if (i % 5 == 3) b = c = a;
    const long double u = this->uniform(0, 1), v = this->uniform(0, 1 - S(u));
    const Wide p =
        placement.inOctree((1 - u - v) * a.template cast<long double>() +
                           u * b.template cast<long double>() + v * c.template cast<long double>());
    const fcl::AABB<S> cell = this->cellAt(p);
    const fcl::Vector3d corners[] = {a.template cast<double>(), b.template cast<double>(),
                                     c.template cast<double>()};
    const adaptive_bvh::IntoOctree into = placement.into();
    const adaptive_bvh::CellExtent extent(inDouble(cell));
    this->judge(
        p, cell,
        adaptive_bvh::TriangleOverlap(corners[0], corners[1], corners[2], into).isApart(extent),
        adaptive_bvh::TriangleDistance(corners[0], corners[1], corners[2], into).distance(extent));
  }
  EXPECT_GT(this->touching_, 2000);
  EXPECT_GT(this->apart_, 2000);
  EXPECT_GT(this->tight_, 2000);
}

/// The boxes of a mesh's four-wide tree.
TYPED_TEST(CellSeparation, BoundsOfBoxesHoldForTheirTriangles) {
  using S = TypeParam;
  using Wide = typename Placement<S>::Wide;
  using adaptive_bvh::MeshNode;
  for (int round = 0; round < 100; ++round) {
    const Placement<S> placement(this->random_, round % 2 ? S(1000) : S(1));
    TriangleMesh<S> mesh = dome<S>(6, 3);
    for (Vector3<S>& p : mesh.vertices) p += S(0.1) * this->point();
    const adaptive_bvh::DeformableMesh<S> body(mesh);
    const BodyView<S> model(body);
    const adaptive_bvh::WideNodes nodes(adaptive_bvh::stateOf(body).tree);
    const adaptive_bvh::IntoOctree into = placement.into();
    // Returns the triangles below; each judges the box of the node.
    const std::function<std::vector<int>(MeshNode)> judge = [&](MeshNode node) -> std::vector<int> {
      std::vector<int> below;
      MeshNode children[4];
      if (nodes.isLeaf(node)) below.push_back(nodes.triangle(node));
      for (int i = 0; !nodes.isLeaf(node) && i < nodes.below(node, children); ++i) {
        const std::vector<int> more = judge(children[i]);
        below.insert(below.end(), more.begin(), more.end());
      }
      const adaptive_bvh::VolumeInOctree volume(nodes.body(node), into);
      for (int t : below) {
        const fcl::Triangle& corners = model.tri_indices[t];
        const S u = this->uniform(0, 1), v = this->uniform(0, 1 - u);
        const auto at = [&](int k) -> Wide {
          return model.vertices[corners[std::size_t(k)]].template cast<long double>();
        };
        const Wide p = placement.inOctree((1 - (long double)(u)-v) * at(0) +
                                          (long double)(u)*at(1) + (long double)(v)*at(2));
        const fcl::AABB<S> cell = this->cellAt(p);
        const adaptive_bvh::CellExtent extent(inDouble(cell));
        this->judge(p, cell, volume.isApart(extent), volume.distance(extent));
      }
      return below;
    };
    EXPECT_EQ(std::size_t(model.num_tris), judge(MeshNode()).size());
  }
  EXPECT_GT(this->touching_, 2000);
  EXPECT_GT(this->apart_, 2000);
  EXPECT_GT(this->tight_, 1000);
}

TYPED_TEST(CellSeparation, BoundsOfVolumesHoldForTheirPoints) {
  using S = TypeParam;
  using Wide = typename Placement<S>::Wide;
  for (int i = 0; i < 20000; ++i) {
    const Placement<S> placement(this->random_, i % 2 ? S(1000) : S(1));
    fcl::RSS<S> bv;
    bv.axis = randomPose<S>(this->random_, 1).linear();
    bv.To = this->point();
    for (S& side : bv.l) side = this->uniform(0, 1);
    bv.r = this->uniform(0, S(0.2));
    // Half of the points: the farthest of the volume along one of the octree's axes, and a cell
    // that begins there.
    const int axis = i % 4 < 2 ? i % 3 : -1;
    Wide x = this->uniform(0, 1) * Wide::UnitX() + this->uniform(0, 1) * Wide::UnitY(),
         ball = this->point().template cast<long double>() / 2;
    if (axis >= 0) {
      ball = placement.toMesh(Wide::Unit(axis));
      for (int k = 0; k < 2; ++k)
        x[k] = bv.axis.col(k).template cast<long double>().dot(ball) > 0 ? 1 : 0;
    }
    Wide p = bv.To.template cast<long double>() + ball * (long double)(bv.r);
    for (int k = 0; k < 2; ++k)
      p += bv.axis.col(k).template cast<long double>() * x[k] * (long double)(bv.l[k]);
    p = placement.inOctree(p);
    fcl::AABB<S> cell = this->cellAt(p);
    if (axis >= 0) {
      const S side = cell.max_[axis] - cell.min_[axis];
      cell.min_[axis] = S(p[axis]);
      cell.max_[axis] = cell.min_[axis] + side;
    }
    const adaptive_bvh::VolumeInOctree volume(adaptive_bvh::sweptBoxOf(bv), placement.into());
    const adaptive_bvh::CellExtent extent(inDouble(cell));
    this->judge(p, cell, volume.isApart(extent), volume.distance(extent));
  }
  EXPECT_GT(this->touching_, 2000);
  EXPECT_GT(this->apart_, 1000);
  EXPECT_GT(this->tight_, 500);
}

}  // namespace octree_test
}  // namespace adaptive_bvh_test
