// BoxPair: the gaps of boxes, in the frame of either body, against the distances of the triangles
// below them in long double.
#include "query/box_pair.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "model_state.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace box_pair_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::Box;
using adaptive_bvh::Boxes4;
using adaptive_bvh::BoxNodes;
using adaptive_bvh::BoxPair;
using adaptive_bvh::BoxTree;
using adaptive_bvh::Float4;
using adaptive_bvh::FrameChange;
using adaptive_bvh::Gaps4x4;
using exact::Real;

/// A mesh in place, with the box tree of its model.
template <typename S>
class PlacedBoxes {
 public:
  using BV = fcl::RSS<S>;

  PlacedBoxes(const TriangleMesh<S>& mesh, const fcl::Transform3<S>& tf) : tf_(tf) {
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, model_));
    const exact::Placement placed = exact::placement(tf);
    for (int i = 0; i < model_.getNumBVs(); ++i) {
      const auto& node = model_.getBV(i);
      exact::Triangle corners{};
      if (node.isLeaf()) {
        const fcl::Triangle& t = model_.tri_indices[node.primitiveId()];
        for (int k = 0; k < 3; ++k) corners[std::size_t(k)] = exact::of(model_.vertices[t[k]]);
      }
      triangles_.push_back(placed(corners));
    }
  }

  int nodes() const { return model_.getNumBVs(); }
  bool isLeaf(int node) const { return model_.getBV(node).isLeaf(); }
  int left(int node) const { return model_.getBV(node).leftChild(); }
  const exact::Triangle& triangle(int leaf) const { return triangles_[std::size_t(leaf)]; }
  const BoxTree<S>& boxes() const {
    return *adaptive_bvh::detail::ModelAccess<BV>::tree(model_).boxes;
  }
  Boxes4 box(int node) const {
    const Box box = boxes().nodes().box(node);
    return adaptive_bvh::boxes4(box, box, box, box);
  }
  const fcl::Transform3<S>& tf() const { return tf_; }
  void moveBy(const Vector3<S>& shift) {
    std::vector<Vector3<S>> positions(model_.vertices, model_.vertices + model_.num_vertices);
    for (auto& p : positions) p += shift;
    model_.update(positions);
  }

 private:
  AdaptiveBVHModel<BV> model_;
  fcl::Transform3<S> tf_;
  std::vector<exact::Triangle> triangles_;  // in the world, by leaf
};

/// By pair of nodes: the distance of the triangles below. Children come after their parents.
template <typename S>
std::vector<std::vector<Real>> distances(const PlacedBoxes<S>& a, const PlacedBoxes<S>& b) {
  std::vector<std::vector<Real>> d(std::size_t(a.nodes()),
                                   std::vector<Real>(std::size_t(b.nodes())));
  for (int i = a.nodes() - 1; i >= 0; --i)
    for (int j = b.nodes() - 1; j >= 0; --j) {
      const auto at = [&](int m, int n) -> Real& { return d[std::size_t(m)][std::size_t(n)]; };
      if (!a.isLeaf(i))
        at(i, j) = std::min(at(a.left(i), j), at(a.left(i) + 1, j));
      else if (!b.isLeaf(j))
        at(i, j) = std::min(at(i, b.left(j)), at(i, b.left(j) + 1));
      else
        at(i, j) = exact::distance(a.triangle(i), b.triangle(j));
    }
  return d;
}

template <typename S>
class Gaps : public testing::Test {
 protected:
  /// Eight to eighteen triangles of a size: a sheet, a hose, a soup; stretched, or pressed flat.
  TriangleMesh<S> mesh(S size, S offset) {
    auto& engine = random_.engine();
    TriangleMesh<S> mesh = random_.oneIn(3)   ? plate<S>(2, 2)
                           : random_.oneIn(2) ? tube<S>(3, 3)
                                              : soup<S>(10, engine);
    Vector3<S> stretch = Vector3<S>::Ones();
    if (random_.oneIn(2)) stretch[random_.below(3)] = random_.oneIn(2) ? S(0) : S(1e-4);
    const fcl::Matrix3<S> turn = random_.rotation();
    const Vector3<S> shift = random_.point() * offset;
    for (auto& p : mesh.vertices) p = (turn * stretch.cwiseProduct(p)) * size + shift;
    return mesh;
  }

  /// Every pair of nodes: no gap, in either frame, claims more than the true distance. Returns the
  /// share of pairs of leaves that are apart whose gap claims half of it at least.
  double judge(const PlacedBoxes<S>& a, const PlacedBoxes<S>& b) {
    const BoxPair pair(a.boxes(), a.tf(), b.boxes(), b.tf());
    if (!pair.isPrecise()) return -1;
    const auto true_distances = distances(a, b);
    int apart = 0, good = 0;
    for (int i = 0; i < a.nodes(); ++i)
      for (int j = 0; j < b.nodes(); ++j) {
        const Real d = true_distances[std::size_t(i)][std::size_t(j)];
        const double claim = judgePair(pair, a.box(i), b.box(j), d);
        if (!a.isLeaf(i) || !b.isLeaf(j) || d <= 0) continue;
        ++apart;
        good += Real(claim) > d / 2;
      }
    return apart > 0 ? double(good) / apart : -1;
  }

