// LineSeparation: never more than the vertices below two nodes are apart along the line, in long
// double; and as much as that where boxes are tight.
#include "query/line_separation.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "model_state.h"
#include "query/box_pair.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "volume/volume_separation.h"

namespace adaptive_bvh_test {
namespace line_separation_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::LineSeparation;
using adaptive_bvh::PlacedMesh;
using exact::Real;

template <typename S>
class Line : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;
  using P = Vector3<S>;
  using Model = AdaptiveBVHModel<BV>;

  /// Turned by their vertices: volumes are inflated. The second may lie far from its origin.
  void place(int round) {
    const fcl::Transform3<S> turned = randomPose<S>(random_, 1);
    auto move = [&](Model& model, const TriangleMesh<S>& mesh, const P& shift) {
      model = Model();
      fillModel(mesh, model);
      auto positions = mesh.vertices;
      for (P& p : positions) p = turned * p + shift;
      model.update(positions);
    };
    move(first_, tube<S>(6, 8), P::Zero());
    move(second_, dome<S>(9, 5), round % 3 ? P(P::Constant(S(round % 7))) : P(P::Constant(100)));
    tf1_ = randomPose<S>(random_, 2);
    tf2_ = randomPose<S>(random_, 2);
    R_ = tf1_.linear().transpose() * tf2_.linear();
    T_ = tf1_.linear().transpose() * (tf2_.translation() - tf1_.translation());
  }

  static const auto& tree(const Model& model) {
    return adaptive_bvh::detail::ModelAccess<BV>::tree(model);
  }
  double error() const {
    const adaptive_bvh::BoxPair boxes(*tree(first_).boxes, tf1_, *tree(second_).boxes, tf2_);
    const adaptive_bvh::VolumeSeparation<BV> volumes(R_, T_, tree(first_).motion.coordinateSum(),
                                                     tree(second_).motion.coordinateSum());
    return boxes.error() + double(volumes.error());
  }
  LineSeparation<BV> line(const P& direction) const {
    LineSeparation<BV> line({&first_, &tree(first_), tf1_}, {&second_, &tree(second_), tf2_}, R_,
                            T_, error());
    line.lookAlong(direction);
    return line;
  }

  /// Of the vertices below a node, placed.
  static Real farthest(const Model& model, int node, const exact::Point& n,
                       const exact::Placement& placed) {
    const auto& bv = model.getBV(node);
    Real most = -std::numeric_limits<Real>::max();
    for (int i = 0; i < bv.num_primitives; ++i) {
      const auto at = tree(model).topology.slots.verticesOf(std::size_t(bv.first_primitive + i));
      for (unsigned v : at) most = std::max(most, n.dot(placed(exact::of(model.vertices[v]))));
    }
    return most;
  }
  Real separation(int node1, int node2, const P& direction) const {
    const exact::Point n = exact::of(direction);
    return -farthest(second_, node2, -n, {exact::of(R_), exact::of(T_)}) -
           farthest(first_, node1, n, {});
  }

  std::mt19937 random_{testSeed(5)};
  RandomGeometry<S> geometry_{5};
  Model first_, second_;
  fcl::Transform3<S> tf1_, tf2_;
  fcl::Matrix3<S> R_;
  P T_;
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Line, Scalars);

TYPED_TEST(Line, NeverExceedsTheVertices) {
  for (int round = 0; round < 60; ++round) {
    this->place(round);
    for (int k = 0; k < 30; ++k) {
      const auto direction = this->geometry_.direction();
      const auto line = this->line(direction);
      const int node1 = int(this->random_() % unsigned(this->first_.getNumBVs()));
      const int node2 = int(this->random_() % unsigned(this->second_.getNumBVs()));
      const Real most = this->separation(node1, node2, direction);
      ASSERT_LE(Real(line(node1, node2, true)), most) << round;
      ASSERT_LE(Real(line(node1, node2, false)), most) << round;
      ASSERT_LE(line(node1, node2, false), line(node1, node2, true)) << round;
    }
  }
}

/// Along an axis of a body's boxes only the errors are missing on its side.
TYPED_TEST(Line, IsThatOfTightBoxes) {
  using P = Vector3<TypeParam>;
  this->place(1);
  this->R_.setIdentity();
  const auto& frame = this->tree(this->first_).boxes->frame;
  const P direction = frame.axes().col(0).template cast<TypeParam>();
  const auto line = this->line(direction);
  const auto loss = [&](int node) {
    return double(this->separation(node, 0, direction)) - line(node, 0, false);
  };
  const double of_second = loss(0);
  for (int node = 0; node < this->first_.getNumBVs(); ++node)
    EXPECT_NEAR(loss(node), of_second, 1e-4) << node;
}

}  // namespace line_separation_test
}  // namespace adaptive_bvh_test
