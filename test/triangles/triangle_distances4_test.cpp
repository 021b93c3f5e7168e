// TriangleDistances4 never calls a pair near that is apart, nor the other way round: against
// distances in long double, with corners that are off by what is allowed.
#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/triangle_lanes.h"
#include "triangles/triangle_distances4.h"

namespace adaptive_bvh_test {
namespace triangle_distances4_test {

using adaptive_bvh::Nearness4;
using adaptive_bvh::TriangleDistances4;
using adaptive_bvh::Vector4x3;
using exact::Real;

class Distances4 : public testing::Test {
 protected:
  RandomGeometry random_{99};
};

TEST_F(Distances4, SaysOnlyWhatIsSo) {
  long decided = 0, by_corners = 0, pairs = 0;
  for (int i = 0; i < manySteps(10000); ++i) {
    const double size = random_.size(-3, 0), error = random_.oneIn(2) ? 0 : random_.size(-7, -4);
    Vector4x3 p4[3], q4[3];
    Real distances[4];
    for (int lane = 0; lane < 4; ++lane) {
      const Eigen::Vector3d place = random_.point();
      const PlainTriangle p = anyTriangle(random_, place, size),
                          q = anyTriangle(
                              random_, place + random_.point() * size * random_.size(-1, 1), size);
      setLane(p4, lane, p, error, random_);
      setLane(q4, lane, q, error, random_);
      distances[lane] = exact::distance(exactly(p), exactly(q));
    }
    const TriangleDistances4 four(TriangleDistances4::Seen(p4), q4,
                                  static_cast<float>(error + kLaneRounding));
    const auto limit = static_cast<float>(random_.oneIn(2) ? double(distances[random_.below(4)]) *
                                                                 random_.size(-0.01, 0.01)
                                                           : size * random_.size(-2, 1));
    for (const bool corners : {true, false}) {
      const Nearness4 said = corners ? four.byCorners(limit) : four.byFeatures(limit);
      EXPECT_EQ(0u, said.near & said.apart);
      for (int lane = 0; lane < 4; ++lane) {
        if (said.near >> lane & 1) {
          EXPECT_LE(distances[lane], limit);
        }
        if (said.apart >> lane & 1) {
          EXPECT_GT(distances[lane], limit);
        }
        const bool is_decided = ((said.near | said.apart) >> lane & 1) != 0;
        (corners ? by_corners : decided) += is_decided;
        pairs += corners;
      }
    }
  }
  // And it decides nearly all of those whose distance is not nearly the limit.
  EXPECT_GT(double(decided), 0.75 * double(pairs));
  EXPECT_GT(double(by_corners), 0.4 * double(pairs));
}

TEST_F(Distances4, BoundsEncloseTheDistance) {
  long narrow = 0, apart = 0;
  for (int i = 0; i < manySteps(10000); ++i) {
    const double size = random_.size(-3, 0), error = random_.oneIn(2) ? 0 : random_.size(-7, -4);
    Vector4x3 p4[3], q4[3];
    Real distances[4];
    for (int lane = 0; lane < 4; ++lane) {
      const Eigen::Vector3d place = random_.point();
      const PlainTriangle p = anyTriangle(random_, place, size),
                          q = anyTriangle(
                              random_, place + random_.point() * size * random_.size(-1, 1), size);
      setLane(p4, lane, p, error, random_);
      setLane(q4, lane, q, error, random_);
      distances[lane] = exact::distance(exactly(p), exactly(q));
    }
    const auto bounds = TriangleDistances4(TriangleDistances4::Seen(p4), q4,
                                           static_cast<float>(error + kLaneRounding))
                            .bounds();
    for (int lane = 0; lane < 4; ++lane) {
      EXPECT_LE(bounds.lower[lane], distances[lane]);
      EXPECT_GE(bounds.upper[lane], distances[lane]);
      apart += distances[lane] > 0;
      narrow += distances[lane] > 0 &&
                double(bounds.upper[lane] - bounds.lower[lane]) <
                    32 * (error + kLaneRounding) + 1e-4 * (size + double(distances[lane]));
    }
  }
  EXPECT_GT(double(narrow), 0.9 * double(apart));
}

}  // namespace triangle_distances4_test
}  // namespace adaptive_bvh_test
