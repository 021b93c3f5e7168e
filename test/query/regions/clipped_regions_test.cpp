// Regions of contact, judged by convex polyhedra that are clipped in long double, and by bodies of
// whole cubes, whose overlap is counted cell by cell.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "adaptive_bvh/contact_regions.h"
#include "support/long_mode.h"

namespace adaptive_bvh_test {
namespace clipped_regions_test {

using adaptive_bvh::ContactRegions;
using Mesh = adaptive_bvh::DeformableMesh;
using Real = long double;
using Point = Eigen::Matrix<Real, 3, 1>;
using Vertices = std::vector<fcl::Vector3d>;
using Triangles = std::vector<fcl::Triangle>;
using Polygon = std::vector<Point>;

/// One side of a region.
struct Side {
  Real area = 0;
  Point moment = Point::Zero();
};

// Tetrahedra.

struct Plane {
  Point normal, at;
};

Plane planeOf(const std::array<Point, 3>& t) { return {(t[1] - t[0]).cross(t[2] - t[0]), t[0]}; }

struct Tetrahedron {
  Vertices vertices;

  static Triangles triangles() { return {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}; }
  std::array<Point, 3> face(std::size_t i) const {
    const fcl::Triangle t = triangles()[i];
    return {vertices[t[0]].cast<Real>(), vertices[t[1]].cast<Real>(), vertices[t[2]].cast<Real>()};
  }
  bool isUpright() const {
    const Plane p = planeOf(face(0));
    return p.normal.dot(vertices[3].cast<Real>() - p.at) < 0;
  }
  bool isFlat() const {
    const Plane p = planeOf(face(0));
    return p.normal.dot(vertices[3].cast<Real>() - p.at) == 0;
  }
};

/// The sign of a motion of the first body along x, then y, then z, across a plane.
int shiftAcross(const Point& normal) {
  for (int k = 0; k < 3; ++k)
    if (normal[k] != 0) return normal[k] > 0 ? 1 : -1;
  return 0;
}

/// The part of a polygon behind a plane.
Polygon clipped(const Polygon& polygon, const Plane& plane) {
  std::vector<Real> heights;
  for (const Point& p : polygon) heights.push_back(plane.normal.dot(p - plane.at));
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = (i + 1) % polygon.size();
    if (heights[i] <= 0) kept.push_back(polygon[i]);
    if ((heights[i] < 0 && heights[next] > 0) || (heights[i] > 0 && heights[next] < 0))
      kept.push_back(polygon[i] +
                     heights[i] / (heights[i] - heights[next]) * (polygon[next] - polygon[i]));
  }
  return kept;
}

/// Without rounding, for whole coordinates.
bool isInPlane(const std::array<Point, 3>& face, const Plane& plane) {
  return std::all_of(face.begin(), face.end(),
                     [&](const Point& p) { return plane.normal.dot(p - plane.at) == 0; });
}

/// The faces of one body inside the other; six times the volume below them is added.
Side sideOf(const Tetrahedron& own, const Tetrahedron& other, bool is_first, Real& volume6) {
  Side side;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::array<Point, 3> face = own.face(i);
    Polygon polygon(face.begin(), face.end());
    for (std::size_t j = 0; j < 4 && !polygon.empty(); ++j) {
      const Plane plane = planeOf(other.face(j));
      const int shift = shiftAcross(plane.normal);
      if (!isInPlane(face, plane))
        polygon = clipped(polygon, plane);
      else if ((is_first ? shift : -shift) > 0)
        polygon.clear();
    }
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      const Real area = (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]).norm() / 2;
      side.area += area;
      side.moment += area / 3 * (polygon[0] + polygon[k - 1] + polygon[k]);
      volume6 += polygon[0].dot(polygon[k - 1].cross(polygon[k]));
    }
  }
  return side;
}

/// The curves are closed, and each of their points lies on both of its triangles.
void expectCurves(const ContactRegions& result, const Mesh& first, const Mesh& second,
                  double tolerance) {
  ASSERT_EQ(result.curve_begins.size(), result.numCurves() + 1);
  for (std::size_t c = 0; c < result.numCurves(); ++c) {
    const std::size_t begin = result.curve_begins[c], end = result.curve_begins[c + 1];
    ASSERT_LT(begin, end);
    for (std::size_t i = begin; i < end; ++i)
      for (const auto& at : {std::make_pair(&first, result.curve_first[i]),
                             std::make_pair(&second, result.curve_second[i])}) {
        const fcl::Triangle& t = at.first->triangles()[at.second];
        const auto& v = at.first->vertices();
        const Point corner = v[t[0]].cast<Real>();
        const Plane plane = planeOf({corner, v[t[1]].cast<Real>(), v[t[2]].cast<Real>()});
        const Point normal = plane.normal / plane.normal.norm();
        const std::size_t next = i + 1 < end ? i + 1 : begin;
        for (const std::size_t k : {i, next}) {
          const Point x = result.curve_points[k].cast<Real>();
          EXPECT_LT(std::fabs(normal.dot(x - corner)), tolerance);
        }
      }
  }
}

