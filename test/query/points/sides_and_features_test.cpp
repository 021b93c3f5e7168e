// Signed distances, features, winding numbers and open edges, judged by every triangle in long
// double.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/point_query.h"
#include "support/closed_bodies.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {
namespace sides_and_features_test {

using adaptive_bvh::ClosestFeature;
using adaptive_bvh::ClosestPoint;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::OpenEdge;
using adaptive_bvh::SurfaceFeature;
using exact::Real;

class SurfaceQuery : public testing::Test {
 protected:
  using Model = DeformableMesh;

  static exact::Triangle triangle(const Model& model, int t) {
    const fcl::Triangle& v = model.triangles()[std::size_t(t)];
    return {exact::of(model.vertices()[v[0]]), exact::of(model.vertices()[v[1]]),
            exact::of(model.vertices()[v[2]])};
  }
  static Real distance(const Model& model, const exact::Point& x) {
    Real least = std::numeric_limits<Real>::infinity();
    for (int t = 0; t < numTriangles(model); ++t)
      least = std::min(least, exact::distance(triangle(model, t), x));
    return least;
  }
  static Real sizeOf(const Model& model) {
    Real size = 0;
    for (const auto& p : model.vertices())
      size = std::max<Real>(size, exact::of(p).cwiseAbs().maxCoeff());
    return size;
  }
  /// Around a body, on and near its surface and its lattice.
  std::vector<fcl::Vector3d> pointsAround(const Model& model, double scale, int count) {
    std::vector<fcl::Vector3d> points;
    for (int i = 0; i < count; ++i) {
      fcl::Vector3d p = scale * random_.size(-2, 0.5) * random_.direction();
      if (random_.oneIn(3)) {
        const auto& corners = model.triangles()[std::size_t(random_.below(numTriangles(model)))];
        p = model.vertices()[corners[random_.below(3)]] +
            fcl::Vector3d(scale * random_.size(-6, -1) * random_.direction());
      } else if (random_.oneIn(4)) {
        p = scale *
            fcl::Vector3d(double(random_.below(9) - 3), double(random_.below(9) - 3),
                          double(random_.below(9) - 3)) /
            2;
      }
      points.push_back(p);
    }
    return points;
  }

  RandomGeometry random_{47};
};

TEST_F(SurfaceQuery, SignedDistancesAreThoseOfAllTrianglesAndSolidAngles) {
  long judged = 0, inside = 0;
  for (int body = 0; body < manySteps(40); ++body) {
    const double scale = this->random_.size(-6, 6);
    TriangleMesh mesh = closedBody(this->random_);
    for (fcl::Vector3d& p : mesh.vertices) p *= scale;
    Model model(mesh);
    for (fcl::Vector3d& p : mesh.vertices) p += 0.02 * scale * this->random_.point();
    model.update(mesh.vertices);
    const auto points = this->pointsAround(model, scale, 60);
    std::vector<double> result;
    signedDistances(model, points, result);
    ASSERT_EQ(points.size(), result.size());
    const Real rounding = this->sizeOf(model) * Real(4e-14);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const exact::Point x = exact::of(points[i]);
      const Real d = this->distance(model, x);
      EXPECT_NEAR(double(d), double(std::abs(result[i])),
                  double(rounding + d * 2 * std::numeric_limits<double>::epsilon()));
      if (d <= rounding) continue;
      EXPECT_EQ(std::lround(windingNumberOf(model, x)) != 0, result[i] < 0) << double(d);
      ++judged;
      inside += result[i] < 0;
    }
  }
  EXPECT_GT(judged, 2000);
  EXPECT_GT(inside, judged / 8);
  std::printf("%ld signs judged, %ld inside\n", judged, inside);
}

