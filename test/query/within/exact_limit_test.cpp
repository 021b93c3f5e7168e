// Pairs on lattices whose distance is the limit or differs from it by less than rounding, against
// whole numbers of any size: no pair missed, none too many.
#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <vector>

#include "adaptive_bvh/contact_set.h"
#include "adaptive_bvh/proximity.h"
#include "support/lattice_features.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace exact_limit_test {

using adaptive_bvh::ContactElements;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePairs;
using Mesh = TriangleMesh;
using Model = adaptive_bvh::DeformableMesh;
using PairSet = std::set<std::pair<unsigned, unsigned>>;

/// A whole number: digits of 24 bits, the lowest first, of which the last has the sign.
class Integer {
 public:
  /// x in units of 2^-120, of which it must be a multiple.
  Integer(double x) {
    int exponent;
    Wide integer = Wide(std::frexp(x, &exponent) * 0x1p53);
    const int shift = x == 0 ? 0 : exponent - 53 + 120;
    EXPECT_GE(shift, 0);
    digits_.assign(std::size_t(shift / kBits), 0);
    for (integer <<= shift % kBits; integer != 0 && integer != -1; integer >>= kBits)
      digits_.push_back(std::int64_t(integer & kMask));
    digits_.push_back(std::int64_t(integer));
  }
  friend Integer operator+(Integer a, const Integer& b) { return a.add(b, 1); }
  friend Integer operator-(Integer a, const Integer& b) { return a.add(b, -1); }
  friend Integer operator*(const Integer& a, const Integer& b) {
    Integer product(0);
    product.digits_.assign(a.digits_.size() + b.digits_.size(), 0);
    for (std::size_t i = 0; i < a.digits_.size(); ++i)
      for (std::size_t j = 0; j < b.digits_.size(); ++j)
        product.digits_[i + j] += a.digits_[i] * b.digits_[j];  // of at most 2^10 of 48 bits
    return product.carry();
  }
  int sign() const {
    if (digits_.back() < 0) return -1;
    return std::any_of(digits_.begin(), digits_.end(), [](std::int64_t d) { return d != 0; });
  }
  friend bool operator<=(const Integer& a, const Integer& b) { return (a - b).sign() <= 0; }
  friend bool operator<(const Integer& a, const Integer& b) { return (a - b).sign() < 0; }

 private:
  __extension__ typedef __int128 Wide;
  static constexpr int kBits = 24;
  static constexpr std::int64_t kMask = (1 << kBits) - 1;

  Integer& add(const Integer& b, int sign) {
    digits_.resize(std::max(digits_.size(), b.digits_.size()));
    for (std::size_t k = 0; k < b.digits_.size(); ++k) digits_[k] += sign * b.digits_[k];
    return carry();
  }
  Integer& carry() {
    for (std::size_t k = 0; k + 1 < digits_.size(); ++k) {
      digits_[k + 1] += digits_[k] >> kBits;
      digits_[k] &= kMask;
    }
    if (digits_.back() >> kBits != 0 && digits_.back() >> kBits != -1)
      digits_.push_back(0), carry();
    return *this;
  }

  std::vector<std::int64_t> digits_;
};

using Vector = std::array<Integer, 3>;
Vector vectorTo(const fcl::Vector3d& a, const fcl::Vector3d& b) {
  return {Integer(b[0]) - a[0], Integer(b[1]) - a[1], Integer(b[2]) - a[2]};
}
Integer dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

using Points = std::vector<fcl::Vector3d>;

/// Whether features are at most `limit` apart: by quadruple precision, or if that is not certain,
/// by whole numbers and Gram's determinants.
class Judge {
 public:
  explicit Judge(double limit) : limit_(limit), square_(Integer(limit) * limit) {}

