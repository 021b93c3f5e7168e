// A polygon that is said to keep away from itself does: by the distances of all corners and edges.
#include "boxes/flat_patches.h"
#include "support/long_mode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Core>

namespace adaptive_bvh_test {
namespace plane_contour_test {

using adaptive_bvh::Float4;
using adaptive_bvh::PlaneContour;
using Point = Eigen::Vector2d;
using Polygon = std::vector<Point>;

bool keepsApart(const Polygon& polygon, double distance) {
  PlaneContour contour(polygon.size());
  for (std::size_t i = 0; i < polygon.size(); i += 4) {
    Float4 x, y;
    for (std::size_t k = 0; k < 4; ++k) {
      const Point& p = polygon[std::min(i + k, polygon.size() - 1)];
      x[k] = float(p[0]);
      y[k] = float(p[1]);
    }
    contour.setCorners(i, x, y);
  }
  return contour.keepsApart(float(distance));
}

double cross(const Point& a, const Point& b) { return a[0] * b[1] - a[1] * b[0]; }

double toEdge(const Point& p, const Point& a, const Point& b) {
  const double along = (p - a).dot(b - a) / (b - a).squaredNorm();
  return (p - a - std::min(1., std::max(0., along)) * (b - a)).norm();
}

bool doCross(const Point& a, const Point& b, const Point& c, const Point& d) {
  return cross(b - a, c - a) * cross(b - a, d - a) < 0 &&
         cross(d - c, a - c) * cross(d - c, b - c) < 0;
}

/// The smallest distance of a corner from an edge that does not end in it; 0 where edges cross.
double distanceToItself(const Polygon& p) {
  const std::size_t n = p.size();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const Point &a = p[j], &b = p[(j + 1) % n];
      if (i != j && i != (j + 1) % n) least = std::min(least, toEdge(p[i], a, b));
      if (doCross(p[i], p[(i + 1) % n], a, b)) return 0;
    }
  return least;
}

/// Around a wavy circle, some corners in disorder.
Polygon randomPolygon(std::mt19937& random) {
  std::uniform_real_distribution<double> one(-1, 1);
  const std::size_t corners = 3 + random() % 40;
  const double wave = 0.6 * std::fabs(one(random)), noise = random() % 2 ? 0.3 * one(random) : 0.02;
  const double turn = 3 * one(random);
  Polygon polygon;
  for (std::size_t i = 0; i < corners; ++i) {
    const double angle = 2 * M_PI * double(i) / double(corners);
    const double radius = 1 + wave * std::sin(5 * angle), bend = angle + turn * wave * radius;
    polygon.push_back(radius * Point(std::cos(bend), std::sin(bend)) +
                      noise * Point(one(random), one(random)));
  }
  return polygon;
}

TEST(PlaneContour, SaysOnlyOfThoseThatKeepApart) {
  std::mt19937 random(testSeed(1));
  int apart = 0, near = 0;
  for (int i = 0; i < 20000; ++i) {
    const Polygon polygon = randomPolygon(random);
    const double distance = 0.02, real = distanceToItself(polygon);
    double shortest = 9;
    for (std::size_t k = 0; k < polygon.size(); ++k)
      shortest = std::min(shortest, (polygon[k] - polygon[(k + 1) % polygon.size()]).norm());
    if (shortest < distance) continue;
    if (keepsApart(polygon, distance)) {
      ++apart;
      EXPECT_GE(real, distance * (1 - 1e-4)) << "polygon " << i;
    } else {
      near += real < distance;
    }
  }
  EXPECT_GT(apart, 3000);
  EXPECT_GT(near, 1000);
}

/// A slot as wide as `width` between two walls, many corners long: no star, but apart.
Polygon comb(double width) {
  Polygon polygon;
  for (int tooth = 0; tooth < 6; ++tooth) {
    const double x = tooth * (1 + width);
    polygon.insert(polygon.end(), {{x, 0}, {x, 5}, {x + 1, 5}, {x + 1, 0}});
  }
  polygon.emplace_back(6 + 5 * width, -1);
  polygon.emplace_back(0, -1);
  return polygon;
}

TEST(PlaneContour, IsFoundWhereItIsNoStar) {
  EXPECT_TRUE(keepsApart(comb(0.1), 0.09));
  EXPECT_FALSE(keepsApart(comb(0.1), 0.11));
  EXPECT_FALSE(keepsApart(comb(-0.1), 0.01)) << "teeth overlap";
}

TEST(PlaneContour, IsFoundWhereItIsAStar) {
  for (int corners = 3; corners < 30; ++corners) {
    Polygon polygon;
    for (int i = 0; i < corners; ++i)
      polygon.emplace_back(std::cos(2 * M_PI * i / corners), std::sin(2 * M_PI * i / corners));
    EXPECT_TRUE(keepsApart(polygon, 0.01)) << corners;
  }
}

TEST(PlaneContour, GoesAroundOnlyOnce) {
  Polygon twice;
  for (int i = 0; i < 25; ++i)
    twice.emplace_back(std::cos(4 * M_PI * i / 25), std::sin(4 * M_PI * i / 25));
  EXPECT_FALSE(keepsApart(twice, 0.001));
}

}  // namespace plane_contour_test
}  // namespace adaptive_bvh_test
