// A step that is supplied call by call: FCL's return codes and build states, whatever the order.
#include "thesis/model_state.h"

#include <gtest/gtest.h>

namespace adaptive_bvh_test {
namespace step_buffer_test {

using adaptive_bvh::StepBuffer;
using adaptive_bvh::StepKind;
using Point = fcl::Vector3d;

class Buffer : public testing::Test {
 protected:
  static constexpr int kVertices = 4;

  int begin(StepKind kind = StepKind::Replace) { return buffer_.begin(kind, state_, kVertices); }
  int add(std::size_t count, StepKind kind = StepKind::Replace) {
    const int code = buffer_.add(kind, state_, kVertices, next_, count);
    next_ += count;
    return code;
  }
  int end(StepKind kind = StepKind::Replace) { return buffer_.end(kind, state_, kVertices); }

  StepBuffer<double> buffer_;
  fcl::BVHBuildState state_ = fcl::BVH_BUILD_STATE_PROCESSED;
  const Point points_[8] = {Point(0, 0, 0), Point(1, 0, 0), Point(2, 0, 0), Point(3, 0, 0),
                            Point(4, 0, 0), Point(5, 0, 0), Point(6, 0, 0), Point(7, 0, 0)};
  const Point* next_ = points_;
};

/// Positions come in any portions, in their order; the build state is "begun" in between.
TEST_F(Buffer, CollectsAStepInPortions) {
  EXPECT_EQ(fcl::BVH_OK, begin());
  EXPECT_EQ(fcl::BVH_BUILD_STATE_REPLACE_BEGUN, state_);
  EXPECT_EQ(fcl::BVH_OK, add(1));
  EXPECT_EQ(fcl::BVH_OK, add(0));
  EXPECT_EQ(fcl::BVH_OK, add(3));
  EXPECT_EQ(fcl::BVH_OK, end());
  EXPECT_EQ(fcl::BVH_BUILD_STATE_PROCESSED, state_);
  ASSERT_EQ(4u, buffer_.positions().size());
  for (int i = 0; i < 4; ++i) EXPECT_EQ(points_[i], buffer_.positions()[std::size_t(i)]);
  EXPECT_EQ(4 * sizeof(Point), buffer_.bytes());
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, end()) << "it is closed";
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, add(1));
}

/// A model that was never built, or is being built, takes no step. After a step of two frames
/// another one of two frames may follow, but none that replaces.
TEST_F(Buffer, BeginsOnlyWhereFclAllows) {
  for (const auto refused : {fcl::BVH_BUILD_STATE_EMPTY, fcl::BVH_BUILD_STATE_BEGUN}) {
    state_ = refused;
    for (const StepKind kind : {StepKind::Replace, StepKind::TwoFrames})
      EXPECT_EQ(fcl::BVH_ERR_BUILD_EMPTY_PREVIOUS_FRAME, begin(kind));
    EXPECT_EQ(refused, state_);
  }
  state_ = fcl::BVH_BUILD_STATE_UPDATED;
  EXPECT_EQ(fcl::BVH_ERR_BUILD_EMPTY_PREVIOUS_FRAME, begin());
  EXPECT_EQ(fcl::BVH_OK, begin(StepKind::TwoFrames));
  EXPECT_EQ(fcl::BVH_BUILD_STATE_UPDATE_BEGUN, state_);
}

/// Calls of the other kind, or without a begin, are out of sequence and change nothing.
TEST_F(Buffer, RefusesCallsOutOfSequence) {
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, add(1));
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, end());
  next_ = points_;
  begin(StepKind::TwoFrames);
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, add(1, StepKind::Replace));
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, end(StepKind::Replace));
  EXPECT_TRUE(buffer_.positions().empty());
  next_ = points_;
  EXPECT_EQ(fcl::BVH_OK, add(4, StepKind::TwoFrames));
  EXPECT_EQ(fcl::BVH_OK, end(StepKind::TwoFrames));
}

/// A step with vertices missing can be queried meanwhile, and completed.
TEST_F(Buffer, StaysOpenWhileVerticesAreMissing) {
  begin();
  add(3);
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, end());
  EXPECT_EQ(fcl::BVH_BUILD_STATE_PROCESSED, state_) << "the old positions can be queried";
  EXPECT_EQ(fcl::BVH_OK, add(1));
  EXPECT_EQ(fcl::BVH_OK, end());
  EXPECT_EQ(points_[3], buffer_.positions()[3]);
}

/// Too many positions, or one that is not usable, refuse the whole step; the next may begin.
TEST_F(Buffer, RefusesAStepWithWrongPositions) {
  const double kNan = std::numeric_limits<double>::quiet_NaN();
  const Point wrong[] = {Point(kNan, 0, 0), Point(0, -HUGE_VAL, 0), Point(0, 0, 1e80)};
  for (const Point& p : wrong) {
    begin();
    EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA,
              buffer_.add(StepKind::Replace, state_, kVertices, &p, 1));
    EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, add(1)) << "nothing more is taken";
    EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, end());
    EXPECT_EQ(fcl::BVH_BUILD_STATE_PROCESSED, state_);
    EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, end()) << "it is closed";
  }
  next_ = points_;
  begin();
  EXPECT_EQ(fcl::BVH_OK, add(4));
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, add(1)) << "one too many";
  EXPECT_EQ(4u, buffer_.positions().size());
  EXPECT_EQ(fcl::BVH_ERR_INCORRECT_DATA, end()) << "whatever was complete before";
}

/// A second begin drops what was open; so does a build that FCL began meanwhile.
TEST_F(Buffer, DropsAnOpenStep) {
  begin();
  add(2);
  state_ = fcl::BVH_BUILD_STATE_PROCESSED;
  EXPECT_EQ(fcl::BVH_OK, begin(StepKind::TwoFrames));
  EXPECT_TRUE(buffer_.positions().empty());
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, add(1)) << "of the step that was dropped";
  state_ = fcl::BVH_BUILD_STATE_BEGUN;
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, add(1, StepKind::TwoFrames));
}

/// Abandoning an open step brings the state back; of none, it changes nothing.
TEST_F(Buffer, CanBeAbandoned) {
  buffer_.abandon(state_);
  EXPECT_EQ(fcl::BVH_BUILD_STATE_PROCESSED, state_);
  state_ = fcl::BVH_BUILD_STATE_UPDATED;
  begin(StepKind::TwoFrames);
  buffer_.abandon(state_);
  EXPECT_EQ(fcl::BVH_BUILD_STATE_UPDATED, state_) << "as before the step";
  EXPECT_EQ(fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE, add(1, StepKind::TwoFrames));
  begin(StepKind::TwoFrames);
  state_ = fcl::BVH_BUILD_STATE_BEGUN;
  buffer_.abandon(state_);
  EXPECT_EQ(fcl::BVH_BUILD_STATE_BEGUN, state_) << "of a build begun meanwhile";
}

}  // namespace step_buffer_test
}  // namespace adaptive_bvh_test