  /// A distance that is larger than the true one must ask for a larger gap than there is.
  static double judgePair(const BoxPair& pair, const Boxes4& a, const Boxes4& b, Real d) {
    const Gaps4x4 first = adaptive_bvh::squaredGaps(a, pair.toFirst()(b));
    Gaps4x4 both = first;
    pair.raiseBySecond(pair.toSecond()(a), b, both);
    EXPECT_LE(first(2, 1), both(2, 1)) << "the larger of both";
    EXPECT_EQ(both(0, 0), both(3, 2)) << "in all lanes";
    S more = S(d);
    while (Real(more) <= d) more = std::nextafter(more, std::numeric_limits<S>::infinity());
    for (const float gap : {first(0, 0), both(0, 0)}) {
      EXPECT_LE(Real(pair.distanceFor(gap)), d);
      EXPECT_LT(gap, pair.squaredGapFor(more)) << "taken to be apart by more than they are";
    }
    return pair.distanceFor(both(0, 0));
  }

  RandomGeometry<S> random_{7};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Gaps, Scalars);

/// Of bodies of all sizes and proportions, turned against each other in all ways: touching, beside
/// each other, and far apart.
TYPED_TEST(Gaps, NeverClaimMoreThanTheDistanceOfTheTriangles) {
  using S = TypeParam;
  int judged = 0, useful = 0;
  for (int round = 0; round < 150 && !testing::Test::HasFailure(); ++round) {
    const S size_a = this->random_.size(-6, 6);
    const S other = std::min(std::max(size_a * this->random_.size(-4, 4), S(1e-6)), S(1e6));
    const S size_b = this->random_.oneIn(2) ? size_a : other;
    const PlacedBoxes<S> a(this->mesh(size_a, 0), this->random_.pose(size_a));
    const S away = (size_a + size_b) * (this->random_.oneIn(3) ? 1 : this->random_.size(-1, 3));
    const PlacedBoxes<S> b(this->mesh(size_b, 0), this->random_.pose(away));
    SCOPED_TRACE(round);
    const double share = this->judge(a, b);
    judged += share >= 0;
    useful += share > 0.2;
  }
  EXPECT_GT(judged, 140);
  EXPECT_GT(useful, judged / 3) << "a gap of 0 would hold as well";
}

/// Meshes whose vertices lie far from their own origin, next to each other in the world.
TYPED_TEST(Gaps, HoldForMeshesFarFromTheirOrigin) {
  using S = TypeParam;
  for (int round = 0; round < 80 && !testing::Test::HasFailure(); ++round) {
    const S offset = this->random_.size(0, 3);
    fcl::Transform3<S> tf = this->random_.pose(0);
    const TriangleMesh<S> mesh = this->mesh(1, offset);
    const PlacedBoxes<S> a(mesh, tf);
    tf.translation() += this->random_.vectorOfSize(2);
    SCOPED_TRACE(round);
    this->judge(a, PlacedBoxes<S>(mesh, tf));
  }
}

/// Poses far from the world's origin: what two bodies are apart is small beside either's place.
TYPED_TEST(Gaps, HoldForBodiesFarFromTheWorldsOrigin) {
  using S = TypeParam;
  for (int round = 0; round < 80 && !testing::Test::HasFailure(); ++round) {
    const S far = this->random_.size(2, 6);
    const PlacedBoxes<S> a(this->mesh(1, 1), this->random_.pose(far));
    fcl::Transform3<S> tf = a.tf();
    tf.linear() = this->random_.rotation();
    tf.translation() += this->random_.point() * 3;
    SCOPED_TRACE(round);
    this->judge(a, PlacedBoxes<S>(this->mesh(1, 1), tf));
  }
}

/// Also after a step, when the boxes have moved along and their origin with them.
TYPED_TEST(Gaps, HoldAfterAStep) {
  using S = TypeParam;
  const fcl::Transform3<S> origin = fcl::Transform3<S>::Identity();
  for (int round = 0; round < 20 && !testing::Test::HasFailure(); ++round) {
    const TriangleMesh<S> mesh = this->mesh(1, 0);
    TriangleMesh<S> moved = mesh;
    const Vector3<S> shift(3, -2, S(0.5) * S(round));
    for (auto& p : moved.vertices) p += shift;
    PlacedBoxes<S> judged(moved, origin), stepped(mesh, origin);
    stepped.moveBy(shift);
    const PlacedBoxes<S> other(this->mesh(1, 1), this->random_.pose(2));
    const BoxPair pair(stepped.boxes(), origin, other.boxes(), other.tf());
    const Real d = distances(judged, other)[0][0];  // of the roots: of all triangles
    this->judgePair(pair, stepped.box(0), other.box(0), d);
  }
}

