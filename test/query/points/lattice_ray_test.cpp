// Rays with zeros of either sign, tiny components, any length, from near and far, at meshes on a
// lattice: judged in integers, over all triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "adaptive_bvh/point_query.h"
#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace lattice_ray_test {

using adaptive_bvh::RayHit;
using adaptive_bvh::RayRange;
__extension__ typedef __int128 Integer;
using IntegerPoint = std::array<Integer, 3>;

Integer determinant(const IntegerPoint& a, const IntegerPoint& b, const IntegerPoint& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}
IntegerPoint difference(const IntegerPoint& a, const IntegerPoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// A sum x + e y for an e > 0 that is smaller than every number that counts.
struct WithInfinitesimal {
  Integer x, y;

  int sign() const { return x != 0 ? (x > 0 ? 1 : -1) : (y > 0) - (y < 0); }
};

/// Where a ray on the lattice meets a triangle. Its direction is main + e tiny.
struct LatticeRay {
  IntegerPoint origin, main, tiny;

  WithInfinitesimal side(const IntegerPoint& p, const IntegerPoint& q) const {
    return {determinant(main, p, q), determinant(tiny, p, q)};
  }
  /// Whether it meets the triangle; then t = numerator / denominator, or 0 where the numerator is.
  bool meets(const std::array<IntegerPoint, 3>& t, Integer& numerator, Integer& denominator) const {
    std::array<IntegerPoint, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = difference(t[k], origin);
    WithInfinitesimal sum{0, 0};
    bool is_positive = false, is_negative = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const WithInfinitesimal s = side(p[k], p[(k + 1) % 3]);
      sum.x += s.x;
      sum.y += s.y;
      is_positive = is_positive || s.sign() > 0;
      is_negative = is_negative || s.sign() < 0;
    }
    if (is_positive == is_negative) return false;
    numerator = determinant(p[0], p[1], p[2]);
    denominator = sum.x;
    const int side_of_plane = (numerator > 0) - (numerator < 0);
    return side_of_plane * sum.sign() >= 0;
  }
};

/// A mesh of corners with integer coordinates; `unit` is the length of 1.
struct LatticeMesh {
  std::vector<IntegerPoint> vertices;
  std::vector<std::array<int, 3>> triangles;

  TriangleMesh mesh(double unit) const {
    TriangleMesh mesh;
    for (const IntegerPoint& p : vertices)
      mesh.vertices.emplace_back(double(p[0]) * unit, double(p[1]) * unit, double(p[2]) * unit);
    for (const auto& t : triangles)
      mesh.triangles.emplace_back(std::size_t(t[0]), std::size_t(t[1]), std::size_t(t[2]));
    return mesh;
  }
  std::array<IntegerPoint, 3> corners(int t) const {
    const auto& v = triangles[std::size_t(t)];
    return {vertices[std::size_t(v[0])], vertices[std::size_t(v[1])], vertices[std::size_t(v[2])]};
  }
};

class LatticeRays : public testing::Test {
 protected:
  using Model = adaptive_bvh::DeformableMesh;

  Integer below(int count) { return random_.below(count); }
  IntegerPoint point(int low, int high) {
    IntegerPoint p;
    for (Integer& x : p) x = low + below(high - low + 1);
    return p;
  }

