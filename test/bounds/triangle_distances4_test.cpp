// TriangleDistances4 never calls a pair near that is apart, nor the other way round: against
// distances in long double, with corners that are off by what is allowed.
#include <gtest/gtest.h>

#include "geometry/triangle_distances4.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace {

using adaptive_bvh::Nearness4;
using adaptive_bvh::TriangleDistances4;
using adaptive_bvh::Vector4x3;
using exact::Real;

class Distances4 : public testing::Test {
 protected:
  using Point = Eigen::Vector3d;

  /// Of any shape: slivers, segments and points among them.
  void makeTriangle(Point (&corners)[3], const Point& place, double size) {
    for (Point& corner : corners) corner = place + size * random_.point();
    switch (random_.below(6)) {
      case 0: corners[2] = corners[0] + random_.uniform(0, 1) * (corners[1] - corners[0]); break;
      case 1: corners[1] = corners[0]; break;
      case 2: corners[2] = corners[1] + 1e-4 * size * random_.point(); break;
      default: break;
    }
  }
  /// The corners of one lane, off by `error`, as single precision.
  void set(Vector4x3 (&to)[3], int lane, const Point (&corners)[3], double error) {
    for (int c = 0; c < 3; ++c) {
      const Point x = corners[c] + 0.99 * error * random_.point();
      to[c].x[lane] = static_cast<float>(x[0]);
      to[c].y[lane] = static_cast<float>(x[1]);
      to[c].z[lane] = static_cast<float>(x[2]);
    }
  }
  static exact::Triangle exactly(const Point (&corners)[3]) {
    return {exact::of(corners[0]), exact::of(corners[1]), exact::of(corners[2])};
  }

  RandomGeometry<double> random_{99};
};

TEST_F(Distances4, SaysOnlyWhatIsSo) {
  long decided = 0, by_corners = 0, pairs = 0;
  for (int i = 0; i < 40000; ++i) {
    const double size = random_.size(-3, 0), error = random_.oneIn(2) ? 0 : random_.size(-7, -4);
    Vector4x3 p4[3], q4[3];
    Real distances[4];
    for (int lane = 0; lane < 4; ++lane) {
      Point p[3], q[3];
      const Point place = random_.point();
      makeTriangle(p, place, size);
      makeTriangle(q, place + random_.point() * size * random_.size(-1, 1), size);
      set(p4, lane, p, error);
      set(q4, lane, q, error);
      distances[lane] = exact::distance(exactly(p), exactly(q));
    }
    const TriangleDistances4 four(TriangleDistances4::Seen(p4), q4,
                                  static_cast<float>(error + 8. * 2 / (1 << 24)));
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

}  // namespace
}  // namespace adaptive_bvh_test
