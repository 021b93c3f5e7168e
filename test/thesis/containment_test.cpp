// A million volumes, each held against all of its triangles in numbers that are finer than the
// model's: over random chains of a thousand frames, far from the origin, tiny and huge, in float
// and double, under every policy and by every way to bring in a frame. Failures print the seed.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/containment.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace containment_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

constexpr int kFramesOfAChain = 1000;
const auto kChains = unsigned(manySteps(6));

/// One chain of frames, all of it drawn from a seed.
template <typename BV>
class Chain {
 public:
  using S = typename BV::S;

  explicit Chain(unsigned seed) : random_(testSeed(seed)) {
    const TriangleMesh shapes[] = {plate(4, 5), tube(5, 4), dome(6, 3), soup(40, random_)};
    mesh_ = shapes[seed % 4];
    scale_ = std::pow(S(10), S(between(-3, 3)));
    const S far = seed % 3 == 0 ? S(0) : std::pow(S(10), S(between(0, 6)));
    offset_ = fcl::Vector3<S>(S(between(-1, 1)), S(between(-1, 1)), S(between(-1, 1))) * far;
    positions_ = pointsIn<S>(mesh_.vertices);
    for (fcl::Vector3<S>& p : positions_) p = scale_ * p + offset_;
    for (std::size_t v = 0; v < positions_.size(); ++v)
      mesh_.vertices[v] = positions_[v].template cast<double>();
    setPolicy();
    fillModel(mesh_, model_);
    fillModel(dome(5, 3), other_);
  }

  void run(long& checked, int& failed) {
    for (int frame = 0; frame < kFramesOfAChain; ++frame) {
      move();
      takeOver();
      if (oneIn(3)) query();
      if (oneIn(97)) setPolicy();
      failed += failures(model_, checked);
    }
  }

 private:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool oneIn(int n) { return std::uniform_int_distribution<int>(1, n)(random_) == 1; }

  void setPolicy() {
    const auto criterion =
        static_cast<FitnessCriterion>(std::uniform_int_distribution<int>(0, 8)(random_));
    RefitPolicy policy = oneIn(3) ? RefitPolicy::thesis(criterion) : RefitPolicy();
    if (oneIn(2)) policy.criterion = criterion;
    model_.setRefitPolicy(policy);
  }

  /// Waves, jumps, rotations, translations and no motion; relative to the size of the mesh, or of
  /// the ulp.
  void move() {
    const fcl::Vector3<S> wave(S(between(-1, 1)), S(between(-1, 1)), S(between(-1, 1)));
    const S amount = scale_ * std::pow(S(10), S(between(-9, 0)));
    moved_.clear();
    const int kind = std::uniform_int_distribution<int>(0, 5)(random_);
    const Eigen::AngleAxis<S> turn(S(between(-0.3, 0.3)),
                                   (wave + fcl::Vector3<S>(0, 0, 2)).normalized());
    const fcl::Vector3<S> middle = positions_[0];
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      fcl::Vector3<S>& p = positions_[v];
      const fcl::Vector3<S> rest = mesh_.vertices[v].template cast<S>();
      if (kind == 0) p += amount * std::sin(wave.dot(rest - offset_) * 3 / scale_) * wave;
      if (kind == 1) p += amount * wave;
      if (kind == 2) p = middle + turn * (p - middle);
      if (kind == 3 && !oneIn(9)) continue;
      if (kind == 3) p = rest + scale_ * S(0.3) * S(between(-1, 1)) * wave;
      if (kind == 4) p = rest + (p - rest) * S(0.9);
      moved_.push_back(unsigned(v));
    }
  }

  void takeOver() {
    std::vector<fcl::Vector3<S>> some;
    for (unsigned v : moved_) some.push_back(positions_[v]);
    const bool swept = model_.prev_vertices != nullptr;
    if (oneIn(4)) {
      model_.update(moved_, some);
    } else if (oneIn(5)) {
      model_.beginUpdateModel();
      model_.updateSubModel(positions_);
      model_.endUpdateModel(!oneIn(6));
    } else if (!swept && oneIn(3)) {
      model_.beginReplaceModel();
      model_.replaceSubModel(positions_);
      model_.endReplaceModel(!oneIn(6));
    } else {
      model_.update(positions_);
    }
  }

  void query() {
    fcl::Transform3d tf = randomPose(random_, 2 * scale_);
    if constexpr (std::is_same<S, double>::value) {  // those in single precision record nothing
      tf.translation() += offset_;
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&model_, fcl::Transform3d::Identity(), &other_, tf,
                             fcl::DistanceRequestd(), result);
    }
  }

  std::mt19937 random_;
  TriangleMesh mesh_;
  S scale_ = 1;
  fcl::Vector3<S> offset_;
  std::vector<fcl::Vector3<S>> positions_;
  std::vector<unsigned> moved_;
  AdaptiveBVHModel<BV> model_, other_;
};

template <typename BV>
void check(unsigned chains) {
  long checked = 0;
  for (unsigned seed = 1; seed <= chains; ++seed) {
    int failed = 0;
    Chain<BV>(seed).run(checked, failed);
    EXPECT_EQ(0, failed) << "seed " << seed;
  }
  std::printf("%ld volumes hold their triangles\n", checked);
  EXPECT_GE(checked, 40000 * long(chains));
}

TEST(Containment, FloatNeverFails) { check<fcl::RSSf>(kChains); }
TEST(Containment, DoubleNeverFails) { check<fcl::RSSd>(kChains); }
TEST(Containment, FloatOBBRSSNeverFails) { check<fcl::OBBRSSf>(kChains / 3); }
TEST(Containment, DoubleOBBRSSNeverFails) { check<fcl::OBBRSSd>(kChains / 3); }

}  // namespace containment_test
}  // namespace adaptive_bvh_test