  /// One of the 48 ways to map the axes onto the axes.
  IntegerPoint oriented(const IntegerPoint& p, int orientation) const {
    static constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                          {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    IntegerPoint q;
    for (std::size_t k = 0; k < 3; ++k)
      q[k] = p[std::size_t(kOrders[orientation / 8][k])] * (orientation >> k & 1 ? -1 : 1);
    return q;
  }

  /// A flat piece, a box, or triangles anywhere; on an even lattice, so that rays start between.
  LatticeMesh anyMesh() {
    LatticeMesh mesh;
    const int orientation = random_.below(48);
    switch (random_.below(3)) {
      case 0: {
        const int side = 1 + random_.below(4);
        for (int j = 0; j <= side; ++j)
          for (int i = 0; i <= side; ++i)
            mesh.vertices.push_back(oriented({2 * i, 2 * j, 0}, orientation));
        for (int j = 0; j < side; ++j)
          for (int i = 0; i < side; ++i) {
            const int v = j * (side + 1) + i;
            mesh.triangles.push_back({v, v + 1, v + side + 1});
            mesh.triangles.push_back({v + 1, v + side + 2, v + side + 1});
          }
        break;
      }
      case 1: {
        const IntegerPoint low = point(-3, 0), size = point(1, 3);
        for (int i = 0; i < 8; ++i)
          mesh.vertices.push_back(
              oriented({2 * (low[0] + (i & 1 ? size[0] : 0)), 2 * (low[1] + (i & 2 ? size[1] : 0)),
                        2 * (low[2] + (i & 4 ? size[2] : 0))},
                       orientation));
        mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
        break;
      }
      default:
        for (int t = 0; t < 12; ++t) {
          for (int k = 0; k < 3; ++k) {
            IntegerPoint p = point(-4, 4);
            for (Integer& x : p) x *= 2;
            mesh.vertices.push_back(p);
          }
          mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        }
    }
    return mesh;
  }

  /// Along an axis, or nearly, or anywhere on the lattice.
  LatticeRay anyRay() {
    LatticeRay ray{point(-9, 9), {}, {}};
    do {
      ray.main = point(-3, 3);
      if (random_.oneIn(2)) ray.main = oriented({0, 0, 1 + below(3)}, random_.below(48));
    } while (ray.main == IntegerPoint{});
    for (std::size_t k = 0; k < 3; ++k)
      if (ray.main[k] == 0 && random_.oneIn(4)) ray.tiny[k] = random_.oneIn(2) ? 1 : -1;
    if (random_.oneIn(8)) {  // from far away, back along the direction
      const Integer far = Integer(1) << random_.below(44);
      for (std::size_t k = 0; k < 3; ++k) ray.origin[k] -= far * ray.main[k];
    }
    return ray;
  }

  void check(const LatticeMesh& mesh, const Model& model, const LatticeRay& ray, double unit) {
    // A length of the direction, and what is infinitesimal beside it, down to the least number.
    const int shift = random_.below(2000) - 1074;
    const bool has_tiny = ray.tiny != IntegerPoint{};
    const double length = has_tiny ? 1. : std::ldexp(1., shift);
    const double tiny =
        random_.oneIn(2) ? std::numeric_limits<double>::denorm_min() : std::ldexp(1., -900);
    fcl::Vector3d origin, direction;
    for (std::size_t k = 0; k < 3; ++k) {
      origin[long(k)] = double(ray.origin[k]) * unit;
      const double zero = random_.oneIn(2) ? 0. : -0.;
      direction[long(k)] = ray.main[k] != 0   ? double(ray.main[k]) * length
                           : ray.tiny[k] != 0 ? double(ray.tiny[k]) * tiny
                                              : zero;
    }
    constexpr double kTolerance = sizeof(double) == sizeof(float) ? 1e-6 : 1e-12;
    std::vector<RayHit> hits;
    rayHits(model, origin, direction, hits);
    std::vector<int> expected, found;
    for (int t = 0; t < numTriangles(model); ++t) {
      Integer numerator, denominator;
      if (!ray.meets(mesh.corners(t), numerator, denominator)) continue;
      const auto exact = static_cast<long double>(numerator) /
                         static_cast<long double>(denominator) * unit / length;
      if (numerator != 0 && !(exact < static_cast<long double>(std::numeric_limits<double>::max())))
        continue;  // at a t that S cannot hold
      expected.push_back(t);
      const auto hit =
          std::find_if(hits.begin(), hits.end(), [&](const RayHit& h) { return h.triangle == t; });
      ASSERT_NE(hits.end(), hit);
      if (numerator == 0) {
        ASSERT_EQ(0, hit->t);
      } else {
        ASSERT_NEAR(1, double(hit->t / exact), kTolerance);
      }
    }
    for (const RayHit& hit : hits) {
      ASSERT_FALSE(std::signbit(hit.t));
      found.push_back(hit.triangle);
    }
    std::sort(found.begin(), found.end());
    ASSERT_EQ(expected, found);
    checkRange(model, origin, direction, hits, {});
    for (int i = 0; i < 3; ++i) checkRange(model, origin, direction, hits, anyRange(hits));
    origins_.push_back(origin);
    directions_.push_back(direction);
    hits_ += long(hits.size());
    rays_ += 1;
  }

  /// Ends at hits, next to them, between, or anywhere.
  RayRange anyRange(const std::vector<RayHit>& hits) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const auto end = [&](double otherwise) -> double {
      if (hits.empty() || random_.oneIn(4)) return otherwise;
      const double t = hits[std::size_t(random_.below(int(hits.size())))].t;
      switch (random_.below(4)) {
        case 0: return std::nextafter(t, kNever);
        case 1: return std::max(std::nextafter(t, -kNever), 0.);
        case 2: return t < std::numeric_limits<double>::max() / 4 ? t * 1.25 : t;
        default: return t;
      }
    };
    const double a = end(0), b = end(random_.oneIn(2) ? kNever : 0.);
    return {std::min(a, b), std::max(a, b)};
  }

