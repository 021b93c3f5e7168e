// A mesh that meets itself: every pair of triangles that brute force finds, and no other.
#include "adaptive_bvh/self_collision.h"

#include <gtest/gtest.h>

#include "support/brute_force.h"
#include "support/long_mode.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace self_collision_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::NeighbourFilter;
using Pairs = std::set<std::pair<int, int>>;

constexpr NeighbourFilter kFilters[] = {NeighbourFilter::SharedVertex, NeighbourFilter::SharedEdge,
                                        NeighbourFilter::None};

/// Positions of a mesh of `columns` x `rows` cells at a time from 0 to 1.
template <typename S>
using Motion = std::vector<Vector3<S>> (*)(S time, std::mt19937& random);

constexpr int kColumns = 12, kRows = 14;

template <typename S>
TriangleMesh<S> sheet() {
  return plate<S>(kColumns, kRows);
}

/// A sheet that folds over its middle line and through itself.
template <typename S>
std::vector<Vector3<S>> fold(S time, std::mt19937&) {
  const S angle = S(1.1 * M_PI) * time;
  auto points = sheet<S>().vertices;
  for (Vector3<S>& p : points) {
    const S along = p[1] - S(0.49), wave = S(0.05) * std::sin(7 * p[0]);
    if (along > 0)
      p = Vector3<S>(p[0], S(0.49) + along * std::cos(angle), wave + along * std::sin(angle));
    else
      p[2] += wave;
  }
  return points;
}

/// A hose that is wound up, turn by turn, until the turns go through each other.
template <typename S>
std::vector<Vector3<S>> coil(S time, std::mt19937&) {
  auto points = sheet<S>().vertices;
  for (Vector3<S>& p : points) {
    const S around = S(2 * M_PI) * p[0], turn = S(0.3) + S(14) * time * p[1];
    const S radius = 1 - S(0.2) * time + S(0.13) * std::cos(around);
    p = Vector3<S>(radius * std::cos(turn), radius * std::sin(turn),
                   S(0.3) * p[1] + S(0.13) * std::sin(around));
  }
  return points;
}

/// A sheet whose vertices go anywhere within a few edges.
template <typename S>
std::vector<Vector3<S>> crumple(S time, std::mt19937& random) {
  std::uniform_real_distribution<S> one(-1, 1);
  auto points = sheet<S>().vertices;
  for (Vector3<S>& p : points)
    p += S(0.3) * time * Vector3<S>(one(random), one(random), one(random));
  return points;
}

template <typename S>
bool neighbours(const fcl::Triangle& a, const fcl::Triangle& b, NeighbourFilter filter) {
  std::set<std::size_t> shared;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (a[i] == b[j]) shared.insert(a[i]);
  const std::size_t least[] = {1, 2, 4};
  return shared.size() >= least[int(filter)];
}

/// What `contacts` has, the smaller index of each pair first. A pair that is there twice is a
/// failure.
template <typename S>
Pairs pairsOf(const fcl::CollisionResult<S>& contacts) {
  Pairs pairs;
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    const fcl::Contact<S>& contact = contacts.getContact(i);
    const int low = int(contact.b1), high = int(contact.b2);
    EXPECT_LT(low, high);
    EXPECT_TRUE(pairs.emplace(low, high).second) << low << ", " << high << " twice";
  }
  return pairs;
}

/// Expects that `found` has all pairs that intersect, and none else.
template <typename S>
void expectAll(const DeformableMesh<S>& model, NeighbourFilter filter, const Pairs& found,
               int& contacts) {
  const fcl::Transform3<S> still = fcl::Transform3<S>::Identity();
  const Pairs touching = BruteForce<S>(model, still, model, still).contacts();
  int missed = 0, extra = 0;
  for (int i = 0; i < numTriangles(model); ++i)
    for (int j = i + 1; j < numTriangles(model); ++j) {
      const bool left_out = neighbours<S>(model.triangles()[i], model.triangles()[j], filter);
      const bool touches = !left_out && touching.count({i, j}) > 0;
      const bool reported = found.count({i, j}) > 0;
      missed += touches && !reported;
      extra += !touches && reported;
      contacts += touches;
    }
  EXPECT_EQ(0, missed);
  EXPECT_EQ(0, extra);
}

template <typename S>
class SelfCollision : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  const fcl::CollisionRequest<S> all_{1000000};
};

using Scalars = QueryScalars;
TYPED_TEST_SUITE(SelfCollision, Scalars);

