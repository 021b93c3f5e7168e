// Points and rays against deforming meshes, judged by every triangle in long double.
#include <gtest/gtest.h>

#include "adaptive_bvh/point_query.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace point_query_test {

using adaptive_bvh::ClosestPoint;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::RayHit;
using adaptive_bvh::RayRange;
using exact::Real;

class PointQuery : public testing::Test {
 protected:
  using Model = DeformableMesh;

  /// Of any size and place, and deformed.
  Model makeModel(double size, const fcl::Vector3d& place) {
    const int side = 2 + random_.below(7);
    TriangleMesh mesh;
    switch (random_.below(4)) {
      case 0: mesh = plate(side, side); break;
      case 1: mesh = tube(std::max(3, side), side); break;
      case 2: mesh = dome(std::max(3, side), side); break;
      default: mesh = soup(2 + 6 * side, random_.engine());
    }
    for (fcl::Vector3d& p : mesh.vertices) p = size * p + place;
    Model model(mesh);
    for (fcl::Vector3d& p : mesh.vertices) p += size * 0.1 * random_.point();
    model.update(mesh.vertices);
    return model;
  }
  static exact::Triangle triangle(const Model& model, int t) {
    const fcl::Triangle& v = model.triangles()[t];
    return {exact::of(model.vertices()[v[0]]), exact::of(model.vertices()[v[1]]),
            exact::of(model.vertices()[v[2]])};
  }

  RandomGeometry random_{314};
};

TEST_F(PointQuery, TheClosestPointIsThatOfAllTriangles) {
  for (int body = 0; body < 120; ++body) {
    const double size = this->random_.size(-2, 2);
    const fcl::Vector3d place = this->random_.point() * this->random_.size(-2, 3);
    const Model model = this->makeModel(size, place);
    std::vector<fcl::Vector3d> points;
    for (int i = 0; i < 20; ++i)
      points.push_back(place + this->random_.point() * size * this->random_.size(-2, 2));
    points.push_back(model.vertices()[0]);
    points.push_back(place + fcl::Vector3d::Constant(1e9 * size));
    std::vector<ClosestPoint> results;
    closestPoints(model, points, results);
    ASSERT_EQ(points.size(), results.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const exact::Point x = exact::of(points[i]);
      Real least = std::numeric_limits<Real>::max(), farthest = 0;
      for (int t = 0; t < numTriangles(model); ++t) {
        least = std::min(least, exact::distance(this->triangle(model, t), x));
        farthest = std::max(farthest, (this->triangle(model, t)[0] - x).norm());
      }
      const Real coordinates = std::max<Real>(x.norm(), farthest);
      const Real tolerance = farthest * 1e-13L + least * std::numeric_limits<double>::epsilon();
      EXPECT_NEAR(double(least), double(results[i].distance), double(tolerance));
      const exact::Point found = exact::of(results[i].point);
      EXPECT_LE(exact::distance(this->triangle(model, results[i].triangle), found),
                4 * std::numeric_limits<double>::epsilon() * coordinates);
      const ClosestPoint one = closestPoint(model, points[i]);
      EXPECT_NEAR(double(least), double(one.distance), double(tolerance));
    }
  }
}

/// A ray and a triangle in long double. `margin` is how far the point is inside, as a share of the
/// triangle, negative outside; 0 where the ray is nearly in its plane.
struct ExactHit {
  Real t, margin;
};
ExactHit meet(const exact::Triangle& p, const exact::Point& origin, const exact::Point& along) {
  const exact::Point u = p[1] - p[0], v = p[2] - p[0], normal = u.cross(v);
  const Real slope = normal.dot(along);
  if (std::abs(slope) <= 1e-6L * normal.norm() * along.norm()) return {0, 0};
  const Real t = normal.dot(p[0] - origin) / slope;
  const exact::Point x = origin + t * along - p[0];
  const Real area = normal.squaredNorm(), b = x.cross(v).dot(normal) / area,
             c = u.cross(x).dot(normal) / area;
  return {t, std::min(std::min(b, c), 1 - b - c)};
}

TEST_F(PointQuery, RaysMeetWhatTheyMeetInAllTriangles) {
  long hits = 0;
  for (int body = 0; body < 150; ++body) {
    const double size = this->random_.size(-2, 2);
    const fcl::Vector3d place = this->random_.point() * size;
    const Model model = this->makeModel(size, place);
    std::vector<fcl::Vector3d> origins, directions;
    for (int i = 0; i < 30; ++i) {
      origins.push_back(place + this->random_.direction() * size * this->random_.size(-1, 2));
      const fcl::Vector3d target = place + this->random_.point() * size;
      directions.push_back(
          this->random_.oneIn(8)
              ? fcl::Vector3d(fcl::Vector3d::Unit(this->random_.below(3)))
              : fcl::Vector3d((target - origins.back()) * this->random_.size(-3, 3)));
    }
    std::vector<RayHit> first, all;
    firstHits(model, origins.data(), directions.data(), origins.size(), first);
    ASSERT_EQ(origins.size(), first.size());
    for (std::size_t i = 0; i < origins.size(); ++i) {
      const exact::Point origin = exact::of(origins[i]), along = exact::of(directions[i]);
      rayHits(model, origins[i], directions[i], all);
      hits += long(all.size());
      std::vector<int> found(std::size_t(numTriangles(model)), 0);
      for (std::size_t k = 0; k < all.size(); ++k) {
        EXPECT_EQ(1, ++found[std::size_t(all[k].triangle)]);
        EXPECT_GE(all[k].t, 0);
        if (k > 0) {
          EXPECT_LE(all[k - 1].t, all[k].t);
        }
      }
      EXPECT_EQ(all.empty() ? -1 : all[0].triangle, first[i].triangle);
      for (int t = 0; t < numTriangles(model); ++t) {
        const exact::Triangle corners = this->triangle(model, t);
        const ExactHit hit = meet(corners, origin, along);
        constexpr Real kClose = 1e-6L;
        if (std::abs(hit.margin) < kClose || std::abs(hit.t) * along.norm() < kClose * size)
          continue;  // too close to say
        const bool is_hit = hit.margin > 0 && hit.t > 0;
        EXPECT_EQ(is_hit, found[std::size_t(t)] > 0) << double(hit.margin) << " " << double(hit.t);
      }
      for (const RayHit& hit : all) {
        const exact::Triangle p = this->triangle(model, hit.triangle);
        const exact::Point on_ray = origin + Real(hit.t) * along;
        const exact::Point on_triangle =
            (1 - Real(hit.u) - Real(hit.v)) * p[0] + Real(hit.u) * p[1] + Real(hit.v) * p[2];
        const Real steep =
            std::abs((p[1] - p[0]).cross(p[2] - p[0]).normalized().dot(along)) / along.norm();
        if (steep > 1e-3L) {
          EXPECT_LE((on_ray - on_triangle).norm(),
                    (origin.norm() + size) * 100 * std::numeric_limits<double>::epsilon() / steep);
        }
      }
    }
  }
  EXPECT_GT(hits, 500);
}

