// What the distance of two meshes prunes by, against the distances of the triangles in long double:
// gaps of boxes of two trees, TriangleBlock on the corners of two leaves, slabs of leaves and of
// nodes, and supports along a line.
#include "query/nearest/nearest_search.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace nearest_search_test {

using adaptive_bvh::BoxGaps;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::DistanceQuery;
using adaptive_bvh::Float4;
using adaptive_bvh::Gaps4x4;
using adaptive_bvh::LeafBlocks;
using adaptive_bvh::LineSeparation;
using adaptive_bvh::NearestPair;
using adaptive_bvh::NearestSearch;
using adaptive_bvh::PlacedMesh;
using adaptive_bvh::RelativeFrame;
using adaptive_bvh::Supports;
using adaptive_bvh::TreePair;
using adaptive_bvh::TriangleBlock;
using adaptive_bvh::TriangleSeparation;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideTree;
using exact::Real;

/// How many places of triangles lie below a lane of a node, and the first of them.
struct Range {
  int first, count;
};
Range placesBelow(const WideTree& tree, int number, int lane) {
  const WideNode& node = tree.nodes()[number];
  if (node.isLeaf()) return {node.first + lane, 1};
  Range all{-1, 0};
  const int below = node.below[lane];
  for (int i = 0; i < int(tree.nodes()[below].count); ++i) {
    const Range part = placesBelow(tree, below, i);
    if (all.count == 0) all.first = part.first;
    all.count += part.count;
  }
  return all;
}

/// The largest along(vertex) of the triangles below a lane of a node.
template <typename Along>
Real farthestBelow(const WideTree& tree, int number, int lane, const Along& along) {
  const Range places = placesBelow(tree, number, lane);
  Real farthest = -std::numeric_limits<Real>::max();
  for (int i = places.first; i < places.first + places.count; ++i)
    for (int k = 0; k < 3; ++k)
      farthest = std::max(farthest, along(std::size_t(tree.corners(unsigned(i))[k])));
  return farthest;
}

/// Two meshes, placed, with the distances of all pairs of triangles in the first one's frame, once
/// they are computed, and how far what lies below each box reaches along a line.
class JudgedPair {
 public:
  JudgedPair(const TriangleMesh& triangles1, const fcl::Transform3d& tf1,
             const TriangleMesh& triangles2, const fcl::Transform3d& tf2)
      : mesh1_(triangles1),
        mesh2_(triangles2),
        first(mesh1_, tf1),
        second(mesh2_, tf2),
        trees(first, second),
        placed_{exact::of(trees.toFirst().R), exact::of(trees.toFirst().T)} {}

  void computeDistances() {
    for (int i = 0; i < size1(); ++i)
      for (int j = 0; j < size2(); ++j) {
        distances_.push_back(exact::distance(corners(first, i), placed_(corners(second, j))));
        if (distances_.back() < least_) nearest_ = {i, j};
        least_ = std::min(least_, distances_.back());
      }
  }
  Real least() const { return least_; }
  /// Of the triangles at two places.
  Real distance(int i, int j) const { return distances_[std::size_t(i * size2() + j)]; }
  /// Of the triangles below lanes of two nodes.
  Real distance(int node1, int lane1, int node2, int lane2) const {
    const Range a = placesBelow(first.tree(), node1, lane1),
                b = placesBelow(second.tree(), node2, lane2);
    Real least = std::numeric_limits<Real>::max();
    for (int i = a.first; i < a.first + a.count; ++i)
      for (int j = b.first; j < b.first + b.count; ++j) least = std::min(least, distance(i, j));
    return least;
  }
  /// Calls act(node1, node2) for all pairs.
  template <typename Do>
  void forEachPair(const Do& act) const {
    for (int n1 = 0; n1 < first.tree().size(); ++n1)
      for (int n2 = 0; n2 < second.tree().size(); ++n2) act(n1, n2);
  }
  /// Computes how far apart along a line, given in the first mesh's frame, the triangles below
  /// boxes are.
  void project(const exact::Point& n) {
    const auto in_first = [&](const exact::Point& x) -> Real { return n.dot(x) / n.norm(); };
    reach1_ = reaches(mesh1_, first.tree(), in_first);
    reach2_ = reaches(mesh2_, second.tree(),
                      [&](const exact::Point& x) -> Real { return -in_first(placed_(x)); });
  }
  Real separation(int node1, int lane1, int node2, int lane2) const {
    return -reach1_[std::size_t(node1)][std::size_t(lane1)] -
           reach2_[std::size_t(node2)][std::size_t(lane2)];
  }