  bool isNear(const fcl::Vector3d& x, const Points& f) const {
    const quad::Real distance = quad::root(
        quad::squaredDistance(quad::of(x), {quad::of(f[0]), quad::of(f[1]), quad::of(f[2])}));
    if (isCertain(distance)) return distance < limit_;
    return isNearPlane(vectorTo(f[0], x), vectorTo(f[0], f[1]), vectorTo(f[0], f[2]), true) ||
           isNearSegment(x, f[0], f[1]) || isNearSegment(x, f[1], f[2]) ||
           isNearSegment(x, f[2], f[0]);
  }
  bool isNear(const Points& a, const Points& b) const {
    const quad::Real distance =
        adaptive_bvh_test::distance(quad::of(a[0]), quad::of(a[1]), quad::of(b[0]), quad::of(b[1]));
    if (isCertain(distance)) return distance < limit_;
    return isNearPlane(vectorTo(a[0], b[0]), vectorTo(a[0], a[1]), vectorTo(b[1], b[0]), false) ||
           isNearSegment(a[0], b[0], b[1]) || isNearSegment(a[1], b[0], b[1]) ||
           isNearSegment(b[0], a[0], a[1]) || isNearSegment(b[1], a[0], a[1]);
  }

 private:
  bool isCertain(const quad::Real& distance) const {
    const quad::Real difference = distance - limit_;
    return quad::absolute(difference) > quad::Real(1e-24) * limit_;
  }
  bool isNearPoint(const fcl::Vector3d& x, const fcl::Vector3d& y) const {
    return dot(vectorTo(x, y), vectorTo(x, y)) <= square_;
  }
  bool isNearSegment(const fcl::Vector3d& x, const fcl::Vector3d& a, const fcl::Vector3d& b) const {
    if (isNearPoint(x, a) || isNearPoint(x, b)) return true;
    const Vector w = vectorTo(a, x), u = vectorTo(a, b);
    const Integer along = dot(w, u), length = dot(u, u);
    return Integer(0) < along && along < length &&
           dot(w, w) * length - along * along <= square_ * length;
  }
  /// Of w - s u - t v, where s and t are from 0 to 1, and s + t, too, if it is a triangle.
  bool isNearPlane(const Vector& w, const Vector& u, const Vector& v, bool is_triangle) const {
    const Integer a = dot(u, u), b = dot(u, v), c = dot(v, v), p = dot(w, u), q = dot(w, v);
    const Integer all = a * c - b * b, s = p * c - q * b, t = q * a - p * b;
    if (!(Integer(0) < all) || s < Integer(0) || t < Integer(0)) return false;
    if (is_triangle ? all < s + t : all < s || all < t) return false;
    return dot(w, w) * all - p * s - q * t <= square_ * all;
  }

  const double limit_;
  const Integer square_;
};

/// Two meshes that do not touch, and where the second is in the frame of the first.
struct Scene {
  Mesh first, second;
  fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = fcl::Transform3d::Identity();
  Points placed;  ///< vertices of the second, in the frame of the first

  Points face(int side, const fcl::Triangle& t) const {
    const Points& of = side == 0 ? first.vertices : placed;
    return {of[t[0]], of[t[1]], of[t[2]]};
  }
};

/// The pairs of a scene within a limit, by all pairs of features.
struct Expected {
  PairSet triangles;
  FeatureSet features;

  Expected(const Scene& scene, double limit) {
    const Judge judge(limit);
    for (unsigned i = 0; i < scene.first.triangles.size(); ++i)
      for (unsigned j = 0; j < scene.second.triangles.size(); ++j) add(judge, scene, i, j);
  }

 private:
  void add(const Judge& judge, const Scene& scene, unsigned i, unsigned j) {
    const fcl::Triangle &s = scene.first.triangles[i], &t = scene.second.triangles[j];
    const Points a = scene.face(0, s), b = scene.face(1, t);
    const auto found = [&](FeatureKind kind, const std::set<std::size_t>& one,
                           const std::set<std::size_t>& other) {
      triangles.insert({i, j});
      features.insert({kind, one, other});
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const int v = int(k);
      if (judge.isNear(a[k], b)) found(FeatureKind::VertexFace, {s[v]}, {t[0], t[1], t[2]});
      if (judge.isNear(b[k], a)) found(FeatureKind::FaceVertex, {t[v]}, {s[0], s[1], s[2]});
      for (std::size_t l = 0; l < 3; ++l)
        if (judge.isNear(Points{a[k], a[(k + 1) % 3]}, Points{b[l], b[(l + 1) % 3]}))
          found(FeatureKind::EdgeEdge, {s[v], s[(v + 1) % 3]}, {t[int(l)], t[(int(l) + 1) % 3]});
    }
  }
};

