// Self-collision of triangles that share a corner or an edge, on whole numbers, against fractions:
// the common points of two triangles, by the line in both planes or by clipping in one plane.
#include <gtest/gtest.h>

#include <numeric>

#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/self_collision.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace neighbour_collision_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::NeighbourFilter;
__extension__ typedef __int128 Whole;

/// A fraction. The numbers of this test are so small that products of two fit.
struct Fraction {
  Fraction(Whole n = 0, Whole d = 1) : n_(n), d_(d) {
    if (d_ < 0) n_ = -n_, d_ = -d_;
    const Whole common = gcd(n_ < 0 ? -n_ : n_, d_);
    n_ /= common, d_ /= common;
  }
  friend Fraction operator+(Fraction a, Fraction b) {
    return {a.n_ * b.d_ + b.n_ * a.d_, a.d_ * b.d_};
  }
  friend Fraction operator-(Fraction a, Fraction b) {
    return {a.n_ * b.d_ - b.n_ * a.d_, a.d_ * b.d_};
  }
  friend Fraction operator*(Fraction a, Fraction b) { return {a.n_ * b.n_, a.d_ * b.d_}; }
  friend Fraction operator/(Fraction a, Fraction b) { return {a.n_ * b.d_, a.d_ * b.n_}; }
  friend bool operator<(Fraction a, Fraction b) { return a.n_ * b.d_ < b.n_ * a.d_; }
  friend bool operator==(Fraction a, Fraction b) { return a.n_ == b.n_ && a.d_ == b.d_; }

 private:
  static Whole gcd(Whole a, Whole b) { return b == 0 ? (a == 0 ? 1 : a) : gcd(b, a % b); }
  Whole n_, d_;
};