  /// By so much a separation of nodes may be off: section 18 of docs/bounds.md.
  double separationError() const {
    const auto size = [](const PlacedMesh& mesh) -> double {
      return mesh.bounds().aabb_center.template lpNorm<1>() + 2 * mesh.bounds().aabb_radius;
    };
    return 8 * std::numeric_limits<double>::epsilon() *
           (trees.toFirst().T.template lpNorm<1>() + size(first) + size(second));
  }

  /// Between the middles of the nearest triangles, in the first mesh's frame.
  fcl::Vector3d line() const {
    exact::Point along = exact::Point::Zero();
    const exact::Triangle p = corners(first, nearest_.first),
                          q = placed_(corners(second, nearest_.second));
    for (std::size_t k = 0; k < 3; ++k) along += q[k] - p[k];
    return along.norm() > 0 ? fcl::Vector3d(along.normalized().cast<double>())
                            : fcl::Vector3d(fcl::Vector3d::UnitX());
  }

 private:
  const DeformableMesh mesh1_, mesh2_;

 public:
  const PlacedMesh first, second;
  TreePair trees;

 private:
  int size1() const { return numTriangles(mesh1_); }
  int size2() const { return numTriangles(mesh2_); }
  template <typename Along>
  static std::vector<std::array<Real, 4>> reaches(const DeformableMesh& mesh, const WideTree& tree,
                                                  const Along& along) {
    std::vector<Real> of_vertex;
    for (const fcl::Vector3d& x : mesh.vertices()) of_vertex.push_back(along(exact::of(x)));
    std::vector<std::array<Real, 4>> of_node(std::size_t(tree.size()));
    for (int number = 0; number < tree.size(); ++number)
      for (int lane = 0; lane < int(tree.nodes()[number].count); ++lane)
        of_node[std::size_t(number)][std::size_t(lane)] = farthestBelow(
            tree, number, lane, [&](std::size_t vertex) -> Real { return of_vertex[vertex]; });
    return of_node;
  }
  static exact::Triangle corners(const PlacedMesh& mesh, int place) {
    const auto points = mesh.pointsAt(unsigned(place));
    return {exact::of(points[0]), exact::of(points[1]), exact::of(points[2])};
  }

  const exact::Placement placed_;
  std::vector<Real> distances_;
  std::vector<std::array<Real, 4>> reach1_, reach2_;
  Real least_ = std::numeric_limits<Real>::max();
  std::pair<int, int> nearest_{0, 0};
};

class NearestBounds : public testing::Test {
 protected:
  using P = fcl::Vector3d;