/// How far inside of a tetrahedron a point is.
Real depthIn(const Tetrahedron& t, const Point& x) {
  Real depth = 1e9;
  for (std::size_t i = 0; i < 4; ++i) {
    const Plane p = planeOf(t.face(i));
    depth = std::min(depth, p.normal.dot(p.at - x) / p.normal.norm());
  }
  return depth;
}

/// The deepest point is on one surface, and so far inside the other body; no vertex is deeper.
void expectDepth(const Tetrahedron& a, const Tetrahedron& b, double tolerance,
                 const ContactRegions& result) {
  const Point x = result.deepest_points[0].cast<Real>();
  const Real in_a = depthIn(a, x), in_b = depthIn(b, x), depth = result.depths[0];
  EXPECT_LT(std::fabs(std::min(in_a, in_b)), tolerance);
  EXPECT_LT(std::fabs(std::max(in_a, in_b) - depth), tolerance);
  for (const auto& v : a.vertices) EXPECT_LE(depthIn(b, v.cast<Real>()), depth + tolerance);
  for (const auto& v : b.vertices) EXPECT_LE(depthIn(a, v.cast<Real>()), depth + tolerance);
}

void expectTetrahedra(const Tetrahedron& a, const Tetrahedron& b, double size,
                      ContactRegions& result) {
  const Mesh first(a.vertices, a.triangles()), second(b.vertices, b.triangles());
  const auto still = fcl::Transform3d::Identity();
  contactRegions(first, still, second, still, result);
  Real volume6 = 0;
  const Side of_first = sideOf(a, b, true, volume6), of_second = sideOf(b, a, false, volume6);
  const double tolerance = 1e-9 * size * size * size;
  ASSERT_LE(result.size(), 1u);
  if (volume6 > tolerance || of_first.area + of_second.area > tolerance) {
    ASSERT_EQ(result.size(), 1u);
  }
  if (result.size() == 0) return;
  EXPECT_NEAR(result.volumes[0], double(volume6 / 6), tolerance);
  EXPECT_NEAR(result.first.areas[0], double(of_first.area), tolerance);
  EXPECT_NEAR(result.second.areas[0], double(of_second.area), tolerance);
  const fcl::Vector3d moment1 = result.first.areas[0] * result.first.centroids[0],
                      moment2 = result.second.areas[0] * result.second.centroids[0];
  EXPECT_LT((moment1 - of_first.moment.cast<double>()).norm(), 10 * tolerance);
  EXPECT_LT((moment2 - of_second.moment.cast<double>()).norm(), 10 * tolerance);
  expectDepth(a, b, 1e-9 * size, result);
  expectCurves(result, first, second, 1e-9 * size);
}

template <typename Coordinate>
Tetrahedron tetrahedron(const Coordinate& coordinate) {
  Tetrahedron t;
  do {
    t.vertices.clear();
    for (int k = 0; k < 4; ++k) {
      const double x = coordinate(), y = coordinate(), z = coordinate();
      t.vertices.emplace_back(x, y, z);
    }
  } while (t.isFlat());
  if (!t.isUpright()) std::swap(t.vertices[1], t.vertices[2]);
  return t;
}

TEST(ContactRegionsOracle, RandomTetrahedra) {
  std::mt19937 random(testSeed(71));
  std::uniform_real_distribution<double> unit(-1, 1);
  ContactRegions result;
  for (int i = 0; i < manySteps(5000) && !HasFailure(); ++i) {
    const Tetrahedron a = tetrahedron([&] { return unit(random); }),
                      b = tetrahedron([&] { return unit(random); });
    expectTetrahedra(a, b, 1, result);
    if (HasFailure()) ADD_FAILURE() << "pair " << i;
  }
}

