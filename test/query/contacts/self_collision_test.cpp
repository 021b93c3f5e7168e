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
using Motion = std::vector<fcl::Vector3d> (*)(double time, std::mt19937& random);

constexpr int kColumns = 12, kRows = 14;

TriangleMesh sheet() { return plate(kColumns, kRows); }

/// A sheet that folds over its middle line and through itself.
std::vector<fcl::Vector3d> fold(double time, std::mt19937&) {
  const double angle = double(1.1 * M_PI) * time;
  auto points = sheet().vertices;
  for (fcl::Vector3d& p : points) {
    const double along = p[1] - 0.49, wave = 0.05 * std::sin(7 * p[0]);
    if (along > 0)
      p = fcl::Vector3d(p[0], 0.49 + along * std::cos(angle), wave + along * std::sin(angle));
    else
      p[2] += wave;
  }
  return points;
}

/// A hose that is wound up, turn by turn, until the turns go through each other.
std::vector<fcl::Vector3d> coil(double time, std::mt19937&) {
  auto points = sheet().vertices;
  for (fcl::Vector3d& p : points) {
    const double around = double(2 * M_PI) * p[0], turn = 0.3 + 14. * time * p[1];
    const double radius = 1 - 0.2 * time + 0.13 * std::cos(around);
    p = fcl::Vector3d(radius * std::cos(turn), radius * std::sin(turn),
                      0.3 * p[1] + 0.13 * std::sin(around));
  }
  return points;
}

/// A sheet whose vertices go anywhere within a few edges.
std::vector<fcl::Vector3d> crumple(double time, std::mt19937& random) {
  std::uniform_real_distribution<double> one(-1, 1);
  auto points = sheet().vertices;
  for (fcl::Vector3d& p : points)
    p += 0.3 * time * fcl::Vector3d(one(random), one(random), one(random));
  return points;
}

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
Pairs pairsOf(const fcl::CollisionResultd& contacts) {
  Pairs pairs;
  for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
    const fcl::Contactd& contact = contacts.getContact(i);
    const int low = int(contact.b1), high = int(contact.b2);
    EXPECT_LT(low, high);
    EXPECT_TRUE(pairs.emplace(low, high).second) << low << ", " << high << " twice";
  }
  return pairs;
}

/// Expects that `found` has all pairs that intersect, and none else.
void expectAll(const DeformableMesh& model, NeighbourFilter filter, const Pairs& found,
               int& contacts) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  const Pairs touching = BruteForce(model, still, model, still).contacts();
  int missed = 0, extra = 0;
  for (int i = 0; i < numTriangles(model); ++i)
    for (int j = i + 1; j < numTriangles(model); ++j) {
      const bool left_out = neighbours(model.triangles()[i], model.triangles()[j], filter);
      const bool touches = !left_out && touching.count({i, j}) > 0;
      const bool reported = found.count({i, j}) > 0;
      missed += touches && !reported;
      extra += !touches && reported;
      contacts += touches;
    }
  EXPECT_EQ(0, missed);
  EXPECT_EQ(0, extra);
}

class SelfCollision : public testing::Test {
 protected:
  using Model = DeformableMesh;
  const fcl::CollisionRequestd all_{1000000};
};

TEST_F(SelfCollision, FindsWhatBruteForceFinds) {
  std::mt19937 random(testSeed(7));
  for (const bool two_frames : {false, true})
    for (Motion motion : {&fold, &coil, &crumple}) {
      Model model(sheet());
      int contacts = 0;
      for (int frame = 0; frame <= 12; frame += isLongMode() ? 1 : 2) {
        const auto points = motion(double(frame) / 12, random);
        two_frames ? model.updateTwoFrames(points) : model.update(points);
        ASSERT_TRUE(model.validate());
        for (NeighbourFilter filter : kFilters) {
          if (filter != NeighbourFilter::SharedVertex && frame % 4) continue;
          fcl::CollisionResultd result;
          const std::size_t count = selfCollide(model, {filter}, this->all_, result);
          EXPECT_EQ(result.numContacts(), count);
          expectAll(model, filter, pairsOf(result), contacts);
        }
      }
      EXPECT_GT(contacts, 500) << "a motion that does not meet itself shows little";
    }
}

/// A face without area may name a vertex twice, in any order.
TEST_F(SelfCollision, CountsARepeatedVertexOnce) {
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
          TriangleMesh mesh;
          mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
          mesh.triangles = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}};
          const Model model(mesh);
          for (const NeighbourFilter filter : kFilters) {
            fcl::CollisionResultd result;
            EXPECT_EQ(faces.contacts[int(filter)],
                      selfCollide(model, {filter}, this->all_, result));
          }
        }
      } while (std::next_permutation(faces.second.begin(), faces.second.end()));
    } while (std::next_permutation(faces.first.begin(), faces.first.end()));
  }
}

TEST_F(SelfCollision, PlacesContactsInTheWorld) {
  std::mt19937 random(testSeed(11));
  Model model(sheet());
  model.update(crumple(1, random));
  const fcl::Transform3d tf = randomPose(random, 3);
  fcl::CollisionRequestd with_points(1000000, true);
  fcl::CollisionResultd here, there;
  selfCollide(model, with_points, here);
  selfCollide(model, tf, {}, with_points, there);
  ASSERT_GT(here.numContacts(), 50u);
  ASSERT_EQ(here.numContacts(), there.numContacts());
  for (std::size_t i = 0; i < here.numContacts(); ++i) {
    const fcl::Contactd &a = here.getContact(i), &b = there.getContact(i);
    EXPECT_EQ(a.b1, b.b1);
    EXPECT_EQ(&model, b.o1);
    EXPECT_EQ(&model, b.o2);
    EXPECT_NEAR(0, (tf * a.pos - b.pos).norm(), 1e-5);
    EXPECT_NEAR(0, (tf.linear() * a.normal - b.normal).norm(), 1e-5);
  }
}

TEST_F(SelfCollision, StopsAtTheNumberOfContacts) {
  std::mt19937 random(testSeed(13));
  Model model(sheet());
  fcl::CollisionResultd none, one, three;
  EXPECT_EQ(0u, selfCollide(model, this->all_, none)) << "a plate at rest only has neighbours";
  model.update(crumple(1, random));
  EXPECT_EQ(1u, selfCollide(model, fcl::CollisionRequestd(), one));
  EXPECT_EQ(3u, selfCollide(model, fcl::CollisionRequestd(3), three));
  EXPECT_EQ(3u, selfCollide(model, fcl::CollisionRequestd(3), three)) << "already has them";
}

}  // namespace self_collision_test
}  // namespace adaptive_bvh_test