  /// Eight to forty triangles, or of a given number of cells along a side, rough or smooth; or with
  /// whole numbers as coordinates, so that many faces lie in one plane with others.
  TriangleMesh body(double size) { return body(size, 2 + random_.below(3)); }
  TriangleMesh body(double size, int side) {
    TriangleMesh mesh = random_.oneIn(2) ? plate(side, side) : tube(1 + side, side);
    const bool is_lattice = random_.oneIn(3);
    const double noise = random_.oneIn(2) ? 0.2 : 0.001;
    for (P& p : mesh.vertices) {
      p += noise * random_.point();
      if (is_lattice)
        for (int k = 0; k < 3; ++k) p[k] = std::round(p[k] * 4);
      p *= size;
    }
    if (random_.oneIn(3)) shrink(mesh, size);
    return mesh;
  }
  /// Of about the same size or not, beside each other or far apart; each somewhere in its own
  /// coordinates.
  JudgedPair pair(double most_sizes_apart, double most_ratio, int side = 3) {
    const double size1 = random_.size(-3, 1), size2 = size1 * random_.size(-most_ratio, most_ratio);
    const double reach = std::max(size1, size2);
    TriangleMesh a = body(size1, side), b = body(size2, side + random_.below(2));
    const P at1 = random_.point() * reach * random_.size(-1, 1),
            at2 = random_.point() * reach * random_.size(-1, 1);
    for (P& p : a.vertices) p += at1;
    for (P& p : b.vertices) p += at2;
    const fcl::Transform3d tf1 = random_.pose(reach);
    fcl::Transform3d tf2 = fcl::Transform3d::Identity();
    tf2.linear() = random_.oneIn(4) ? tf1.linear() : random_.rotation();
    if (random_.oneIn(2)) {
      const P away = random_.vectorOfSize(reach * random_.size(-3, most_sizes_apart));
      tf2.translation() = tf1 * P(at1 + away) - tf2.linear() * at2;
    } else {  // two vertices nearly meet
      const P away = random_.vectorOfSize(std::min(size1, size2) * random_.size(-6, 0));
      tf2.translation() = tf1 * P(anyOf(a) + away) - tf2.linear() * anyOf(b);
    }
    return {a, tf1, b, tf2};
  }

  /// All triangles become small, beside a large one: their positions have few digits for their
  /// size.
  void shrink(TriangleMesh& mesh, double size) {
    const double share = random_.size(-5, -2);
    const P at = random_.point() * size;
    for (P& p : mesh.vertices) p = at + share * p;
    const std::size_t first = mesh.vertices.size();
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(random_.point() * size);
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  }
  P anyOf(const TriangleMesh& mesh) {
    return mesh.vertices[std::size_t(random_.below(int(mesh.vertices.size())))];
  }