/// Coplanar faces, vertices on faces and edges, edges on edges, and the same body twice.
TEST(ContactRegionsOracle, LatticeTetrahedra) {
  std::mt19937 random(testSeed(72));
  ContactRegions result;
  for (int i = 0; i < manySteps(10000) && !HasFailure(); ++i) {
    const int most = 1 + int(random() % 4);
    const auto whole = [&] { return double(int(random() % unsigned(most + 1))); };
    const Tetrahedron a = tetrahedron(whole);
    Tetrahedron b = random() % 8 == 0 ? a : tetrahedron(whole);
    if (random() % 4 == 0)  // with a common face or edge
      for (std::size_t k = 0; k < 2 + random() % 2; ++k) b.vertices[k] = a.vertices[k];
    if (b.isFlat()) continue;
    if (!b.isUpright()) std::swap(b.vertices[1], b.vertices[2]);
    expectTetrahedra(a, b, most, result);
    if (HasFailure()) ADD_FAILURE() << "pair " << i;
  }
}

/// Faces and edges that are nearly in one plane: crossings are found far from where a rounded
/// determinant sees them.
TEST(ContactRegionsOracle, NearlyFlatPairs) {
  std::mt19937 random(testSeed(74));
  std::uniform_real_distribution<double> unit(-1, 1);
  ContactRegions result;
  for (int i = 0; i < manySteps(5000) && !HasFailure(); ++i) {
    const double off = std::pow(10., -3 - 2.5 * (unit(random) + 1));
    const auto near = [&] { return double(random() % 3) + off * unit(random); };
    expectTetrahedra(tetrahedron(near), tetrahedron(near), 2, result);
    if (HasFailure()) ADD_FAILURE() << "pair " << i << " off " << off;
  }
}

// Bodies of cubes.

constexpr int kSide = 4;

/// Some cubes of a lattice, and the surface around them.
struct Cubes {
  std::array<bool, kSide * kSide * kSide> is_full{};

  bool at(int x, int y, int z) const {
    const auto in = [](int i) { return i >= 0 && i < kSide; };
    return in(x) && in(y) && in(z) && is_full[std::size_t((x * kSide + y) * kSide + z)];
  }
  Mesh mesh(double shift) const {
    Vertices vertices;
    Triangles triangles;
    std::map<std::array<int, 3>, std::size_t> numbers;
    const auto vertex = [&](const std::array<int, 3>& x) {
      const auto found = numbers.emplace(x, vertices.size());
      if (found.second) vertices.emplace_back(x[0] + shift, x[1] + shift, x[2] + shift);
      return found.first->second;
    };
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z)
          for (int axis = 0; axis < 3 && at(x, y, z); ++axis)
            for (int end = 0; end < 2; ++end) {
              std::array<int, 3> next{x, y, z};
              next[std::size_t(axis)] += end ? 1 : -1;
              if (at(next[0], next[1], next[2])) continue;
              const auto corner = [&](int u, int v) {
                std::array<int, 3> c{x, y, z};
                c[std::size_t(axis)] += end;
                c[std::size_t(axis + 1) % 3] += u;
                c[std::size_t(axis + 2) % 3] += v;
                return vertex(c);
              };
              const std::size_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1),
                                d = corner(0, 1);
              triangles.emplace_back(a, end ? b : c, end ? c : b);
              triangles.emplace_back(a, end ? c : d, end ? d : c);
            }
    return Mesh(vertices, triangles);
  }
};

Cubes randomCubes(std::mt19937& random) {
  Cubes cubes;
  const unsigned percent = 30 + unsigned(random() % 65);
  for (bool& full : cubes.is_full) full = random() % 100 < percent;
  cubes.is_full[random() % cubes.is_full.size()] = true;
  return cubes;
}

struct Region {
  Real volume = 0, first = 0, second = 0;
};

/// The overlap of two bodies of cubes, of which the first is moved by `shift` along all axes, from
/// 0, as an infinitely small one, up to 1. Cells: along each axis, 2 i is from i to i + shift,
/// where the first body has its cube i - 1, and 2 i + 1 from there to i + 1.
class Overlap {
 public:
  Overlap(const Cubes& first, const Cubes& second, Real shift)
      : first_(first), second_(second), shift_(shift) {}

  bool inFirst(int x, int y, int z) const { return first_.at(lower(x), lower(y), lower(z)); }
  bool inSecond(int x, int y, int z) const { return second_.at(x >> 1, y >> 1, z >> 1); }
  bool isIn(int x, int y, int z) const { return inFirst(x, y, z) && inSecond(x, y, z); }

