// Positions that FCL's users write into the model's `vertices`: whatever they write and whenever,
// after every call the model has the positions of its last step, and its volumes enclose them.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/containment.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"

namespace adaptive_bvh_test {
namespace in_place_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::Propagation;
using adaptive_bvh::RefitPolicy;

const int kSteps = manySteps(100);

template <typename BV>
class InPlace {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  using Points = std::vector<Point>;

  InPlace(unsigned seed, Propagation propagation) : random_(testSeed(seed)) {
    RefitPolicy policy;
    policy.propagation = propagation;
    policy.criterion = static_cast<FitnessCriterion>(draw(0, 8));
    model_.setRefitPolicy(policy);
    fillModel(mesh_, model_);
    now_ = pointsIn<S>(mesh_.vertices);
    if (oneIn(2)) model_.mesh();
  }

  void run() {
    for (int step = 0; step < kSteps && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE("step " + std::to_string(step));
      next_ = now_;
      if (!oneIn(4)) move(next_);
      if (oneIn(3)) scribble();
      switch (draw(0, model_.prev_vertices ? 4 : 6)) {
        case 0: update(); break;
        case 1: updateSome(); break;
        case 2: refuse(); break;
        case 3:
        case 4: replace(true); break;
        default: replace(false);
      }
      check();
    }
  }

 private:
  int draw(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  bool oneIn(int n) { return draw(1, n) == 1; }
  S number() { return std::uniform_real_distribution<S>(-1, 1)(random_); }
  std::size_t count() const { return now_.size(); }

  /// Moves all vertices, or some.
  void move(Points& points) {
    const Point shift(number(), number(), number());
    const int some = draw(1, 5);
    for (Point& p : points)
      if (oneIn(some)) p += S(0.2) * shift + S(0.05) * Point(number(), number(), number());
  }

  /// Writes into the model: the next positions, or any others, to all vertices or to some.
  void scribble() {
    const int what = draw(0, 3), some = draw(1, 3);
    for (std::size_t v = 0; v < count(); ++v)
      if (oneIn(some))
        model_.vertices[v] = what == 0   ? next_[v]
                             : what == 1 ? Point(9 * number(), number(), number())
                             : what == 2 ? Point::Constant(std::numeric_limits<S>::quiet_NaN())
                                         : Point(now_[v] + Point::Constant(S(1e-3)));
  }

  void update() {
    if (next_ == now_ || oneIn(3)) begin(true);  // at rest, `update` does not read `vertices`
    before_.clear();
    now_ = next_;
    if (oneIn(2)) {
      model_.update(next_);
    } else {
      std::copy(next_.begin(), next_.end(), model_.vertices);
      model_.update(model_.vertices, count());
    }
  }

  /// Some vertices; those that were written in place keep their positions only if a step is open.
  void updateSome() {
    begin(model_.prev_vertices || oneIn(2));
    scribble();
    std::vector<unsigned> indices;
    Points some;
    for (unsigned v = 0; v < count(); ++v) {
      if (!oneIn(3)) continue;
      indices.push_back(v);
      some.push_back(now_[v] = next_[v]);
    }
    before_.clear();
    model_.update(indices, some);
  }

  /// A step that the model does not take: incomplete, or of positions that are not usable.
  void refuse() {
    const bool two_frames = model_.prev_vertices || oneIn(2);
    begin(two_frames);
    scribble();
    const Points part(next_.begin(), next_.begin() + draw(0, int(count()) - 1));
    EXPECT_EQ(fcl::BVH_OK, handIn(two_frames, part));
    if (oneIn(2)) {
      const Point wrong = Point::Constant(std::numeric_limits<S>::infinity());
      EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, handIn(two_frames, {wrong}));
    }
    scribble();
    EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, end(two_frames, true));
    if (oneIn(4)) {
      if (next_ != now_) scribble();
      model_.update(now_ = next_);
      before_.clear();
    }
  }

