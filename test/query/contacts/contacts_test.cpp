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
using adaptive_bvh::pointsAs;
using adaptive_bvh::TriangleContact;
using adaptive_bvh::TrianglePoints;

constexpr NeighbourFilter kFilters[] = {NeighbourFilter::SharedVertex, NeighbourFilter::SharedEdge,
                                        NeighbourFilter::None};

template <typename S>
class ContactSearch : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Transform = fcl::Transform3<S>;
  using Result = fcl::CollisionResult<S>;
  using Pair = std::pair<int, int>;

  static TrianglePoints<S> corners(const Model& model, int t) {
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
  TriangleMesh<S> mesh(int triangles) {
    const int side = std::max(2, int(std::sqrt(triangles / 2.)));
    switch (random_.below(3)) {
      case 0: return plate<S>(side, side);
      case 1: return tube<S>(std::max(3, side), side);
      default: return soup<S>(triangles, random_.engine());
    }
  }
  /// The next frame: all vertices go their own way, most of them not far; now and then a few lie
  /// where others are.
  void deform(Model& model, S size) {
    std::vector<Vector3<S>> points = model.vertices();
    const S step = size * random_.size(-4, -0.7);
    for (Vector3<S>& p : points) p += random_.point() * step;
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
        const bool touches =
            shared(model, a, b) < least && adaptive_bvh::touch(pointsAs<double>(corners(model, a)),
                                                               pointsAs<double>(corners(model, b)));
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
    std::map<Pair, std::vector<const fcl::Contact<S>*>> found;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const auto& contact = result.getContact(i);
      EXPECT_EQ(&first, contact.o1);
      EXPECT_EQ(&second, contact.o2);
      found[{int(contact.b1), int(contact.b2)}].push_back(&contact);
    }
    const adaptive_bvh::RelativePlacement to_first(tf1, tf2);
    for (int a = 0; a < numTriangles(first); ++a)
      for (int b = 0; b < numTriangles(second); ++b) {
        const TrianglePoints<S> p = corners(first, a);
        const TrianglePoints<S> there = corners(second, b);
        const TrianglePoints<double> q = {to_first(there[0]), to_first(there[1]),
                                          to_first(there[2])};
        const bool touches = adaptive_bvh::touch(pointsAs<double>(p), q);
        const auto reported = found.find({a, b});
        missed_ += touches && reported == found.end();
        extra_ += !touches && reported != found.end();
        touching_ += touches;
        if (touches && reported != found.end()) {
          const TriangleContact expected = adaptive_bvh::contactOf(pointsAs<double>(p), q);
          ASSERT_EQ(expected.count, reported->second.size());
          for (unsigned i = 0; i < expected.count; ++i) {
            const fcl::Contact<S>& contact = *reported->second[i];
            const Vector3<S> point = tf1 * Vector3<S>(expected.points[i].template cast<S>());
            EXPECT_LE((point - contact.pos).norm(), kFieldError * (1 + point.norm()));
            EXPECT_LE((tf1.linear() * expected.normal.template cast<S>() - contact.normal).norm(),
                      kFieldError);
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

  static constexpr double kFieldError = std::is_same<S, double>::value ? 1e-11 : 1e-5;
  const fcl::CollisionRequest<S> all_{1000000}, with_fields_{1000000, true};
  RandomGeometry<S> random_{51};
  long touching_ = 0;
  int missed_ = 0, extra_ = 0;
};

TYPED_TEST_SUITE(ContactSearch, QueryScalars);

TYPED_TEST(ContactSearch, AMeshMeetsItselfWhereEveryPairSays) {
  using S = TypeParam;
  for (int body = 0; body < 300; ++body) {
    const TriangleMesh<S> mesh = this->mesh(body % 50 ? 24 : 250);
    typename TestFixture::Model model(mesh);
    for (int frame = 0; frame < 6; ++frame) {
      this->deform(model, 1);
      for (NeighbourFilter filter : kFilters) {
        fcl::CollisionResult<S> result;
        selfCollide(model, this->all_, result, filter);
        this->expectOwn(model, result, filter);
      }
    }
  }
  EXPECT_GT(this->touching_, 20000);
}

TYPED_TEST(ContactSearch, TwoMeshesMeetWhereEveryPairSays) {
  using S = TypeParam;
  for (int body = 0; body < 500; ++body) {
    typename TestFixture::Model first(this->mesh(body % 50 ? 24 : 150));
    TriangleMesh<S> mesh = this->mesh(24);
    const S size = this->random_.oneIn(3) ? this->random_.size(-2, 2) : S(1);
    for (Vector3<S>& p : mesh.vertices) p *= size;
    typename TestFixture::Model second(mesh);
    for (int frame = 0; frame < 10; ++frame) {
      this->deform(this->random_.oneIn(2) ? first : second, S(0.3));
      const S away = this->random_.oneIn(3) ? this->random_.size(0, 3) : S(0);
      const fcl::Transform3<S> tf1 = this->random_.pose(away);
      fcl::Transform3<S> tf2 = this->random_.pose(S(0.5));
      tf2.translation() += tf1.translation();
      fcl::CollisionResult<S> result;
      adaptive_bvh::collide<S>(&first, tf1, &second, tf2, this->with_fields_, result);
      this->expectBetween(first, tf1, second, tf2, result);
    }
  }
  EXPECT_GT(this->touching_, 5000);
}

/// The same contacts in the same order, every time; and the first of them when fewer are wanted.
TYPED_TEST(ContactSearch, TheOrderIsFixed) {
  using S = TypeParam;
  typename TestFixture::Model first(soup<S>(200, this->random_.engine()));
  typename TestFixture::Model second(soup<S>(200, this->random_.engine()));
  const fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  fcl::CollisionResult<S> whole, own;
  adaptive_bvh::collide<S>(&first, tf, &second, tf, this->all_, whole);
  selfCollide(first, this->all_, own);
  ASSERT_GT(whole.numContacts(), 50u);
  ASSERT_GT(own.numContacts(), 50u);
  for (std::size_t count = 1; count < 50; ++count) {
    fcl::CollisionResult<S> some, some_own;
    adaptive_bvh::collide<S>(&first, tf, &second, tf, fcl::CollisionRequest<S>(count), some);
    selfCollide(first, fcl::CollisionRequest<S>(count), some_own);
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
TYPED_TEST(ContactSearch, FollowsWhateverHappensToAMesh) {
  using S = TypeParam;
  using Model = typename TestFixture::Model;
  Model model(soup<S>(60, this->random_.engine()));
  const auto check = [&](const Model& m) {
    fcl::CollisionResult<S> own, both;
    selfCollide(m, this->all_, own);
    this->expectOwn(m, own, NeighbourFilter::SharedVertex);
    const fcl::Transform3<S> tf1 = this->random_.pose(S(0.2)), tf2 = this->random_.pose(S(0.2));
    adaptive_bvh::collide<S>(&m, tf1, &m, tf2, this->with_fields_, both);
    this->expectBetween(m, tf1, m, tf2, both);
  };
  const auto moved = [&] {
    std::vector<Vector3<S>> points = model.vertices();
    for (Vector3<S>& p : points) p += this->random_.point() * S(0.1);
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
    const Model other(soup<S>(60, this->random_.engine()));
    model = other;
    check(model);
    check(other);
    model.updateTwoFrames(moved());
    check(model);
    std::vector<Vector3<S>> refused = moved();
    refused[7][1] = std::numeric_limits<S>::quiet_NaN();
    EXPECT_THROW(model.update(refused), std::invalid_argument);
    check(model);
    model.update(moved());
  }
  EXPECT_GT(this->touching_, 1000);
}

/// Bodies of any size.
TYPED_TEST(ContactSearch, OfAnySize) {
  using S = TypeParam;
  const bool is_float = std::is_same<S, float>::value;
  for (double size :
       {is_float ? 1e-5 : 1e-30, is_float ? 1e-3 : 1e-9, 1e6, is_float ? 1e7 : 1e60}) {
    TriangleMesh<S> mesh = soup<S>(90, this->random_.engine());
    for (Vector3<S>& p : mesh.vertices) p *= S(size);
    typename TestFixture::Model model(mesh);
    fcl::CollisionResult<S> own, both;
    selfCollide(model, this->all_, own);
    this->expectOwn(model, own, NeighbourFilter::SharedVertex);
    for (int pose = 0; pose < 5; ++pose) {
      fcl::Transform3<S> tf1 = this->random_.pose(S(size)), tf2 = tf1;
      tf2.linear() = randomPose<S>(this->random_.engine(), 0).linear();
      tf2.translation() += this->random_.point() * S(0.3 * size);
      both.clear();
      adaptive_bvh::collide<S>(&model, tf1, &model, tf2, this->with_fields_, both);
      this->expectBetween(model, tf1, model, tf2, both);
    }
  }
  EXPECT_GT(this->touching_, 50);
}

}  // namespace contacts_test
}  // namespace adaptive_bvh_test