/// Random triangles, or a sheet of squares, of lattice points with heights from `low` to `high`.
Mesh makeMesh(RandomGeometry& random, bool is_sheet, int low, int high) {
  Mesh mesh;
  const int height = low + random.below(high - low + 1);
  for (int i = 0; i < 9; ++i)
    if (is_sheet)
      mesh.vertices.emplace_back(3 * (i % 3) - 3, 3 * (i / 3) - 3, height);
    else
      mesh.vertices.emplace_back(random.below(9) - 4, random.below(9) - 4,
                                 low + random.below(high - low + 1));
  for (std::size_t i = 0; i < 8 && is_sheet; ++i) {
    const std::size_t from = i / 4 * 3 + i / 2 % 2;
    mesh.triangles.emplace_back(i % 2 ? from : from + 1, i % 2 ? from + 1 : from + 4, from + 3);
  }
  for (std::size_t i = 0; i < 5 && !is_sheet; ++i)
    mesh.triangles.emplace_back(i, i + 1 + i % 3, i + 4);
  return mesh;
}

Scene makeScene(RandomGeometry& random) {
  const bool is_sheet = random.oneIn(3);
  Scene scene{makeMesh(random, is_sheet, -4, 0), makeMesh(random, is_sheet, 1, 5), {}, {}, {}};
  scene.tf1.setIdentity();
  scene.tf2.setIdentity();
  const int axis = random.below(3),
            divisor = std::array<int, 4>{1, 10, 8, 10}[std::size_t(random.below(4))];
  const double scale = std::ldexp(1, random.below(61) - 30);
  const auto toLattice = [&](fcl::Vector3d& x) {
    for (int k = 0; k < axis; ++k) x = fcl::Vector3d(x[1], x[2], x[0]);
    x = x / divisor * scale;
  };
  for (Mesh* mesh : {&scene.first, &scene.second})
    for (fcl::Vector3d& x : mesh->vertices) toLattice(x);
  if (random.oneIn(2)) {  // along the sheets, or at least not nearer
    fcl::Vector3d along(random.below(7) - 3, random.below(7) - 3, random.below(3));
    fcl::Vector3d both(random.below(99), random.below(99), random.below(99));
    toLattice(along);
    toLattice(both);
    scene.tf1.translation() = both;
    scene.tf2.translation() = both + along;
  }
  const fcl::Vector3d between = scene.tf2.translation() - scene.tf1.translation();
  for (const fcl::Vector3d& x : scene.second.vertices) scene.placed.push_back(x + between);
  return scene;
}

PairSet setOf(const std::vector<adaptive_bvh::FeaturePair>& pairs) {
  PairSet set;
  for (const auto& pair : pairs) set.insert({pair.first, pair.second});
  return set;
}
std::vector<adaptive_bvh::FeaturePair> pairsOf(const adaptive_bvh::NumberedPairs& numbered) {
  std::vector<adaptive_bvh::FeaturePair> pairs;
  for (unsigned n = 0; n < numbered.pairs.size(); ++n)
    if (numbered.contains(n)) pairs.push_back(numbered.pairs[n]);
  return pairs;
}

