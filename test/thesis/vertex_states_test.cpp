// The states of vertices that the propagation reads, against ScaledFrame and the positions given.
#include "thesis/vertex_states.h"

#include <gtest/gtest.h>

#include <map>

#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace vertex_states_test {

using adaptive_bvh::AdaptiveTree;
using adaptive_bvh::DirtyNodes;
using adaptive_bvh::Float4;
using adaptive_bvh::ScaledFrame;
using adaptive_bvh::StepInput;
using adaptive_bvh::StepKind;
using adaptive_bvh::UpdateTarget;
using adaptive_bvh::VertexStates;

template <typename S>
class States : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;
  using P = fcl::Vector3<S>;

  States() {
    fillModel(plate(9, 9), model_);
    model_.computeLocalAABB();
    tree_.assign(model_);
    states_.reset(slots().size());
    states_.start(UpdateTarget<BV>{model_, tree_}, ScaledFrame<S>(P(S(0.5), S(0.5), 0), 3));
    positions_.assign(model_.vertices, model_.vertices + model_.num_vertices);
  }

  UpdateTarget<BV> target() { return {model_, tree_}; }
  const adaptive_bvh::VertexSlots& slots() const { return tree_.topology.slots; }
  int vertices() const { return model_.num_vertices; }
  adaptive_bvh::StepSummary<S> readAll(const StepInput<S>& input) {
    return states_.read(target(), input, 0, int(slots().size()));
  }
  StepInput<S> input(StepKind kind = StepKind::Replace) const {
    return {kind, positions_.data(), positions_.size(), nullptr};
  }
  P motion(int v) const { return positions_[std::size_t(v)] - tree_.positions[std::size_t(v)]; }

  static void expectSame(const Float4& expected, const float* found) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(expected[k], found[k]);
  }
  /// In every slot of the vertex.
  void expectState(int v, const P& position, const P& rest) const {
    int found = 0;
    for (std::size_t slot = 0; slot < slots().size(); ++slot) {
      if (slots().vertices()[slot] != unsigned(v)) continue;
      ++found;
      expectSame(states_.frame()(position), states_.data()[slot].position);
      expectSame(states_.frame().displacement(rest), states_.data()[slot].motion);
    }
    EXPECT_GT(found, 0);
  }

  fcl::BVHModel<BV> model_;
  AdaptiveTree<BV> tree_;
  VertexStates<S> states_;
  std::vector<P> positions_;
  RandomGeometryOf<S> random_{37};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(States, Scalars);

/// At the start all stand at the model's positions and nothing moves.
TYPED_TEST(States, StartAtTheModelsPositions) {
  for (int v = 0; v < this->vertices(); ++v)
    this->expectState(v, this->model_.vertices[v], fcl::Vector3<TypeParam>::Zero());
}

/// Each vertex' own way is its motion where vertices go different ways; read in parts, as threads
/// do, and summed up as they say.
TYPED_TEST(States, ReadPositionsAndMotions) {
  using S = TypeParam;
  S largest = 0;
  for (auto& p : this->positions_) p += this->random_.point();
  for (int v = 0; v < this->vertices(); ++v) largest = std::max(largest, this->motion(v).norm());
  this->states_.begin(this->target(), this->input());
  EXPECT_EQ(fcl::Vector3<S>(0, 0, 0), this->states_.commonTranslation());
  const int slots = int(this->slots().size());
  EXPECT_GT(slots, this->vertices()) << "some vertices have several";
  auto summary = this->states_.read(this->target(), this->input(), 0, 5);
  summary.add(this->states_.read(this->target(), this->input(), 5, slots));
  for (int v = 0; v < this->vertices(); ++v)
    this->expectState(v, this->positions_[std::size_t(v)], this->motion(v));
  EXPECT_NEAR(largest, summary.largestDisplacement(), 1e-5);
}

/// What most of a body shares is told once, and each vertex' motion is what it does beyond it.
TYPED_TEST(States, MotionsAreWhatIsLeftBeyondACommonTranslation) {
  using S = TypeParam;
  const fcl::Vector3<S> shift(300, -200, 100);
  for (auto& p : this->positions_) p += shift + this->random_.point() / 10;
  this->states_.begin(this->target(), this->input());
  this->readAll(this->input());
  const fcl::Vector3<S> common = this->states_.commonTranslation();
  EXPECT_LT((common - shift).norm(), S(0.2));
  for (int v = 0; v < this->vertices(); ++v)
    this->expectState(v, this->positions_[std::size_t(v)], this->motion(v) - common);
}

/// None is found where a vertex of the samples goes another way, or where two frames are kept:
/// there the frame before did not move.
TYPED_TEST(States, HaveACommonTranslationOnlyWhereAllShareIt) {
  using S = TypeParam;
  const auto common = [&](StepKind kind) {
    this->states_.begin(this->target(), this->input(kind));
    return this->states_.commonTranslation();
  };
  const auto rest = this->positions_;
  for (auto& p : this->positions_) p += fcl::Vector3<S>(0, 0, 8);
  EXPECT_EQ(fcl::Vector3<S>(0, 0, 8), common(StepKind::Replace));
  EXPECT_EQ(fcl::Vector3<S>(0, 0, 0), common(StepKind::TwoFrames));
  for (auto& p : this->positions_) p[2] = 8 + p[0] / 3;  // 8 to 8 1/3: within a sixteenth
  EXPECT_NE(fcl::Vector3<S>(0, 0, 0), common(StepKind::Replace));
  for (auto& p : this->positions_) p[2] = 8 + p[0] * 2;
  EXPECT_EQ(fcl::Vector3<S>(0, 0, 0), common(StepKind::Replace));
  this->positions_ = rest;
  EXPECT_EQ(fcl::Vector3<S>(0, 0, 0), common(StepKind::Replace));
}