TEST_F(SurfaceQuery, FeaturesHaveTheNearestPoint) {
  std::map<SurfaceFeature, int> kinds;
  for (int body = 0; body < manySteps(30); ++body) {
    TriangleMesh mesh = closedBody(this->random_);
    const Model model(mesh);
    const auto points = this->pointsAround(model, 1, 60);
    const double limit = this->random_.oneIn(2) ? std::numeric_limits<double>::infinity()
                                                : this->random_.size(-3, 0);
    std::vector<ClosestFeature> result;
    closestFeatures(model, points, limit, result);
    const Real size = this->sizeOf(model) + 4, epsilon = std::numeric_limits<double>::epsilon(),
               rounding = size * Real(4e-14);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ClosestFeature& found = result[i];
      const exact::Point x = exact::of(points[i]);
      const Real d = this->distance(model, x);
      if (std::abs(d - limit) > rounding) {
        ASSERT_EQ(d < limit, found.triangle >= 0);
      }
      if (found.triangle < 0) {
        EXPECT_EQ(std::numeric_limits<double>::infinity(), found.distance);
        continue;
      }
      EXPECT_NEAR(double(d), double(found.distance), double(rounding + 2 * epsilon * d));
      const exact::Triangle t = this->triangle(model, found.triangle);
      EXPECT_NEAR(double(d), double(exact::distance(t, x)), double(rounding));
      const exact::Point weights = exact::of(found.barycentric);
      EXPECT_NEAR(1, double(weights.sum()), double(4 * epsilon));
      EXPECT_GE(weights.minCoeff(), -4 * epsilon);
      const exact::Point point = weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2];
      EXPECT_LE((point - exact::of(found.point)).norm(), rounding + 8 * epsilon * size);
      ++kinds[found.feature];
      const fcl::Triangle& v = mesh.triangles[std::size_t(found.triangle)];
      std::set<std::size_t> with_weight;
      for (int k = 0; k < 3; ++k)
        if (weights[k] > 0) with_weight.insert(v[k]);
      if (found.feature == SurfaceFeature::Face) {
        EXPECT_EQ(unsigned(found.triangle), found.number);
      } else if (found.feature == SurfaceFeature::Vertex) {
        EXPECT_EQ((std::set<std::size_t>{found.number}), with_weight);
      } else {
        const auto ends = adaptive_bvh::edgeVertices(mesh.triangles.data(), found.number);
        EXPECT_EQ((std::set<std::size_t>{ends[0], ends[1]}), with_weight);
        for (unsigned e = 0; e < found.number; ++e) {  // the smallest number of that edge
          const auto other = adaptive_bvh::edgeVertices(mesh.triangles.data(), e);
          EXPECT_FALSE((std::set<unsigned>{other[0], other[1]}) ==
                       (std::set<unsigned>{ends[0], ends[1]}));
        }
      }
      EXPECT_NEAR(1, double(exact::of(found.normal).norm()), double(4 * epsilon));
    }
  }
  EXPECT_GT(kinds[SurfaceFeature::Face], 100);
  EXPECT_GT(kinds[SurfaceFeature::Edge], 100);
  EXPECT_GT(kinds[SurfaceFeature::Vertex], 50);
}

/// The sign of a pseudo-normal is that of the distance, whatever the feature is (Baerentzen and
/// Aanaes 2005): of a surface that does not cross itself.
TEST_F(SurfaceQuery, NormalsTellTheSign) {
  long judged = 0;
  for (int body = 0; body < manySteps(20); ++body) {
    TriangleMesh mesh = this->random_.oneIn(2) ? latticeBox(3) : gridBall(9, 7);
    for (fcl::Vector3d& p : mesh.vertices) p += 0.05 * this->random_.point();
    const Model model(mesh);
    const auto points = this->pointsAround(model, 1, 100);
    std::vector<ClosestFeature> found;
    std::vector<double> distances;
    closestFeatures(model, points, 10., found);
    signedDistances(model, points, distances);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (found[i].distance < 1e-4) continue;
      EXPECT_EQ(distances[i] < 0, (points[i] - found[i].point).dot(found[i].normal) < 0);
      ++judged;
    }
  }
  EXPECT_GT(judged, 1000);
}

/// Surfaces with a boundary, of about size 1: sheets, domes, separate triangles, closed bodies that
/// lack triangles or have some twice, turned over or without area, and strips with one side.
TriangleMesh openSurface(RandomGeometry& random) {
  TriangleMesh mesh;
  const int kind = random.below(6);
  if (kind == 0) return plate(5, 4);
  if (kind == 1) return dome(9, 4);
  if (kind == 2) return soup(60, random.engine());
  if (kind == 3) {  // a Moebius strip: each edge along it is run through in one direction twice
    const int n = 12;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * M_PI * i / n, turn = angle / 2;
      for (const double side : {-0.3, 0.3}) {
        const double radius = 1 + side * std::cos(turn);
        mesh.vertices.emplace_back(double(radius * std::cos(angle)),
                                   double(radius * std::sin(angle)), double(side * std::sin(turn)));
      }
    }
    for (std::size_t i = 0; i < std::size_t(n); ++i) {
      const bool is_last = i + 1 == std::size_t(n);
      const std::size_t a = 2 * i, b = a + 1, c = is_last ? 1 : a + 2, d = is_last ? 0 : a + 3;
      mesh.triangles.emplace_back(a, b, c);
      mesh.triangles.emplace_back(b, d, c);
    }
    return mesh;
  }
  mesh = kind == 4 ? latticeBox(2) : closedBody(random);
  for (int i = 1 + random.below(9); i > 0; --i) {
    const auto at = std::size_t(random.below(int(mesh.triangles.size())));
    fcl::Triangle t = mesh.triangles[at];
    switch (random.below(5)) {
      case 0: mesh.triangles.push_back(t); break;
      case 1: mesh.triangles[at].set(t[1], t[0], t[2]); break;
      case 2: mesh.triangles[at].set(t[0], t[1], t[random.below(2)]); break;
      default: mesh.triangles.erase(mesh.triangles.begin() + std::ptrdiff_t(at));
    }
  }
  return mesh;
}