void testTwoMeshes(const Scene& scene, double limit, const Expected& expected) {
  const Model first(scene.first), second(scene.second);
  adaptive_bvh::ProximityRequest request;
  request.distance = limit;
  adaptive_bvh::TrianglePairs triangles;
  pairsWithin(first, scene.tf1, second, scene.tf2, request, triangles);
  EXPECT_EQ(expected.triangles, setOf(triangles.triangles));
  request.enable_distances = true;
  pairsWithin(first, scene.tf1, second, scene.tf2, request, triangles);
  EXPECT_EQ(expected.triangles, setOf(triangles.triangles));
  for (const double distance : triangles.distances) EXPECT_LE(distance, limit);
  FeaturePairs features;
  featurePairsWithin(first, scene.tf1, second, scene.tf2, limit, features);
  EXPECT_EQ(expected.features, featurePairs(features, scene.first, scene.second));
  const bool is_nearer = !expected.triangles.empty();
  EXPECT_EQ(is_nearer, isNearer(first, scene.tf1, second, scene.tf2, limit));
  adaptive_bvh::CoherentProximity coherent(first, second);
  for (int call = 0; call < 3; ++call)
    EXPECT_EQ(is_nearer, coherent.isNearer(scene.tf1, scene.tf2, limit));
  adaptive_bvh::ContactSetRequest kept{limit};
  adaptive_bvh::ContactSet near_triangles(first, second, kept);
  kept.elements = ContactElements::Features;
  adaptive_bvh::ContactSet near_features(first, second, kept);
  for (int step = 0; step < 2; ++step) {  // first apart, then in place
    fcl::Transform3d tf2 = scene.tf2;
    if (step == 0) tf2.translation() *= 1 + 0x1p-20;
    near_triangles.update(scene.tf1, tf2);
    near_features.update(scene.tf1, tf2);
  }
  EXPECT_EQ(expected.triangles, setOf(pairsOf(near_triangles.triangles())));
  const FeaturePairs in_set{pairsOf(near_features.features(FeatureKind::VertexFace)),
                            pairsOf(near_features.features(FeatureKind::FaceVertex)),
                            pairsOf(near_features.features(FeatureKind::EdgeEdge))};
  EXPECT_EQ(expected.features, featurePairs(in_set, scene.first, scene.second));
}

/// Of one mesh of both, tests the pairs of the one with the other.
void testOneMesh(const Scene& scene, double limit, const Expected& expected) {
  Mesh both = scene.first;
  const std::size_t vertices = both.vertices.size();
  const auto triangles = static_cast<unsigned>(both.triangles.size());
  both.vertices.insert(both.vertices.end(), scene.placed.begin(), scene.placed.end());
  for (const fcl::Triangle& t : scene.second.triangles)
    both.triangles.emplace_back(t[0] + vertices, t[1] + vertices, t[2] + vertices);
  const Model model(both);
  adaptive_bvh::ProximityRequest request;
  request.distance = limit;
  adaptive_bvh::TrianglePairs result;
  selfPairsWithin(model, request, result);
  PairSet found;
  for (const auto& pair : result.triangles)
    if (pair.first < triangles && pair.second >= triangles)
      found.insert({pair.first, pair.second - triangles});
  EXPECT_EQ(expected.triangles, found);
  FeaturePairs features;
  selfFeaturePairsWithin(model, limit, features);
  std::size_t crossing = 0;  // pairs of features of both
  for (const auto& pair : featurePairs(features, both, both, true))
    crossing += (*std::get<1>(pair).begin() < vertices) != (*std::get<2>(pair).begin() < vertices);
  EXPECT_EQ(expected.features.size(), crossing);
}

/// The limit is the rounded distance of two triangles, the next number below, or that above.
TEST(ExactLimit, PairsAreThoseOfExactArithmetic) {
  RandomGeometry random(67006);
  int exactly = 0;
  for (int trial = 0; trial < manySteps(150); ++trial) {
    const Scene scene = makeScene(random);
    const auto quadOf = [&](int side, const std::vector<fcl::Triangle>& of) -> quad::Triangle {
      const Points p = scene.face(side, of[std::size_t(random.below(int(of.size())))]);
      return {quad::of(p[0]), quad::of(p[1]), quad::of(p[2])};
    };
    const auto middle = static_cast<double>(
        quad::distance(quadOf(0, scene.first.triangles), quadOf(1, scene.second.triangles)));
    std::size_t before = 0;
    for (const double limit :
         {std::nextafter(middle, 0.), middle, std::nextafter(middle, 2 * middle)}) {
      SCOPED_TRACE(testing::Message() << "trial " << trial << ", limit " << limit);
      const Expected expected(scene, limit);
      testTwoMeshes(scene, limit, expected);
      testOneMesh(scene, limit, expected);
      exactly += limit != middle || expected.triangles.size() > before;
      before = expected.triangles.size();
    }
  }
  EXPECT_GT(exactly, manySteps(150));
}

}  // namespace exact_limit_test
}  // namespace adaptive_bvh_test