  /// Regions of cells that share a face, or also of cells that share an edge or a corner.
  std::vector<Region> regions(bool by_corners) const {
    std::array<bool, 8 * kSide * kSide * kSide> seen{};
    const auto isSeen = [&](const std::array<int, 3>& c) -> bool& {
      return seen[std::size_t((c[0] * 2 * kSide + c[1]) * 2 * kSide + c[2])];
    };
    std::vector<Region> all;
    forEachCell([&](int x, int y, int z) {
      if (!isIn(x, y, z) || isSeen({x, y, z})) return;
      Region region;
      std::vector<std::array<int, 3>> open{{x, y, z}};
      isSeen(open[0]) = true;
      while (!open.empty()) {
        const std::array<int, 3> cell = open.back();
        open.pop_back();
        add(cell, region);
        for (int dx = -1; dx <= 1; ++dx)
          for (int dy = -1; dy <= 1; ++dy)
            for (int dz = -1; dz <= 1; ++dz) {
              if (!by_corners && std::abs(dx) + std::abs(dy) + std::abs(dz) != 1) continue;
              const std::array<int, 3> next{cell[0] + dx, cell[1] + dy, cell[2] + dz};
              if (!isIn(next[0], next[1], next[2]) || isSeen(next)) continue;
              isSeen(next) = true;
              open.push_back(next);
            }
      }
      all.push_back(region);
    });
    return all;
  }

 private:
  static int lower(int i) { return (i - 1) >> 1; }
  Real length(int i) const { return i & 1 ? 1 - shift_ : shift_; }

  template <typename Visit>
  static void forEachCell(const Visit& visit) {
    for (int x = 0; x < 2 * kSide; ++x)
      for (int y = 0; y < 2 * kSide; ++y)
        for (int z = 0; z < 2 * kSide; ++z) visit(x, y, z);
  }
  void add(const std::array<int, 3>& cell, Region& region) const {
    const Real size[3] = {length(cell[0]), length(cell[1]), length(cell[2])};
    region.volume += size[0] * size[1] * size[2];
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        std::array<int, 3> next = cell;
        next[axis] += step;
        const Real area = size[(axis + 1) % 3] * size[(axis + 2) % 3];
        if (!inFirst(next[0], next[1], next[2])) region.first += area;
        if (!inSecond(next[0], next[1], next[2])) region.second += area;
      }
  }

  const Cubes &first_, &second_;
  const Real shift_;
};

/// Holes, cavities, islands in cavities, edges with four triangles; coplanar faces without a shift.
TEST(ContactRegionsOracle, BodiesOfCubes) {
  std::mt19937 random(testSeed(73));
  ContactRegions result;
  int compared = 0;
  for (int i = 0; i < manySteps(400) && !HasFailure(); ++i) {
    const Cubes a = randomCubes(random), b = random() % 16 == 0 ? a : randomCubes(random);
    const double shift = 0.25 * double(random() % 4);
    const Mesh first = a.mesh(shift), second = b.mesh(0);
    const auto still = fcl::Transform3d::Identity();
    contactRegions(first, still, second, still, result);
    const Overlap overlap(a, b, Real(shift));
    std::vector<Region> all = overlap.regions(false);
    Region sum, found;
    for (const Region& r : all) {
      sum.volume += r.volume;
      sum.first += r.first;
      sum.second += r.second;
    }
    for (std::size_t r = 0; r < result.size(); ++r) {
      found.volume += result.volumes[r];
      found.first += result.first.areas[r];
      found.second += result.second.areas[r];
    }
    EXPECT_NEAR(double(found.volume), double(sum.volume), 1e-10);
    EXPECT_NEAR(double(found.first), double(sum.first), 1e-10);
    EXPECT_NEAR(double(found.second), double(sum.second), 1e-10);
    expectCurves(result, first, second, 1e-12);
    if (all.size() == overlap.regions(true).size()) {
      ++compared;
      ASSERT_EQ(result.size(), all.size()) << "shift " << shift << " pair " << i;
      std::vector<std::array<double, 3>> expected, got;
      const auto rounded = [](Real x) { return double(std::round(x * 4096)) / 4096; };
      for (std::size_t r = 0; r < all.size(); ++r) {
        expected.push_back({rounded(all[r].volume), rounded(all[r].first), rounded(all[r].second)});
        got.push_back({rounded(result.volumes[r]), rounded(result.first.areas[r]),
                       rounded(result.second.areas[r])});
      }
      std::sort(expected.begin(), expected.end());
      std::sort(got.begin(), got.end());
      EXPECT_EQ(expected, got);
    }
    if (HasFailure()) ADD_FAILURE() << "pair " << i << " shift " << shift;
  }
  EXPECT_GT(compared, manySteps(400) / 10);
}

}  // namespace clipped_regions_test
}  // namespace adaptive_bvh_test