  /// Expects that no pair of boxes whose triangles are nearer than a distance would be pruned by
  /// it.
  void expectBoxesNearer(const JudgedPair& pair) {
    const RelativeFrame& frame = pair.trees.frame();
    ASSERT_TRUE(frame.isInRange());
    const BoxGaps gaps(pair.trees.first().scale());
    const double scale = pair.trees.first().scale();
    pair.forEachPair([&](int n1, int n2) {
      const WideNode &a = pair.trees.first().nodes()[n1], &b = pair.trees.second().nodes()[n2];
      const Gaps4x4 squared =
          adaptive_bvh::squaredGaps(a.boxes, frame.isSame() ? b.boxes : frame(b.boxes));
      for (int j = 0; j < int(b.count); ++j)
        for (int i = 0; i < int(a.count); ++i) {
          const Real d = pair.distance(n1, i, n2, j);
          const auto above = double(d * (1 + Real(1e-15)) + Real(1e-300));
          ASSERT_LT(squared(i, j), gaps.squaredGapFor(above));
          if (!a.isLeaf() || !b.isLeaf()) continue;
          ++pairs_;
          pruned_ += std::sqrt(double(squared(i, j))) > double(d) / 2 * scale;
        }
    });
  }
  /// Expects that no bound of two triangles of leaves exceeds their distance.
  void expectBlocksNearer(const JudgedPair& pair, const fcl::Vector3d& direction) {
    const WideTree &tree1 = pair.trees.first(), &tree2 = pair.trees.second();
    LeafBlocks blocks(pair.second, pair.trees);
    blocks.lookAlong(adaptive_bvh::vectors::all(
        fcl::Vector3d(tree1.coordinates().axes().transpose() * direction)));
    const Real unit = 1 / Real(tree1.scale());
    pair.forEachPair([&](int n1, int n2) {
      const WideNode &a = tree1.nodes()[n1], &b = tree2.nodes()[n2];
      if (!a.isLeaf() || !b.isLeaf()) return;
      const TriangleBlock block = blocks(n1, n2);
      const std::array<Float4, 4> bounds = {block.bounds<0>(), block.bounds<1>(), block.bounds<2>(),
                                            block.bounds<3>()};
      for (int j = 0; j < int(b.count); ++j)
        for (int i = 0; i < int(a.count); ++i) {
          const Real d = pair.distance(a.first + i, b.first + j);
          const Real bound = (Real(bounds[std::size_t(j)][i]) - Real(blocks.error())) * unit;
          ASSERT_LE(bound, d);
          ++block_pairs_;
          block_pruned_ += bound > d / 2;
        }
    });
  }
  /// Expects that no pair of leaves' triangles that a slab leaves out is as near as the limit.
  void expectSlabsNearer(const JudgedPair& pair) {
    const WideTree &tree1 = pair.trees.first(), &tree2 = pair.trees.second();
    LeafBlocks blocks(pair.second, pair.trees);
    const double scale = tree1.scale();
    pair.forEachPair([&](int n1, int n2) {
      const WideNode &a = tree1.nodes()[n1], &b = tree2.nodes()[n2];
      if (!a.isLeaf() || !b.isLeaf()) return;
      const Real of = pair.distance(a.first + random_.below(int(a.count)),
                                    b.first + random_.below(int(b.count)));
      const double limit = double(of) * scale * double(random_.size(-0.3, 0.1));
      const unsigned near = blocks.near(n1, n2, 0xffff, limit);
      for (int j = 0; j < int(b.count); ++j)
        for (int i = 0; i < int(a.count); ++i) {
          const Real d = pair.distance(a.first + i, b.first + j) * Real(scale);
          slab_pairs_ += d > Real(limit);
          if (near >> (4 * j + i) & 1) continue;
          ASSERT_GT(d, Real(limit));
          ++slab_pruned_;
        }
    });
  }
  /// Expects that no pair of boxes that slabs of nodes separate is as near as the limit.
  void expectNodeSlabsNearer(const JudgedPair& pair) {
    const RelativeFrame& frame = pair.trees.frame();
    if (!frame.isPrecise()) return;
    const WideTree &tree1 = pair.trees.first(), &tree2 = pair.trees.second();
    node_slabs_.compute(pair.trees);
    pair.forEachPair([&](int n1, int n2) {
      const WideNode &a = tree1.nodes()[n1], &b = tree2.nodes()[n2];
      if (a.isLeaf() || b.isLeaf()) return;
      const Real of =
          pair.distance(n1, random_.below(int(a.count)), n2, random_.below(int(b.count)));
      const double limit = double(of) * tree1.scale() * random_.size(-0.3, 0.1);
      node_slabs_.setLimit(limit);
      const unsigned asked = unsigned(random_.below(1 << 16)),
                     apart = node_slabs_.apart(n1, a.boxes, n2,
                                               frame.isSame() ? b.boxes : frame(b.boxes), asked);
      ASSERT_EQ(apart & ~asked, 0u);
      for (int j = 0; j < int(b.count); ++j)
        for (int i = 0; i < int(a.count); ++i) {
          const Real d = pair.distance(n1, i, n2, j) * Real(tree1.scale());
          node_pairs_ += d > Real(limit) && (asked >> (4 * j + i) & 1);
          if (!(apart >> (4 * j + i) & 1)) continue;
          ASSERT_GT(d, Real(limit));
          ++node_pruned_;
        }
    });
  }
  /// Expects of some boxes that the largest limit at which they are separated is how far apart they
  /// are, up to the error; and of one such limit that it is right for all boxes.
  void expectLineNearer(JudgedPair& pair, const fcl::Vector3d& direction) {
    const WideTree &tree1 = pair.trees.first(), &tree2 = pair.trees.second();
    TriangleSeparation triangles(pair.first.mesh.vertices.data(), pair.second.mesh.vertices.data(),
                                 pair.trees.toFirst());
    const fcl::Vector3d from =
        pair.first.mesh.vertices[std::size_t(random_.below(int(pair.first.mesh.vertices.size())))];
    const fcl::Vector3d to = pair.trees.toFirst()(pair.second.bounds().aabb_center);
    triangles.lookAlong(from, from + std::max(1e-3, (to - from).norm()) * direction);
    const auto all = [](int) { return 15u; };
    line_.setParts(tree1, all, tree2, all);
    line_.compute(tree1, tree2, triangles);
    pair.project(exact::of(triangles.direction()));
    const double error = pair.separationError() + 8e-16 * (to - from).norm();
    double limit = 0;
    for (int k = 0; k < 200; ++k) {
      const int n1 = random_.below(tree1.size()), n2 = random_.below(tree2.size());
      const int i = random_.below(int(tree1.nodes()[n1].count)),
                j = random_.below(int(tree2.nodes()[n2].count));
      const Real apart = pair.separation(n1, i, n2, j);
      if (apart <= 0) continue;
      double low = 0, high = 2 * double(apart) + error;
      while (high - low > 1e-17 * high && (low + high) / 2 > low && (low + high) / 2 < high) {
        const double middle = (low + high) / 2;
        line_.setLimit(middle);
        (line_.apart(n1, n2) >> (4 * j + i) & 1 ? low : high) = middle;
      }
      ASSERT_LE(Real(low), apart + Real(error));
      ASSERT_GE(Real(low), apart - Real(error));
      limit = low;
    }
    line_.setLimit(limit);
    pair.forEachPair([&](int n1, int n2) {
      const unsigned apart = line_.apart(n1, n2);
      for (int j = 0; j < int(tree2.nodes()[n2].count); ++j)
        for (int i = 0; i < int(tree1.nodes()[n1].count); ++i)
          if (apart >> (4 * j + i) & 1) {
            ASSERT_GE(pair.separation(n1, i, n2, j), Real(limit) - Real(error));
            ++separated_;
          }
    });
  }
  /// Of boxes and blocks.
  void expectNearer(const JudgedPair& pair) {
    expectBoxesNearer(pair);
    expectBlocksNearer(pair, pair.line());
    expectBlocksNearer(pair, random_.direction());
    expectSlabsNearer(pair);
    expectNodeSlabsNearer(pair);
  }
  /// Along the line between the middles, and any.
  void expectLinesNearer(JudgedPair& pair) {
    const fcl::Vector3d middle = pair.first.bounds().aabb_center,
                        other = pair.trees.toFirst()(pair.second.bounds().aabb_center);
    if ((other - middle).norm() > 0) expectLineNearer(pair, (other - middle).normalized());
    expectLineNearer(pair, random_.direction());
  }