/// The sum of all solid angles, in quadruple precision where long double has less. `number` is what
/// is judged: it chooses the whole number, as there is no library's arc tangent of such numbers.
template <typename Model>
exact::Real windingNumberNear(double number, const Model& model, const exact::Point& x) {
  // The product of exp(i angle / 2) of all triangles, and a last factor, exp(-2 pi i number).
  quad::Real re = 1, im = 0;
  for (const fcl::Triangle& t : model.triangles()) {
    quad::Point p[3];
    quad::Real n[3];
    for (int k = 0; k < 3; ++k) {
      const auto& v = model.vertices()[t[k]];
      p[k] = {quad::Real(v[0]) - quad::Real(x[0]), quad::Real(v[1]) - quad::Real(x[1]),
              quad::Real(v[2]) - quad::Real(x[2])};
    }
    const quad::Real most = std::max({quad::size(p[0]), quad::size(p[1]), quad::size(p[2])});
    for (int k = 0; k < 3; ++k) {
      p[k] = (1 / most) * p[k];
      n[k] = quad::root(quad::dot(p[k], p[k]));
    }
    const quad::Real y = quad::dot(p[0], quad::cross(p[1], p[2])),
                     z = n[0] * n[1] * n[2] + quad::dot(p[0], p[1]) * n[2] +
                         quad::dot(p[1], p[2]) * n[0] + quad::dot(p[2], p[0]) * n[1];
    const quad::Real size = quad::root(y * y + z * z);
    if (!(size > 0)) continue;
    const quad::Real next = (re * z - im * y) / size;
    im = (re * y + im * z) / size;
    re = next;
  }
  const exact::Real turn = 2 * std::acos(exact::Real(-1));
  const exact::Real rest = std::atan2(exact::Real(im), exact::Real(re)) / turn;
  return rest + std::round(number - rest);
}

/// Near to and far from the boundary, of all kinds of open surfaces and at all sizes. The sum in
/// long double says which whole number it is.
TEST_F(SurfaceQuery, WindingNumbersOfOpenMeshesAreSumsOfSolidAngles) {
  long judged = 0, open = 0, near = 0;
  Real worst = 0;
  for (int body = 0; body < manySteps(80); ++body) {
    const int exponent = (this->random_.below(7) - 5) * (30);
    const double scale = std::pow(10., double(exponent));
    TriangleMesh mesh = openSurface(this->random_);
    const TriangleMesh before = mesh;
    for (fcl::Vector3d& p : mesh.vertices) p *= scale;
    const Model model(mesh), unscaled(before);
    open += !isWatertight(model);
    auto points = this->pointsAround(unscaled, 1, 25);
    std::vector<OpenEdge> edges;
    isWatertight(model, &edges);
    for (int i = 0; i < 25 && !edges.empty(); ++i) {
      const OpenEdge& edge = edges[std::size_t(this->random_.below(int(edges.size())))];
      const double t = this->random_.oneIn(4) ? 0. : this->random_.size(-4, 0);
      points.push_back((1 - t) * before.vertices[edge.from] + t * before.vertices[edge.to] +
                       this->random_.size(-15, -1) * this->random_.direction());
    }
    for (fcl::Vector3d& p : points) p *= scale;
    std::vector<double> result;
    std::vector<ClosestPoint> closest;
    windingNumbers(model, points, result);
    closestPoints(model, points, closest);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (closest[i].distance <= 1e-15 * scale) continue;  // on it there is no number
      const exact::Point x = exact::of(points[i]);
      const bool is_near = closest[i].distance < 1e-6 * scale;
      const Real rounding =
          1e-12L + 4 * std::numeric_limits<double>::epsilon() * std::abs(result[i]);
      const Real number = windingNumberNear(double(result[i]), model, x);
      EXPECT_LE(std::abs(number - result[i]), rounding) << closest[i].distance / scale;
      if (!is_near) {
        EXPECT_NEAR(double(windingNumberOf(model, x)), double(result[i]), 1e-5);
      }
      if (std::is_same<double, double>::value)
        worst = std::max(worst, std::abs(number - result[i]));
      ++judged;
      near += is_near;
    }
  }
  EXPECT_GT(judged, 3000);
  EXPECT_GT(open, manySteps(60));
  EXPECT_GT(near, 600);
  std::printf("%ld numbers, %ld within 1e-6 of the surface, worst error %.1e\n", judged, near,
              double(worst));
}