/// The origin follows the body, to its middle in the last step that took place; vertices without a
/// triangle are none of the body.
TYPED_TEST(States, TheFrameFollowsTheMiddleOfTheBody) {
  using S = TypeParam;
  const auto middle = [&] {
    fcl::Vector3<S> low = this->positions_[0], high = low;
    for (const auto& p : this->positions_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    return fcl::Vector3<S>((low + high) / 2);
  };
  const fcl::Vector3<S> before = middle();
  for (auto& p : this->positions_) p += fcl::Vector3<S>(1, 2, 3) + this->random_.point() / 10;
  this->states_.begin(this->target(), this->input());
  EXPECT_LT((before - this->states_.frame().origin()).norm(), 1e-6);
  const auto seen = this->readAll(this->input());
  this->states_.discard();
  this->states_.begin(this->target(), this->input());
  EXPECT_LT((before - this->states_.frame().origin()).norm(), 1e-6) << "it did not take place";
  this->readAll(this->input());
  this->states_.accept(seen);
  EXPECT_NEAR(1.5, this->states_.extent(), 0.1) << "a way of 3, in units of 2";
  this->states_.begin(this->target(), this->input());
  EXPECT_LT((middle() - this->states_.frame().origin()).norm(), 1e-5);
}

/// Of two frames, where each vertex was stands beside where it is.
TYPED_TEST(States, KeepTheStepBeforeOfTwoFrames) {
  for (auto& p : this->positions_) p += this->random_.point();
  const auto input = this->input(StepKind::TwoFrames);
  this->states_.begin(this->target(), input);
  this->readAll(input);
  for (int v = 0; v < this->vertices(); ++v)
    this->expectState(v, this->positions_[std::size_t(v)], this->motion(v));
  for (std::size_t slot = 0; slot < this->slots().size(); ++slot)
    this->expectSame(this->states_.frame()(this->tree_.positions[this->slots().vertices()[slot]]),
                     this->states_.previous()[slot].data());
}

/// Some vertices: each is reported once, with the last of its positions; those named in the step
/// before rest again, and all others do.
TYPED_TEST(States, ReadSomeVertices) {
  using S = TypeParam;
  DirtyNodes nodes = this->tree_.topology.dirtyNodes(this->tree_.positions.size());
  const auto read = [&](const std::vector<unsigned>& indices,
                        const std::vector<fcl::Vector3<S>>& to) {
    const unsigned none = 0;
    const StepInput<S> input{StepKind::Replace, to.data(), to.size(),
                             indices.empty() ? &none : indices.data()};
    std::map<unsigned, fcl::Vector3<S>> seen;
    this->states_.begin(this->target(), input);
    const auto summary = this->states_.readSome(
        this->target(), input, nodes, [&](unsigned v, const fcl::Vector3<S>& p) {
          EXPECT_TRUE(seen.emplace(v, p).second) << v << " twice";
        });
    this->states_.accept(summary);
    for (const auto& [v, p] : seen) this->positions_[v] = p;
    for (int v = 0; v < this->vertices(); ++v)
      this->expectState(v, this->positions_[std::size_t(v)], this->motion(v));
    for (const auto& [v, p] : seen) this->tree_.positions[v] = p;
    return seen;
  };
  for (auto& p : this->positions_) p += this->random_.point();  // first a step of all
  this->states_.begin(this->target(), this->input());
  this->readAll(this->input());
  this->tree_.positions = this->positions_;
  using P = fcl::Vector3<S>;
  const auto seen = read({3, 7, 3}, {P(1, 1, 1), P(2, 2, 2), P(3, 3, 3)});
  EXPECT_EQ(2u, seen.size());
  EXPECT_EQ(P(3, 3, 3), seen.at(3)) << "the last one given";
  EXPECT_EQ(1u, read({5}, {P(4, 4, 4)}).size());
  EXPECT_TRUE(read({}, {}).empty());
}

/// What was read and then discarded is not what the next step of some vertices goes on from.
TYPED_TEST(States, ForgetWhatWasDiscarded) {
  using S = TypeParam;
  for (auto& p : this->positions_) p += fcl::Vector3<S>(0, 0, 5);
  this->states_.begin(this->target(), this->input());
  this->readAll(this->input());
  this->states_.discard();
  const std::vector<unsigned> index = {2};
  const std::vector<fcl::Vector3<S>> to = {fcl::Vector3<S>(1, 1, 1)};
  const StepInput<S> input{StepKind::Replace, to.data(), 1, index.data()};
  this->states_.begin(this->target(), input);
  DirtyNodes nodes = this->tree_.topology.dirtyNodes(this->tree_.positions.size());
  this->states_.readSome(this->target(), input, nodes, [](unsigned, const fcl::Vector3<S>&) {});
  for (int v = 0; v < this->vertices(); ++v)
    if (v != 2)
      this->expectState(v, this->tree_.positions[std::size_t(v)], fcl::Vector3<S>::Zero());
  this->expectState(2, to[0], to[0] - this->tree_.positions[2]);
}

}  // namespace vertex_states_test
}  // namespace adaptive_bvh_test