using P = std::array<Fraction, 3>;
P operator-(const P& a, const P& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
P cross(const P& a, const P& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Fraction dot(const P& a, const P& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
bool isZero(const P& a) { return a[0] == Fraction() && a[1] == Fraction() && a[2] == Fraction(); }
P between(const P& a, const P& b, Fraction share) {
  const P d = b - a;
  return {a[0] + share * d[0], a[1] + share * d[1], a[2] + share * d[2]};
}
using T = std::array<P, 3>;

/// What of a polygon is on that side of a plane n x >= t.
std::vector<P> clipped(const std::vector<P>& polygon, const P& n, Fraction t) {
  std::vector<P> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const P &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Fraction at_a = dot(n, a) - t, at_b = dot(n, b) - t;
    if (!(at_a < Fraction())) kept.push_back(a);
    if ((at_a < Fraction() && Fraction() < at_b) || (at_b < Fraction() && Fraction() < at_a))
      kept.push_back(between(a, b, at_a / (at_a - at_b)));
  }
  return kept;
}

/// Corners of the common points of two triangles with area: of a polygon, a segment or a point.
std::vector<P> commonPoints(const T& a, const T& b) {
  const P n = cross(a[1] - a[0], a[2] - a[0]);
  std::vector<P> points(b.begin(), b.end());
  points = clipped(points, n, dot(n, a[0]));
  const P m = {Fraction() - n[0], Fraction() - n[1], Fraction() - n[2]};
  points = clipped(points, m, dot(m, a[0]));  // what of b lies in a's plane
  for (std::size_t k = 0; k < 3; ++k) {
    const P inward = cross(n, a[(k + 1) % 3] - a[k]);
    points = clipped(points, inward, dot(inward, a[k]));
  }
  return points;
}

/// Whether x is on the segment from u to v.
bool isOn(const P& x, const P& u, const P& v) {
  if (!isZero(cross(x - u, v - u))) return false;
  return !(Fraction() < dot(x - u, x - v));
}

class NeighbourCollision : public testing::Test {
 protected:
  fcl::Vector3d point() {
    return {double(random_.below(5) - 2), double(random_.below(5) - 2),
            double(random_.below(3) - 1)};
  }
  static P exact(const fcl::Vector3d& x) {
    return {Fraction(Whole(x[0])), Fraction(Whole(x[1])), Fraction(Whole(x[2]))};
  }
  /// Two triangles that share so many corners, in any order.
  TriangleMesh pair(int shared) {
    TriangleMesh mesh;
    for (int i = 0; i < 6 - shared; ++i) mesh.vertices.push_back(point());
    std::size_t first[3] = {0, 1, 2}, second[3];
    for (std::size_t k = 0; k < 3; ++k)
      second[k] = k < std::size_t(shared) ? k : 3 + k - std::size_t(shared);
    const auto turn = [&](std::size_t(&t)[3]) {
      const int by = random_.below(3);
      if (random_.oneIn(2)) std::swap(t[0], t[1]);
      mesh.triangles.emplace_back(t[by], t[(by + 1) % 3], t[(by + 2) % 3]);
    };
    turn(first);
    turn(second);
    return mesh;
  }
  static T triangle(const TriangleMesh& mesh, std::size_t t) {
    const fcl::Triangle& v = mesh.triangles[t];
    return {exact(mesh.vertices[v[0]]), exact(mesh.vertices[v[1]]), exact(mesh.vertices[v[2]])};
  }
  /// `shared`: the vertices before this number.
  static bool meetBeyond(const TriangleMesh& mesh, int shared) {
    const T a = triangle(mesh, 0), b = triangle(mesh, 1);
    const auto hasArea = [](const T& t) { return !isZero(cross(t[1] - t[0], t[2] - t[0])); };
    if (!hasArea(a) || !hasArea(b)) return false;
    const P u = exact(mesh.vertices[0]), v = exact(mesh.vertices[shared == 2 ? 1 : 0]);
    for (const P& x : commonPoints(a, b))
      if (!isOn(x, u, v)) return true;
    return false;
  }
  static bool isFound(const TriangleMesh& mesh, NeighbourFilter filter) {
    fcl::CollisionResultd result;
    adaptive_bvh::selfCollide(DeformableMesh(mesh), {filter}, fcl::CollisionRequestd(10, true),
                              result);
    return result.isCollision();
  }

  RandomGeometry random_{113};
};

TEST_F(NeighbourCollision, IsWhatFractionsSay) {
  int met = 0, apart = 0;
  const int rounds = manySteps(10000);
  for (int i = 0; i < rounds && !testing::Test::HasFailure(); ++i) {
    const int shared = 1 + i % 2;
    const auto mesh = this->pair(shared);
    const bool expected = this->meetBeyond(mesh, shared);
    EXPECT_EQ(expected, this->isFound(mesh, NeighbourFilter::BeyondShared)) << i;
    EXPECT_FALSE(this->isFound(mesh, NeighbourFilter::SharedVertex));
    (expected ? met : apart)++;
  }
  EXPECT_GT(met, rounds / 20);
  EXPECT_GT(apart, rounds / 20);
}

/// The same triangle twice, and one with a corner twice.
TEST_F(NeighbourCollision, OfTheSameAndOfDegenerateTriangles) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {fcl::Triangle(0, 1, 2), fcl::Triangle(2, 1, 0)};
  EXPECT_TRUE(this->isFound(mesh, NeighbourFilter::BeyondShared));
  mesh.triangles[1] = fcl::Triangle(0, 1, 1);
  EXPECT_FALSE(this->isFound(mesh, NeighbourFilter::BeyondShared));
  const DeformableMesh built(mesh);
  adaptive_bvh::ProximityRequest request;
  request.ignored.neighbours = NeighbourFilter::BeyondShared;
  adaptive_bvh::TrianglePairs pairs;
  EXPECT_THROW(adaptive_bvh::selfPairsWithin(built, request, pairs), std::invalid_argument);
}

/// A flat sheet has no such pairs; folded over along a diagonal it has those at the fold.
TEST_F(NeighbourCollision, OfASheetThatIsFoldedOver) {
  TriangleMesh sheet = plate(6, 6);
  EXPECT_FALSE(this->isFound(sheet, NeighbourFilter::BeyondShared));
  std::vector<double> columns;
  for (const fcl::Vector3d& x : sheet.vertices) columns.push_back(x[0]);
  std::sort(columns.begin(), columns.end());
  const double middle = columns[columns.size() / 2];
  for (fcl::Vector3d& x : sheet.vertices)
    if (x[0] > middle) x[0] = 2 * middle - x[0];
  EXPECT_TRUE(this->isFound(sheet, NeighbourFilter::BeyondShared));
}

}  // namespace neighbour_collision_test
}  // namespace adaptive_bvh_test