/// 100,000 boundary edges: what is rounded does not add up to more.
TEST_F(SurfaceQuery, WindingNumbersOfManySeparateTriangles) {
  const Model model(soup(34000, this->random_.engine()));
  const auto points = this->pointsAround(model, 1, 6);
  std::vector<double> result;
  windingNumbers(model, points, result);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Real number = windingNumberNear(double(result[i]), model, exact::of(points[i]));
    EXPECT_LE(std::abs(number - result[i]),
              1e-12L + std::numeric_limits<double>::epsilon() * std::abs(result[i]));
    EXPECT_NEAR(double(windingNumberOf(model, exact::of(points[i]))), double(result[i]), 1e-5);
  }
}

/// Far away nothing of the mesh is seen, and on a vertex the answer is finite.
TEST_F(SurfaceQuery, WindingNumbersFarAwayAndOnTheBoundary) {
  const TriangleMesh mesh = plate(4, 4);
  const Model model(mesh);
  std::vector<fcl::Vector3d> points = mesh.vertices;
  points.push_back(fcl::Vector3d::Constant(1e15));
  std::vector<double> numbers;
  windingNumbers(model, points, numbers);
  for (const double number : numbers) EXPECT_LE(std::abs(number), 1.);
  EXPECT_EQ(0, numbers.back());
}

/// Of a closed surface they are whole. On it, on edges and corners, too,
/// one of both sides is said, and points there have no depth.
TEST_F(SurfaceQuery, WindingNumbersOfClosedMeshesAreWhole) {
  long judged = 0, on_surface = 0;
  for (int body = 0; body < manySteps(20); ++body) {
    const int n = 1 + this->random_.below(4), shift = this->random_.below(3);
    TriangleMesh mesh = latticeBox(n);  // and a second one, which may overlap, or face inward
    const bool turns = this->random_.oneIn(2);
    addSurface(latticeBox(2), fcl::Vector3d(double(shift), 0, 0), turns, mesh);
    const Model model(mesh);
    std::vector<fcl::Vector3d> points;
    for (int i = 0; i < 200; ++i) {
      fcl::Vector3d p;
      for (double& c : p) c = double(this->random_.below(4 * n + 8) - 4) / 4;
      points.push_back(p);
    }
    std::vector<double> numbers, distances;
    windingNumbers(model, points, numbers);
    signedDistances(model, points, distances);
    const auto inBox = [](const fcl::Vector3d& p, double from,
                          double size) -> int {  // 2: on its surface
      const double low = std::min({p[0] - from, p[1], p[2]}),
                   high = std::max({p[0] - from, p[1], p[2]}) - size;
      return low < 0 || high > 0 ? 0 : low > 0 && high < 0 ? 1 : 2;
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int first = inBox(points[i], 0, double(n)), second = inBox(points[i], double(shift), 2);
      EXPECT_EQ(std::round(numbers[i]), numbers[i]);
      if (first == 2 || second == 2) {
        EXPECT_EQ(0, distances[i]);
        EXPECT_LE(std::abs(numbers[i]), 2);
        ++on_surface;
        continue;
      }
      EXPECT_EQ(double(turns ? first - second : first + second), numbers[i])
          << points[i].transpose();
      EXPECT_EQ(numbers[i] != 0, distances[i] < 0);
      ++judged;
    }
  }
  EXPECT_GT(judged, 1000);
  EXPECT_GT(on_surface, 200);
  std::printf("%ld numbers, %ld points on the surface\n", judged, on_surface);
}

