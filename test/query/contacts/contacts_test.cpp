// collide and selfCollide of meshes against the exact test of every pair of triangles, over frames
// of deforming bodies: no pair missed, none too many, every field as the exact test gives it.
#include <gtest/gtest.h>

#include <map>

#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "base/rigid.h"
#include "support/fcl_float.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh_test {
namespace contacts_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::NeighbourFilter;
using adaptive_bvh::TriangleContact;
using adaptive_bvh::TrianglePoints;

constexpr NeighbourFilter kFilters[] = {NeighbourFilter::SharedVertex, NeighbourFilter::SharedEdge,
                                        NeighbourFilter::None};

class ContactSearch : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Transform = fcl::Transform3d;
  using Result = fcl::CollisionResultd;
  using Pair = std::pair<int, int>;

  static TrianglePoints corners(const Model& model, int t) {
    const fcl::Triangle& v = model.triangles()[t];
    return {model.vertices()[v[0]], model.vertices()[v[1]], model.vertices()[v[2]]};
  }
  static int shared(const Model& model, int a, int b) {
    int count = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) count += model.triangles()[a][i] == model.triangles()[b][j];
    return count;
  }

  /// A sheet, a hose, or loose triangles, of about so many.
  TriangleMesh mesh(int triangles) {
    const int side = std::max(2, int(std::sqrt(triangles / 2.)));
    switch (random_.below(3)) {
      case 0: return plate(side, side);
      case 1: return tube(std::max(3, side), side);
      default: return soup(triangles, random_.engine());
    }
  }
  /// The next frame: all vertices go their own way, most of them not far; now and then a few lie
  /// where others are.
  void deform(Model& model, double size) {
    std::vector<fcl::Vector3d> points = model.vertices();
    const double step = size * random_.size(-4, -0.7);
    for (fcl::Vector3d& p : points) p += random_.point() * step;
    if (random_.oneIn(4)) points[std::size_t(random_.below(numVertices(model)))] = points[0];
    if (random_.oneIn(3)) {
      const unsigned some[] = {unsigned(random_.below(numVertices(model)))};
      model.update(some, &points[some[0]], 1);
    } else {
      model.update(points);
    }
  }

  /// Expects a contact for exactly the pairs that the test calls touching, the smaller index first.
  void expectOwn(const Model& model, const Result& result, NeighbourFilter filter) {
    const int least = filter == NeighbourFilter::None ? 10 : 1 + int(filter);
    std::map<Pair, int> found;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const auto& contact = result.getContact(i);
      EXPECT_EQ(&model, contact.o1);
      EXPECT_LT(contact.b1, contact.b2);
      EXPECT_EQ(1, ++found[Pair(contact.b1, contact.b2)]) << "twice";
    }
    for (int a = 0; a < numTriangles(model); ++a)
      for (int b = a + 1; b < numTriangles(model); ++b) {
        const bool touches = shared(model, a, b) < least &&
                             adaptive_bvh::touch(corners(model, a), corners(model, b));
        const bool reported = found.count({a, b}) > 0;
        missed_ += touches && !reported;
        extra_ += !touches && reported;
        touching_ += touches;
      }
  }

  /// Checks pairs and every field of two meshes. Fields are near the oracle's, but not equal,
  /// because code of Eigen and FCL rotates them, which fuses products and sums on some processors.
  void expectBetween(const Model& first, const Transform& tf1, const Model& second,
                     const Transform& tf2, const Result& result) {
    std::map<Pair, std::vector<const fcl::Contactd*>> found;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const auto& contact = result.getContact(i);
      EXPECT_EQ(&first, contact.o1);
      EXPECT_EQ(&second, contact.o2);
      found[{int(contact.b1), int(contact.b2)}].push_back(&contact);
    }
    const adaptive_bvh::RelativePlacement to_first(tf1, tf2);
    for (int a = 0; a < numTriangles(first); ++a)
      for (int b = 0; b < numTriangles(second); ++b) {
        const TrianglePoints p = corners(first, a);
        const TrianglePoints there = corners(second, b);
        const TrianglePoints q = {to_first(there[0]), to_first(there[1]), to_first(there[2])};
        const bool touches = adaptive_bvh::touch(p, q);
        const auto reported = found.find({a, b});
        missed_ += touches && reported == found.end();
        extra_ += !touches && reported != found.end();
        touching_ += touches;
        if (touches && reported != found.end()) {
          const TriangleContact expected = adaptive_bvh::contactOf(p, q);
          ASSERT_EQ(expected.count, reported->second.size());
          for (unsigned i = 0; i < expected.count; ++i) {
            const fcl::Contactd& contact = *reported->second[i];
            const fcl::Vector3d point = tf1 * fcl::Vector3d(expected.points[i]);
            EXPECT_LE((point - contact.pos).norm(), kFieldError * (1 + point.norm()));
            EXPECT_LE((tf1.linear() * expected.normal - contact.normal).norm(), kFieldError);
            EXPECT_NEAR(expected.depth, contact.penetration_depth,
                        kFieldError * (1 + std::abs(expected.depth)));
          }
        }
      }
  }

  void TearDown() override {
    EXPECT_EQ(0, missed_);
    EXPECT_EQ(0, extra_);
  }

  static constexpr double kFieldError = std::is_same<double, double>::value ? 1e-11 : 1e-5;
  const fcl::CollisionRequestd all_{1000000}, with_fields_{1000000, true};
  RandomGeometry random_{51};
  long touching_ = 0;
  int missed_ = 0, extra_ = 0;
};