TYPED_TEST(SelfCollision, FindsWhatBruteForceFinds) {
  using S = TypeParam;
  std::mt19937 random(testSeed(7));
  for (const bool two_frames : {false, true})
    for (Motion<S> motion : {&fold<S>, &coil<S>, &crumple<S>}) {
      typename TestFixture::Model model(sheet<S>());
      int contacts = 0;
      for (int frame = 0; frame <= 12; frame += isLongMode() ? 1 : 2) {
        const auto points = motion(S(frame) / 12, random);
        two_frames ? model.updateTwoFrames(points) : model.update(points);
        ASSERT_TRUE(model.validate());
        for (NeighbourFilter filter : kFilters) {
          if (filter != NeighbourFilter::SharedVertex && frame % 4) continue;
          fcl::CollisionResult<S> result;
          const std::size_t count = selfCollide(model, this->all_, result, filter);
          EXPECT_EQ(result.numContacts(), count);
          expectAll(model, filter, pairsOf(result), contacts);
        }
      }
      EXPECT_GT(contacts, 500) << "a motion that does not meet itself shows little";
    }
}

/// A face without area may name a vertex twice, in any order.
TYPED_TEST(SelfCollision, CountsARepeatedVertexOnce) {
  using S = TypeParam;
  struct Case {
    std::array<std::size_t, 3> first, second;
    std::size_t contacts[3];  // by filter
  };
  for (Case faces : {Case{{0, 0, 1}, {0, 2, 3}, {0, 1, 1}}, Case{{0, 0, 1}, {0, 1, 2}, {0, 0, 1}},
                     Case{{0, 1, 1}, {0, 0, 2}, {0, 1, 1}}}) {
    std::sort(faces.first.begin(), faces.first.end());
    do {
      std::sort(faces.second.begin(), faces.second.end());
      do {
        for (const bool is_swapped : {false, true}) {
          auto a = faces.first, b = faces.second;
          if (is_swapped) std::swap(a, b);
          TriangleMesh<S> mesh;
          mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
          mesh.triangles = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}};
          const typename TestFixture::Model model(mesh);
          for (const NeighbourFilter filter : kFilters) {
            fcl::CollisionResult<S> result;
            EXPECT_EQ(faces.contacts[int(filter)], selfCollide(model, this->all_, result, filter));
          }
        }
      } while (std::next_permutation(faces.second.begin(), faces.second.end()));
    } while (std::next_permutation(faces.first.begin(), faces.first.end()));
  }
}

TYPED_TEST(SelfCollision, PlacesContactsInTheWorld) {
  using S = TypeParam;
  std::mt19937 random(testSeed(11));
  typename TestFixture::Model model(sheet<S>());
  model.update(crumple<S>(1, random));
  const fcl::Transform3<S> tf = randomPose<S>(random, 3);
  fcl::CollisionRequest<S> with_points(1000000, true);
  fcl::CollisionResult<S> here, there;
  selfCollide(model, with_points, here);
  selfCollide(model, tf, with_points, there);
  ASSERT_GT(here.numContacts(), 50u);
  ASSERT_EQ(here.numContacts(), there.numContacts());
  for (std::size_t i = 0; i < here.numContacts(); ++i) {
    const fcl::Contact<S>&a = here.getContact(i), &b = there.getContact(i);
    EXPECT_EQ(a.b1, b.b1);
    EXPECT_EQ(&model, b.o1);
    EXPECT_EQ(&model, b.o2);
    EXPECT_NEAR(0, (tf * a.pos - b.pos).norm(), S(1e-5));
    EXPECT_NEAR(0, (tf.linear() * a.normal - b.normal).norm(), S(1e-5));
  }
}

TYPED_TEST(SelfCollision, StopsAtTheNumberOfContacts) {
  using S = TypeParam;
  std::mt19937 random(testSeed(13));
  typename TestFixture::Model model(sheet<S>());
  fcl::CollisionResult<S> none, one, three;
  EXPECT_EQ(0u, selfCollide(model, this->all_, none)) << "a plate at rest only has neighbours";
  model.update(crumple<S>(1, random));
  EXPECT_EQ(1u, selfCollide(model, fcl::CollisionRequest<S>(), one));
  EXPECT_EQ(3u, selfCollide(model, fcl::CollisionRequest<S>(3), three));
  EXPECT_EQ(3u, selfCollide(model, fcl::CollisionRequest<S>(3), three)) << "already has them";
}

}  // namespace self_collision_test
}  // namespace adaptive_bvh_test