/// The corners of a surface lie in the very directions that are tried first.
TEST_F(SurfaceQuery, ARayThroughACornerIsTriedAgain) {
  TriangleMesh mesh = gridBall(5, 4);
  const double first[3] = {0.6214831, 0.5463127, 0.5614279};
  std::size_t corner = 2;
  for (int octant = 0; octant < 8; ++octant) {
    fcl::Vector3d p;
    for (int k = 0; k < 3; ++k) p[k] = double((octant >> k & 1 ? -1 : 1) * first[k]);
    mesh.vertices[corner] = p;
    corner += 2;
  }
  const Model model(mesh);
  std::vector<double> numbers, distances;
  const std::vector<fcl::Vector3d> points = {{0, 0, 0}, {0, 0, 1e-30}};
  windingNumbers(model, points, numbers);
  signedDistances(model, points, distances);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(double(std::lround(windingNumberOf(model, exact::of(points[i])))), numbers[i]);
    EXPECT_EQ(numbers[i] != 0, distances[i] < 0);
  }
}

/// A ray along an axis lies in the planes y = z and y = -z of triangles on a lattice, and meets
/// their edges but not the triangles. Tenths are rounded: rays pass edges within that.
TEST_F(SurfaceQuery, ARayInThePlaneOfATriangleIsTriedAgain) {
  long judged = 0;
  for (int body = 0; body < manySteps(300); ++body) {
    const double unit = this->random_.oneIn(2) ? 1. : 0.1, sign = this->random_.oneIn(2) ? 1 : -1;
    const int axis = this->random_.below(3);
    const auto point = [&](int range) -> fcl::Vector3d {
      fcl::Vector3d p;
      for (double& x : p) x = unit * double(this->random_.below(range) - range / 2);
      if (!this->random_.oneIn(4)) p[(axis + 2) % 3] = sign * p[(axis + 1) % 3];
      return p;
    };
    TriangleMesh mesh;
    for (std::size_t i = 0; i < 9; i += 3) {
      for (int k = 0; k < 3; ++k) mesh.vertices.push_back(point(7));
      mesh.triangles.emplace_back(i, i + 1, i + 2);
    }
    const Model model(mesh);
    std::vector<fcl::Vector3d> points;
    for (int i = 0; i < 20; ++i) points.push_back(point(9));
    std::vector<double> numbers;
    windingNumbers(model, points, numbers);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const exact::Point x = exact::of(points[i]);
      if (this->distance(model, x) < 1e-3 * unit) continue;
      EXPECT_NEAR(double(windingNumberOf(model, x)), double(numbers[i]), 1e-6);
      ++judged;
    }
  }
  EXPECT_GT(judged, 3000);
}

/// What the comparison with other libraries has found: 1 too much.
TEST_F(SurfaceQuery, WindingNumbersOfTwoTrianglesOnALattice) {
  TriangleMesh mesh;
  mesh.vertices = {{-3, 2, -3}, {-2, -3, -2}, {-1, -3, 3}, {2, 2, 2}, {2, -1, -1}, {0, 3, 3}};
  mesh.triangles = {fcl::Triangle(0, 1, 2), fcl::Triangle(3, 4, 5)};
  std::vector<double> numbers;
  windingNumbers(Model(mesh), {fcl::Vector3d(1, 0, 0)}, numbers);
  EXPECT_NEAR(0.0611661235, double(numbers[0]), 1e-7);
}

TEST_F(SurfaceQuery, OpenEdgesAreThoseOfAMap) {
  for (int body = 0; body < 60; ++body) {
    TriangleMesh mesh = closedBody(this->random_);
    const int kind = body % 4;
    for (int i = 0; i < kind; ++i) {  // holes, triangles turned over, and repeated corners
      fcl::Triangle& t =
          mesh.triangles[std::size_t(this->random_.below(int(mesh.triangles.size())))];
      if (this->random_.oneIn(3))
        t.set(t[0], t[1], t[this->random_.below(2)]);
      else if (this->random_.oneIn(2))
        t.set(t[1], t[0], t[2]);
      else
        mesh.triangles.erase(mesh.triangles.begin() + (&t - mesh.triangles.data()));
    }
    std::map<std::pair<std::size_t, std::size_t>, int> uses;
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const std::size_t a = t[k], b = t[(k + 1) % 3];
        if (a < b) ++uses[{a, b}];
        if (a > b) --uses[{b, a}];
      }
    std::map<std::pair<std::size_t, std::size_t>, int> expected, found;
    for (const auto& [edge, use] : uses)
      if (use != 0)
        expected[use > 0 ? edge : std::make_pair(edge.second, edge.first)] = std::abs(use);
    const Model model(mesh);
    std::vector<OpenEdge> edges = {{0, 0, 0, 0}};
    EXPECT_EQ(expected.empty(), isWatertight(model, &edges));
    EXPECT_EQ(expected.empty(), isWatertight(model));
    EXPECT_EQ(expected.size(), edges.size()) << "each once";
    for (const OpenEdge& edge : edges) {
      found[{edge.from, edge.to}] = edge.surplus;
      std::set<std::size_t> corners;
      for (int k = 0; k < 3; ++k) corners.insert(mesh.triangles[edge.triangle][k]);
      EXPECT_TRUE(corners.count(edge.from) && corners.count(edge.to));
    }
    EXPECT_EQ(expected, found);
  }
}