TEST_F(ContactSearch, AMeshMeetsItselfWhereEveryPairSays) {
  for (int body = 0; body < 300; ++body) {
    const TriangleMesh mesh = this->mesh(body % 50 ? 24 : 250);
    Model model(mesh);
    for (int frame = 0; frame < 6; ++frame) {
      this->deform(model, 1);
      for (NeighbourFilter filter : kFilters) {
        fcl::CollisionResultd result;
        selfCollide(model, {filter}, this->all_, result);
        this->expectOwn(model, result, filter);
      }
    }
  }
  EXPECT_GT(this->touching_, 20000);
}

TEST_F(ContactSearch, TwoMeshesMeetWhereEveryPairSays) {
  for (int body = 0; body < 500; ++body) {
    Model first(this->mesh(body % 50 ? 24 : 150));
    TriangleMesh mesh = this->mesh(24);
    const double size = this->random_.oneIn(3) ? this->random_.size(-2, 2) : 1.;
    for (fcl::Vector3d& p : mesh.vertices) p *= size;
    Model second(mesh);
    for (int frame = 0; frame < 10; ++frame) {
      this->deform(this->random_.oneIn(2) ? first : second, 0.3);
      const double away = this->random_.oneIn(3) ? this->random_.size(0, 3) : 0.;
      const fcl::Transform3d tf1 = this->random_.pose(away);
      fcl::Transform3d tf2 = this->random_.pose(0.5);
      tf2.translation() += tf1.translation();
      fcl::CollisionResultd result;
      adaptive_bvh::collide(&first, tf1, &second, tf2, this->with_fields_, result);
      this->expectBetween(first, tf1, second, tf2, result);
    }
  }
  EXPECT_GT(this->touching_, 5000);
}

/// The same contacts in the same order, every time; and the first of them when fewer are wanted.
TEST_F(ContactSearch, TheOrderIsFixed) {
  Model first(soup(200, this->random_.engine()));
  Model second(soup(200, this->random_.engine()));
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  fcl::CollisionResultd whole, own;
  adaptive_bvh::collide(&first, tf, &second, tf, this->all_, whole);
  selfCollide(first, this->all_, own);
  ASSERT_GT(whole.numContacts(), 50u);
  ASSERT_GT(own.numContacts(), 50u);
  for (std::size_t count = 1; count < 50; ++count) {
    fcl::CollisionResultd some, some_own;
    adaptive_bvh::collide(&first, tf, &second, tf, fcl::CollisionRequestd(count), some);
    selfCollide(first, fcl::CollisionRequestd(count), some_own);
    ASSERT_EQ(count, some.numContacts());
    ASSERT_EQ(count, some_own.numContacts());
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(whole.getContact(i).b1, some.getContact(i).b1);
      EXPECT_EQ(whole.getContact(i).b2, some.getContact(i).b2);
      EXPECT_EQ(own.getContact(i).b1, some_own.getContact(i).b1);
      EXPECT_EQ(own.getContact(i).b2, some_own.getContact(i).b2);
    }
  }
}

/// A mesh against itself, elsewhere, is two meshes; also after a copy, a move, an assignment, a
/// refused update, and in a two-frame update, whose present frame counts.
TEST_F(ContactSearch, FollowsWhateverHappensToAMesh) {
  using Model = Model;
  Model model(soup(60, this->random_.engine()));
  const auto check = [&](const Model& m) {
    fcl::CollisionResultd own, both;
    selfCollide(m, this->all_, own);
    this->expectOwn(m, own, NeighbourFilter::SharedVertex);
    const fcl::Transform3d tf1 = this->random_.pose(0.2), tf2 = this->random_.pose(0.2);
    adaptive_bvh::collide(&m, tf1, &m, tf2, this->with_fields_, both);
    this->expectBetween(m, tf1, m, tf2, both);
  };
  const auto moved = [&] {
    std::vector<fcl::Vector3d> points = model.vertices();
    for (fcl::Vector3d& p : points) p += this->random_.point() * 0.1;
    return points;
  };
  for (int round = 0; round < 8; ++round) {
    check(model);
    Model copy(model);
    this->deform(model, 1);
    check(copy);
    check(model);
    model = std::move(copy);
    check(model);
    const Model other(soup(60, this->random_.engine()));
    model = other;
    check(model);
    check(other);
    model.updateTwoFrames(moved());
    check(model);
    std::vector<fcl::Vector3d> refused = moved();
    refused[7][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(model.update(refused), std::invalid_argument);
    check(model);
    model.update(moved());
  }
  EXPECT_GT(this->touching_, 1000);
}

/// Bodies of any size.
TEST_F(ContactSearch, OfAnySize) {
  for (double size : {1e-30, 1e-9, 1e6, 1e60}) {
    TriangleMesh mesh = soup(90, this->random_.engine());
    for (fcl::Vector3d& p : mesh.vertices) p *= double(size);
    Model model(mesh);
    fcl::CollisionResultd own, both;
    selfCollide(model, this->all_, own);
    this->expectOwn(model, own, NeighbourFilter::SharedVertex);
    for (int pose = 0; pose < 5; ++pose) {
      fcl::Transform3d tf1 = this->random_.pose(double(size)), tf2 = tf1;
      tf2.linear() = randomPose(this->random_.engine(), 0).linear();
      tf2.translation() += this->random_.point() * double(0.3 * size);
      both.clear();
      adaptive_bvh::collide(&model, tf1, &model, tf2, this->with_fields_, both);
      this->expectBetween(model, tf1, model, tf2, both);
    }
  }
  EXPECT_GT(this->touching_, 50);
}

}  // namespace contacts_test
}  // namespace adaptive_bvh_test