  RandomGeometry random_{61};
  LineSeparation line_;
  long pairs_ = 0, pruned_ = 0, block_pairs_ = 0, block_pruned_ = 0, separated_ = 0;
  long slab_pairs_ = 0, slab_pruned_ = 0, node_pairs_ = 0, node_pruned_ = 0;
  adaptive_bvh::SlabSeparation node_slabs_;
};

/// Trees with coordinates of their own, side by side, and after they got common ones.
TEST_F(NearestBounds, DoNotExceedTheDistancesOfBodiesSideBySide) {
  int same = 0;
  for (int round = 0; round < 120 && !testing::Test::HasFailure(); ++round) {
    SCOPED_TRACE(round);
    auto pair = this->pair(0.3, 0.3);
    pair.computeDistances();
    this->expectNearer(pair);
    pair.trees.align();
    same += pair.trees.frame().isSame();
    this->expectNearer(pair);
  }
  EXPECT_GT(same, 80);
  EXPECT_GT(this->pairs_, 20000);
  EXPECT_GT(this->pruned_, this->pairs_ / 3) << "0 would be a lower bound, too";
  EXPECT_GT(this->block_pruned_, this->block_pairs_ / 2);
  EXPECT_GT(this->slab_pruned_, this->slab_pairs_ / 10);
  EXPECT_GT(this->node_pruned_, this->node_pairs_ / 20);
}