/// Boxes side by side in one frame: the gap is theirs, to the last error term.
TYPED_TEST(Gaps, IsTheDistanceOfBoxesThatStandAlike) {
  using S = TypeParam;
  const fcl::Transform3<S> origin = fcl::Transform3<S>::Identity();
  fcl::Transform3<S> beside = origin;
  beside.translation() = Vector3<S>(3, 4, 12);  // of plates of 1 x 1 in z = 0
  const PlacedBoxes<S> a(plate<S>(2, 2), origin), b(plate<S>(2, 2), beside);
  const BoxPair pair(a.boxes(), a.tf(), b.boxes(), b.tf());
  const float gap = adaptive_bvh::squaredGaps(a.box(0), pair.toFirst()(b.box(0)))(0, 0);
  EXPECT_NEAR(std::sqrt(4. + 9 + 144), pair.distanceFor(gap), 1e-3);
  EXPECT_FLOAT_EQ(1, pair.ratio());
  EXPECT_EQ(0, pair.distanceFor(0));
  EXPECT_LE(pair.squaredGapNear(S(std::sqrt(157.))), gap) << "exact boxes would prune";
  EXPECT_GT(pair.squaredGapFor(S(std::sqrt(157.))), gap) << "these do not";
  EXPECT_GT(pair.squaredGapNear(S(12.54)), gap) << "nor would exact ones";
}

/// Where the bodies are so far apart, or so unequal, that single precision will not do, it says so.
TYPED_TEST(Gaps, KnowWhereTheyAreNotPrecise) {
  using S = TypeParam;
  const fcl::Transform3<S> origin = fcl::Transform3<S>::Identity();
  const auto scaled = [](S size) {
    TriangleMesh<S> mesh = plate<S>(2, 2);
    for (auto& p : mesh.vertices) p *= size;
    return mesh;
  };
  fcl::Transform3<S> away = origin;
  away.translation()[0] = S(1e24);
  const PlacedBoxes<S> one(scaled(1), origin), far(scaled(1), away), large(scaled(S(1e7)), origin);
  const auto isPrecise = [](const PlacedBoxes<S>& a, const PlacedBoxes<S>& b) {
    return BoxPair(a.boxes(), a.tf(), b.boxes(), b.tf()).isPrecise();
  };
  EXPECT_TRUE(isPrecise(one, one));
  EXPECT_FALSE(isPrecise(one, far));
  EXPECT_FALSE(isPrecise(one, large));
  EXPECT_FALSE(isPrecise(large, one));
}

/// A box in another frame holds all its corners there.
TEST(FrameChange, BoxesWhatItTurns) {
  RandomGeometry<double> random(9);
  for (int round = 0; round < 5000; ++round) {
    const fcl::Matrix3d m = random.rotation() * random.size(-2, 2);
    const fcl::Vector3d t = random.point();
    const Float4 center = Float4{1, -2, 3, 0} * float(random.uniform()), half{0.5f, 2, 0.1f, 0};
    const Box box{center - half, center + half}, other{half, half + half};
    const Box turned = FrameChange(m, t)(adaptive_bvh::boxes4(other, box, other, other)).box(1);
    for (int corner = 0; corner < 8; ++corner) {
      fcl::Vector3d y;
      for (int k = 0; k < 3; ++k) y[k] = double(corner >> k & 1 ? box.high[k] : box.low[k]);
      y = m * y + t;
      const double error = 1e-6 * (y.norm() + t.norm());
      for (int k = 0; k < 3; ++k) {
        ASSERT_GE(y[k], double(turned.low[k]) - error);
        ASSERT_LE(y[k], double(turned.high[k]) + error);
      }
    }
  }
}

/// The gap of two boxes along several axes is the distance of their nearest corners; each lane has
/// its own.
TEST(SquaredGaps, AreThoseOfTheNearestCorners) {
  const auto box = [](float x, float y, float z) {
    const Float4 center{x, y, z, 0}, half{1, 1, 1, 0};
    return Box{center - half, center + half};
  };
  const Boxes4 a = adaptive_bvh::boxes4(box(1, 0, 0), box(2, 0, 0), box(3, 0, 0), box(-3, 4, -5));
  const Boxes4 b = adaptive_bvh::boxes4(box(9, 9, 9), box(0, 0, 0), box(3, 0, 1), box(9, 9, 9));
  const Gaps4x4 gaps = adaptive_bvh::squaredGaps(a, b);
  EXPECT_EQ(0, gaps(0, 1)) << "overlap";
  EXPECT_EQ(0, gaps(1, 1)) << "touch";
  EXPECT_EQ(1, gaps(2, 1));
  EXPECT_EQ(14, gaps(3, 1));
  EXPECT_EQ(0, gaps(2, 2));
  EXPECT_EQ(6 * 6 + 7 * 7 + 7 * 7, gaps(0, 0));
}

}  // namespace box_pair_test
}  // namespace adaptive_bvh_test