  void replace(bool two_frames) {
    begin(two_frames);
    if (oneIn(2)) scribble();
    for (std::size_t first = 0; first < count();) {
      const std::size_t last = std::min(count(), first + std::size_t(draw(1, int(count()))));
      EXPECT_EQ(fcl::BVH_OK, handIn(two_frames, {next_.begin() + std::ptrdiff_t(first),
                                                 next_.begin() + std::ptrdiff_t(last)}));
      first = last;
      if (oneIn(3)) scribble();
      if (oneIn(5) && first < count()) {
        EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, end(two_frames, true));
        check();
      }
    }
    EXPECT_EQ(fcl::BVH_OK, end(two_frames, !oneIn(5)));
    before_ = two_frames ? now_ : Points();
    now_ = next_;
  }

  void begin(bool two_frames) {
    EXPECT_EQ(fcl::BVH_OK, two_frames ? model_.beginUpdateModel() : model_.beginReplaceModel());
  }
  int handIn(bool two_frames, const Points& points) {
    if (points.size() == 1)
      return two_frames ? model_.updateVertex(points[0]) : model_.replaceVertex(points[0]);
    if (points.size() == 3)
      return two_frames ? model_.updateTriangle(points[0], points[1], points[2])
                        : model_.replaceTriangle(points[0], points[1], points[2]);
    return two_frames ? model_.updateSubModel(points) : model_.replaceSubModel(points);
  }
  int end(bool two_frames, bool refit) {
    return two_frames ? model_.endUpdateModel(refit) : model_.endReplaceModel(refit);
  }

  void check() {
    ASSERT_EQ(now_, Points(model_.vertices, model_.vertices + count()));
    ASSERT_EQ(before_, model_.prev_vertices
                           ? Points(model_.prev_vertices, model_.prev_vertices + count())
                           : Points());
    long checked = 0;
    ASSERT_EQ(0, failures(model_, checked));
    ASSERT_EQ(2 * model_.num_tris - 1, checked);
    if (!model_.hasMesh()) return;
    ASSERT_EQ(now_, pointsIn<S>(model_.mesh().vertices()));
    ASSERT_EQ(before_, pointsIn<S>(model_.mesh().previousVertices()));
  }

  std::mt19937 random_;
  const TriangleMesh mesh_ = plate(5, 4);
  AdaptiveBVHModel<BV> model_;
  Points now_, before_, next_;  ///< before_: of a two-frame update
};

template <typename BV>
class PositionsInPlace : public testing::Test {};
using Volumes = testing::Types<fcl::RSSf, fcl::RSSd, fcl::OBBRSSf, fcl::OBBRSSd>;
TYPED_TEST_SUITE(PositionsInPlace, Volumes);

TYPED_TEST(PositionsInPlace, AreUndoneOrFollowed) {
  for (unsigned seed = 1; seed <= 6; ++seed)
    for (const auto propagation :
         {Propagation::TranslationCompensated, Propagation::Displacements}) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      InPlace<TypeParam>(seed, propagation).run();
    }
}

/// The simplest case: a plate that is moved in place, and whose positions are then handed in.
TYPED_TEST(PositionsInPlace, AreSeenByTheNextStep) {
  using S = typename TypeParam::S;
  AdaptiveBVHModel<TypeParam> model;
  fillModel(plate(3, 3), model);
  for (int step = 0; step < 2; ++step) {
    ASSERT_EQ(fcl::BVH_OK, model.beginReplaceModel());
    for (int v = 0; v < model.num_vertices; ++v) model.vertices[v][2] += 5;
    const std::vector<fcl::Vector3<S>> moved(model.vertices, model.vertices + model.num_vertices);
    ASSERT_EQ(fcl::BVH_OK, model.replaceSubModel(moved));
    ASSERT_EQ(fcl::BVH_OK, model.endReplaceModel());
    long checked = 0;
    EXPECT_EQ(0, failures(model, checked));
    EXPECT_NEAR(5, model.lastUpdate().largest_displacement, 1e-5);
  }
}

}  // namespace in_place_test
}  // namespace adaptive_bvh_test
