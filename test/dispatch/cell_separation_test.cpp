// The bounds of an octree's cells and triangles, boxes and swept spheres, against points of these
// in long double.
#include "dispatch/cell_separation.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "dispatch/octree_cells.h"
#include "dispatch/octree_nodes.h"
#include "fcl/fcl_nodes.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace cell_separation_test {

/// A mesh and an octree, both far from the world's origin, and where points of the one lie in the
/// other's coordinates, in more digits than S.
struct Placement {
  using Wide = Eigen::Matrix<long double, 3, 1>;

  Placement(std::mt19937& random, double far) {
    octree_tf = randomPose(random, far);
    mesh_tf = randomPose(random, 2.);
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

  adaptive_bvh::IntoOctree into() const { return {mesh_tf, octree_tf}; }

  fcl::Transform3d mesh_tf, octree_tf;
};

class CellSeparation : public testing::Test {
 protected:
  using Wide = typename Placement::Wide;

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  fcl::Vector3d point() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  /// A cell that just reaches to a point, from a side, an edge or a corner, or some way off.
  fcl::AABBd cellAt(const Wide& p) {
    const double side = std::pow(10., uniform(-2, 1));
    const double off = uniform(0, 1) < 0.5 ? 0 : uniform(0, 1);
    fcl::AABBd cell;
    for (int k = 0; k < 3; ++k) {
      const int choice = std::uniform_int_distribution<int>(0, 2)(random_);
      const double from = choice == 0 ? -side - off : choice == 1 ? off : -uniform(0, side);
      cell.min_[k] = double(p[k]) + from;
      cell.max_[k] = cell.min_[k] + side;
    }
    return cell;
  }

  static long double distance(const Wide& p, const fcl::AABBd& cell) {
    const Wide low = cell.min_.template cast<long double>(),
               high = cell.max_.template cast<long double>();
    return (low - p).cwiseMax(p - high).cwiseMax(Wide::Zero()).norm();
  }

  /// `isApart` and `bound` of a body that holds p.
  void judge(const Wide& p, const fcl::AABBd& cell, bool is_apart, double bound) {
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

TEST_F(CellSeparation, BoundsOfTrianglesHoldForTheirPoints) {
  using Wide = typename Placement::Wide;
  for (int i = 0; i < 20000; ++i) {
    const Placement placement(this->random_, i % 2 ? 1000. : 1.);
    fcl::Vector3d a = this->point(), b = this->point(), c = this->point();
    if (i % 5 == 1) c = (a + b) / 2;
    if (i % 5 == 2) c = a + 1e-5 * c;
    if (i % 5 == 3) b = c = a;
    const long double u = this->uniform(0, 1), v = this->uniform(0, 1 - double(u));
    const Wide p =
        placement.inOctree((1 - u - v) * a.template cast<long double>() +
                           u * b.template cast<long double>() + v * c.template cast<long double>());
    const fcl::AABBd cell = this->cellAt(p);
    const fcl::Vector3d corners[] = {a, b, c};
    const adaptive_bvh::IntoOctree into = placement.into();
    const adaptive_bvh::CellExtent extent(cell);
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
TEST_F(CellSeparation, BoundsOfBoxesHoldForTheirTriangles) {
  using Wide = typename Placement::Wide;
  using adaptive_bvh::MeshNode;
  for (int round = 0; round < 100; ++round) {
    const Placement placement(this->random_, round % 2 ? 1000. : 1.);
    TriangleMesh mesh = dome(6, 3);
    for (fcl::Vector3d& p : mesh.vertices) p += 0.1 * this->point();
    const adaptive_bvh::DeformableMesh body(mesh);
    const BodyView model(body);
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
        const double u = this->uniform(0, 1), v = this->uniform(0, 1 - u);
        const auto at = [&](int k) -> Wide {
          return model.vertices[corners[std::size_t(k)]].template cast<long double>();
        };
        const Wide p = placement.inOctree((1 - (long double)(u)-v) * at(0) +
                                          (long double)(u)*at(1) + (long double)(v)*at(2));
        const fcl::AABBd cell = this->cellAt(p);
        const adaptive_bvh::CellExtent extent(cell);
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

TEST_F(CellSeparation, BoundsOfVolumesHoldForTheirPoints) {
  using Wide = typename Placement::Wide;
  for (int i = 0; i < 20000; ++i) {
    const Placement placement(this->random_, i % 2 ? 1000. : 1.);
    fcl::RSSd bv;
    bv.axis = randomPose(this->random_, 1).linear();
    bv.To = this->point();
    for (double& side : bv.l) side = this->uniform(0, 1);
    bv.r = this->uniform(0, 0.2);
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
    fcl::AABBd cell = this->cellAt(p);
    if (axis >= 0) {
      const double side = cell.max_[axis] - cell.min_[axis];
      cell.min_[axis] = double(p[axis]);
      cell.max_[axis] = cell.min_[axis] + side;
    }
    const adaptive_bvh::VolumeInOctree volume(adaptive_bvh::sweptBoxOf(bv), placement.into());
    const adaptive_bvh::CellExtent extent(cell);
    this->judge(p, cell, volume.isApart(extent), volume.distance(extent));
  }
  EXPECT_GT(this->touching_, 2000);
  EXPECT_GT(this->apart_, 1000);
  EXPECT_GT(this->tight_, 500);
}

}  // namespace cell_separation_test
}  // namespace adaptive_bvh_test