  /// Every query agrees with what rayHits finds on the whole ray.
  void checkRange(const Model& model, const fcl::Vector3d& origin, const fcl::Vector3d& direction,
                  const std::vector<RayHit>& all, const RayRange& range) {
    std::vector<RayHit> expected, found;
    for (const RayHit& hit : all)
      if (range.begin <= hit.t && hit.t <= range.end) expected.push_back(hit);
    ASSERT_EQ(expected.size(), rayHits(model, origin, direction, range, found));
    for (std::size_t i = 0; i < found.size(); ++i) expectSame(expected[i], found[i]);
    const RayHit first = firstHit(model, origin, direction, range);
    if (expected.empty()) {
      EXPECT_EQ(-1, first.triangle);
      EXPECT_TRUE(std::isinf(first.t));
    } else {
      expectSame(expected[0], first);
    }
    ASSERT_EQ(!expected.empty(), anyHit(model, origin, direction, range));
    ranges_ += 1;
  }
  static void expectSame(const RayHit& a, const RayHit& b) {
    EXPECT_EQ(a.t, b.t);
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(a.u, b.u);
    EXPECT_EQ(a.v, b.v);
  }

  /// All rays of a mesh at once.
  void checkBatch(Model model, const RayRange& range) {
    model.setThreads(1 + random_.below(3));
    std::vector<RayHit> firsts;
    std::vector<std::uint8_t> any;
    firstHits(model, origins_.data(), directions_.data(), origins_.size(), range, firsts);
    anyHits(model, origins_.data(), directions_.data(), origins_.size(), range, any);
    ASSERT_EQ(origins_.size(), firsts.size());
    ASSERT_EQ(origins_.size(), any.size());
    for (std::size_t i = 0; i < firsts.size(); ++i) {
      expectSame(firstHit(model, origins_[i], directions_[i], range), firsts[i]);
      EXPECT_EQ(firsts[i].triangle >= 0 ? 1 : 0, any[i]);
    }
  }

  RandomGeometry random_{2718};
  std::vector<fcl::Vector3d> origins_, directions_;
  long hits_ = 0, rays_ = 0, ranges_ = 0;
};

TEST_F(LatticeRays, MeetWhatIntegersSay) {
  for (int round = 0; round < manySteps(1000) && !testing::Test::HasFailure(); ++round) {
    const LatticeMesh mesh = this->anyMesh();
    const Model model(mesh.mesh(1));
    for (int i = 0; i < 50 && !testing::Test::HasFailure(); ++i)
      this->check(mesh, model, this->anyRay(), 1);
    this->checkBatch(model, {});
    this->checkBatch(model, {0.5, 4.});
    this->origins_.clear();
    this->directions_.clear();
  }
  std::printf("%ld rays, %ld hits, %ld ranges\n", this->rays_, this->hits_, this->ranges_);
  EXPECT_GT(this->hits_, this->rays_ / 6);
}

/// At angles from 0.1 down to 1e-12, where the ray's depth is a quotient of small numbers.
TEST(GrazingRays, HaveTheRightT) {
  RandomGeometry random(15);
  int hits = 0;
  double worst = 0;
  for (int step = 0; step < manySteps(3000); ++step) {
    const fcl::Vector3d a = random.point(), b = random.point(), c = random.point(),
                        target = (a + b + c) / 3, normal = (b - a).cross(c - a).normalized(),
                        along = (b - a).normalized() + random.uniform() * (c - a).normalized(),
                        direction = along.normalized() + random.size(-12, -1) * normal,
                        origin = target - random.size(-1, 1) * direction;
    const adaptive_bvh::DeformableMesh mesh({a, b, c}, {{0, 1, 2}});
    const RayHit hit = adaptive_bvh::firstHit(mesh, origin, direction);
    if (hit.triangle < 0) continue;
    ++hits;
    const quad::Point exact = quad::cross(quad::of(b) - quad::of(a), quad::of(c) - quad::of(a));
    const quad::Real t =
        quad::dot(exact, quad::of(a) - quad::of(origin)) / quad::dot(exact, quad::of(direction));
    const double error = std::fabs(static_cast<double>(t - hit.t));
    worst = std::max(worst, error / (3 * (hit.t + (target - origin).norm() + 2)));
  }
  EXPECT_GT(hits, manySteps(1000));
  EXPECT_LT(worst, 0x1p-30);
}

}  // namespace lattice_ray_test
}  // namespace adaptive_bvh_test