/// Where single precision has hardly a digit for what two bodies are apart.
TEST_F(NearestBounds, DoNotExceedTheDistancesOfBodiesFarApartAndOfOtherSizes) {
  for (int round = 0; round < 200 && !testing::Test::HasFailure(); ++round) {
    SCOPED_TRACE(round);
    auto pair = round % 2 ? this->pair(5, 0.3) : this->pair(1, 5);
    pair.computeDistances();
    this->expectNearer(pair);
    pair.trees.align();
    this->expectNearer(pair);
  }
  EXPECT_GT(this->pruned_, this->pairs_ / 2);
  EXPECT_GT(this->block_pruned_, this->block_pairs_ / 2);
}

/// Along the line between two bodies, and any.
TEST_F(NearestBounds, SeparateOnlyWhatIsSoFarApart) {
  for (int round = 0; round < 40 && !testing::Test::HasFailure(); ++round) {
    SCOPED_TRACE(round);
    auto pair = round % 3 ? this->pair(round % 2 ? 0.3 : 6, 0.5, 10) : this->pair(1, 4, 10);
    this->expectLinesNearer(pair);
    pair.trees.align();
    this->expectLinesNearer(pair);
  }
  EXPECT_GT(this->separated_, 100000);
}

/// Where the line is the normal of both, the separation of nodes is their distance, so that nothing
/// but rounding is missing. (The rotation of a pose in single precision is off by more.)
TEST_F(NearestBounds, SeparateParallelPlatesByTheirDistance) {
  long separated = 0, all = 0;
  for (int round = 0; round < 100; ++round) {
    TriangleMesh low = plate(3, 2), high = plate(2, 3);
    const double gap = this->random_.size(-3, 0);
    for (fcl::Vector3d& p : high.vertices) p[2] += gap;
    const fcl::Transform3d tf = this->random_.pose(1);
    JudgedPair pair(low, tf, high, tf);
    this->expectLineNearer(pair, fcl::Vector3d::UnitZ());
    const double error = std::is_same<double, double>::value ? 2 * pair.separationError() : 1e-5;
    this->line_.setLimit(double(gap) - error);
    pair.forEachPair([&](int n1, int n2) {
      const int lanes =
          int(pair.first.tree().nodes()[n1].count) * int(pair.second.tree().nodes()[n2].count);
      all += lanes;
      unsigned apart = this->line_.apart(n1, n2);
      for (; apart; apart &= apart - 1) ++separated;
    });
  }
  EXPECT_GE(separated, all) << "lanes without a box count in addition";
}

/// Each number is that of the vertices below, up to four roundings; of a part of a tree, that of
/// the vertices in it. Nodes outside of the part are not covered.
TEST_F(NearestBounds, SupportsAreThoseOfTheVertices) {
  for (int round = 0; round < 60; ++round) {
    const DeformableMesh mesh(this->body(this->random_.size(-3, 3), round % 2 ? 12 : 40));
    const PlacedMesh placed(mesh, fcl::Transform3d::Identity());
    const WideTree& tree = placed.tree();
    const fcl::Vector3d n = this->random_.direction();
    const fcl::Vector3d from = mesh.vertices()[0];
    const auto along = [&](std::size_t vertex) -> Real {
      return exact::of(n).dot(exact::of(mesh.vertices()[vertex]) - exact::of(from));
    };
    std::map<int, unsigned> lanes_of;  // of the nodes that were asked for
    const bool is_all = round % 3 == 0;
    Supports supports;
    supports.setPart(tree, [&](int node) {
      return lanes_of[node] = is_all ? 15 : unsigned(this->random_.below(16));
    });
    supports.compute(tree, mesh.vertices().data(), from, n);
    if (round % 2 == 0) {
      EXPECT_FALSE(lanes_of.empty());
    }
    const Real error = Real(4 * 0x1p-53) * 2 * Real(mesh.aabb_radius) * (1 + Real(1e-6));
    // Returns the support of what counts below a node, and judges all numbers on the way.
    const std::function<Real(int, bool)> visit = [&](int number, bool is_covered) -> Real {
      EXPECT_EQ(supports.covers(number), is_covered) << number;
      const WideNode& node = tree.nodes()[number];
      const unsigned lanes = lanes_of.count(number) ? lanes_of[number] : 15;
      Real most = -std::numeric_limits<Real>::infinity();
      for (int lane = 0; lane < int(node.count); ++lane) {
        const bool is_near = is_covered && (lanes >> lane & 1);
        Real of = -std::numeric_limits<Real>::infinity();
        if (!node.isLeaf())
          of = visit(node.below[lane], is_near);
        else if (is_near)
          of = farthestBelow(tree, number, lane, along);
        if (!is_covered) continue;
        const double found = supports[number].lane[lane];
        if (std::isinf(of))
          EXPECT_EQ(found, double(of));
        else
          EXPECT_LE(std::abs(Real(found) - of), error);
        most = std::max(most, of);
      }
      return most;
    };
    visit(0, true);
  }
}