/// Many triangles at one edge: the time grows with their number, not with its square, which would
/// be 64 times as long here.
TEST_F(SurfaceQuery, OpenEdgesOfManyTrianglesAtOneEdgeTakeLinearTime) {
  const auto leastTime = [](unsigned count) {
    TriangleMesh book;
    book.vertices = {{0, 0, 0}, {0, 0, 1}};
    for (unsigned i = 0; i < count; ++i) {
      const double angle = 6. * double(i) / double(count);
      book.vertices.emplace_back(std::cos(angle), std::sin(angle), 0.5);
      book.triangles.emplace_back(0, 1, i + 2);
    }
    const Model model(book);
    auto least = std::chrono::steady_clock::duration::max();
    for (int round = 0; round < 5; ++round) {
      std::vector<OpenEdge> edges;
      const auto start = std::chrono::steady_clock::now();
      EXPECT_FALSE(isWatertight(model, &edges));
      least = std::min(least, std::chrono::steady_clock::now() - start);
      EXPECT_EQ(edges.size(), 2 * count + 1);
    }
    return least;
  };
  EXPECT_LT(leastTime(8000), 30 * leastTime(1000));
}

/// Sixteenths of edges between whole numbers are exact, and so is the point's place there.
TEST_F(SurfaceQuery, PointsOnEdgesAreOnEdges) {
  RandomGeometry random(6);
  const auto whole = [&] {
    return fcl::Vector3d(double(random.below(99)), double(random.below(99)),
                         double(random.below(99)));
  };
  std::vector<ClosestFeature> found;
  for (int step = 0; step < manySteps(2000); ++step) {
    TriangleMesh mesh;
    for (int i = 0; i < 3; ++i) mesh.vertices.push_back(16 * whole());
    mesh.triangles = {{0, 1, 2}};
    const fcl::Vector3d &a = mesh.vertices[0], &b = mesh.vertices[1], &c = mesh.vertices[2];
    if ((b - a).cross(c - a).isZero()) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const fcl::Vector3d from = mesh.vertices[k], to = mesh.vertices[(k + 1) % 3];
      const std::vector<fcl::Vector3d> point = {from +
                                                double(1 + random.below(15)) * ((to - from) / 16.)};
      closestFeatures(Model(mesh), point, 1., found);
      ASSERT_EQ(SurfaceFeature::Edge, found[0].feature) << step;
      EXPECT_EQ(k, found[0].number);
      EXPECT_EQ(0, found[0].barycentric[int((k + 2) % 3)]);
      EXPECT_NEAR(1, double(found[0].barycentric.sum()), 1e-15);
    }
  }
}

TEST_F(SurfaceQuery, RefusesWhatItCannotAnswer) {
  const Model open(plate(2, 2)), closed(latticeBox(1));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<fcl::Vector3d> fine = {{0, 0, 0}}, bad = {{0, 0, 0}, {0, nan, 0}};
  std::vector<double> numbers = {7};
  std::vector<ClosestFeature> features;
  EXPECT_THROW(signedDistances(open, fine, numbers), std::invalid_argument);
  EXPECT_THROW(signedDistances(closed, bad, numbers), std::invalid_argument);
  EXPECT_THROW(windingNumbers(closed, bad, numbers), std::invalid_argument);
  EXPECT_THROW(closestFeatures(closed, bad, 1., features), std::invalid_argument);
  for (const double negative : {-1., nan}) {
    EXPECT_THROW(closestFeatures(closed, fine, negative, features), std::invalid_argument);
  }
  EXPECT_EQ(std::vector<double>{7}, numbers);
  EXPECT_TRUE(features.empty());
}

}  // namespace sides_and_features_test
}  // namespace adaptive_bvh_test