TEST_F(PointQuery, NoRayLeavesAClosedSurfaceUnseen) {
  // A cube of 12 triangles around the origin, seen from inside: through corners, sides, faces.
  TriangleMesh box;
  for (int i = 0; i < 8; ++i)
    box.vertices.emplace_back(i & 1 ? 0.7 : -0.3, i & 2 ? 0.6 : -0.9, i & 4 ? 0.1 : -1.1);
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& f : faces)
    box.triangles.emplace_back(std::size_t(f[0]), std::size_t(f[1]), std::size_t(f[2]));
  const Model model(box);
  std::vector<RayHit> all;
  for (int i = 0; i < 20000; ++i) {
    const fcl::Vector3d origin = this->random_.point() * 0.05;
    const auto& a = box.vertices[std::size_t(this->random_.below(8))];
    const auto& b = box.vertices[std::size_t(this->random_.below(8))];
    const fcl::Vector3d target =
        this->random_.oneIn(3) ? a : fcl::Vector3d(a + this->random_.uniform(0, 1) * (b - a));
    if ((target - origin).isZero(1e-3)) continue;
    const RayHit hit = firstHit(model, origin, fcl::Vector3d(target - origin));
    ASSERT_GE(hit.triangle, 0);
    EXPECT_EQ(hit.t, (rayHits(model, origin, fcl::Vector3d(target - origin), all), all[0].t));
    EXPECT_TRUE(anyHit(model, origin, fcl::Vector3d(target - origin)));
  }
}

TEST_F(PointQuery, ManyRaysAreAnsweredAsOneByOneOnAnyThreads) {
  Model model = this->makeModel(1, fcl::Vector3d::Zero());
  std::vector<fcl::Vector3d> origins, directions;
  for (int i = 0; i < 3000; ++i) {
    origins.push_back(this->random_.point() * 2.);
    directions.push_back(i % 5 == 4 ? directions.back() : this->random_.direction());
  }
  for (const RayRange range : {RayRange(), RayRange{0.25, 1}, RayRange{1, 1}})
    for (const int threads : {1, 2, 3}) {
      model.setThreads(threads);
      std::vector<RayHit> first;
      std::vector<std::uint8_t> any;
      firstHits(model, origins.data(), directions.data(), origins.size(), range, first);
      anyHits(model, origins.data(), directions.data(), origins.size(), range, any);
      ASSERT_EQ(origins.size(), first.size());
      ASSERT_EQ(origins.size(), any.size());
      for (std::size_t i = 0; i < origins.size(); ++i) {
        const RayHit one = firstHit(model, origins[i], directions[i], range);
        EXPECT_EQ(one.triangle, first[i].triangle);
        EXPECT_EQ(one.t, first[i].t);
        EXPECT_EQ(one.triangle >= 0, any[i] == 1);
        EXPECT_EQ(one.triangle >= 0, anyHit(model, origins[i], directions[i], range));
      }
    }
}

TEST_F(PointQuery, RefusesRangesOfRaysThatAreNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Model model = this->makeModel(1, fcl::Vector3d::Zero());
  const fcl::Vector3d origin(0, 0, 0), direction(0, 0, 1);
  std::vector<RayHit> hits(3);
  std::vector<std::uint8_t> any(3, 7);
  for (const RayRange bad :
       {RayRange{kNan, 1}, RayRange{0, kNan}, RayRange{-1, 1}, RayRange{2, 1}, RayRange{0, -1}}) {
    EXPECT_THROW(firstHit(model, origin, direction, bad), std::invalid_argument);
    EXPECT_THROW(anyHit(model, origin, direction, bad), std::invalid_argument);
    EXPECT_THROW(rayHits(model, origin, direction, bad, hits), std::invalid_argument);
    EXPECT_THROW(firstHits(model, &origin, &direction, 1, bad, hits), std::invalid_argument);
    EXPECT_THROW(anyHits(model, &origin, &direction, 1, bad, any), std::invalid_argument);
    EXPECT_EQ(3u, hits.size());
    EXPECT_EQ(std::vector<std::uint8_t>(3, 7), any);
  }
  const double never = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(anyHit(model, origin, direction, {never, never}));
}

}  // namespace point_query_test
}  // namespace adaptive_bvh_test