/// Most of a long body is far from a small one: supports are computed for the rest alone.
TEST_F(NearestBounds, DistancesOfLongBodiesAndSmallOnes) {
  for (int round = 0; round < 40; ++round) {
    const double size = this->random_.size(-3, 3);
    TriangleMesh hose = this->body(size, 16), part = this->body(size / 3., 3);
    const double length = double(this->random_.below(20));
    for (fcl::Vector3d& p : hose.vertices) p[1] *= 1 + length;
    const fcl::Vector3d on = hose.vertices[std::size_t(this->random_.below(256))],
                        away = this->random_.vectorOfSize(size * this->random_.size(-5, 0));
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = this->random_.rotation();
    tf.translation() = on + away - tf.linear() * part.vertices[0];
    const bool is_first = round % 2;
    const fcl::Transform3d still = fcl::Transform3d::Identity();
    JudgedPair pair(is_first ? hose : part, is_first ? still : tf, is_first ? part : hose,
                    is_first ? tf : still);
    pair.computeDistances();
    const fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    NearestPair nearest(pair.first, pair.second, {request, result});
    NearestSearch(pair.first, pair.second, nearest).run();
    const double extent = double(hose.vertices.back().norm() + size + tf.translation().norm());
    ASSERT_NEAR(
        double(pair.least()), double(result.min_distance),
        1e-13 * extent + 4 * double(std::numeric_limits<double>::epsilon()) * double(pair.least()))
        << round;
  }
}

/// The answer where single precision cannot express how two bodies lie, or their sizes: no lane
/// without a triangle, and no pair of triangles too few.
TEST_F(NearestBounds, AreOfNoUseOutOfTheRangeOfSinglePrecision) {
  const std::vector<double> exponents = {-60, -25, -12, 0, 12, 25, 60};
  for (const double size : exponents)
    for (const double apart : exponents) {
      TriangleMesh other = this->body(1);
      for (fcl::Vector3d& p : other.vertices) p *= double(std::pow(10., size));
      fcl::Transform3d tf = fcl::Transform3d::Identity();
      tf.translation()[0] = double(std::pow(10., apart));
      tf.linear() = this->random_.rotation();
      JudgedPair pair(this->body(1), fcl::Transform3d::Identity(), other, tf);
      pair.computeDistances();
      const fcl::DistanceRequestd request;
      fcl::DistanceResultd result;
      NearestPair nearest(pair.first, pair.second, {request, result});
      NearestSearch(pair.first, pair.second, nearest).run();
      const double error =
          1e-13 * (1 + std::pow(10., size) + std::pow(10., apart)) +
          2 * double(std::numeric_limits<double>::epsilon()) * double(pair.least());
      ASSERT_NEAR(double(pair.least()), double(result.min_distance), error) << size << ' ' << apart;
    }
}

/// Gaps that underflow when they are squared: two boxes that touch are never pruned.
TEST(NearestBoxGaps, TouchingBoxesAreNotPrunedHoweverSmallTheLimit) {
  for (const double scale : {1e-30, 1., 1e30})
    for (const double distance : {0., 1e-300, 1e-40, 1e-20, 1e-10, 1e300})
      EXPECT_GT(BoxGaps(scale).squaredGapFor(distance), 0);
}

}  // namespace nearest_search_test
}  // namespace adaptive_bvh_test
