// Contacts of vertices with closed meshes, judged by every triangle in quadruple precision, and by
// solid angles in long double.
#include <gtest/gtest.h>

#include <numeric>

#include "adaptive_bvh/penetration.h"
#include "support/closed_bodies.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {
namespace vertex_contacts_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::VertexContacts;
using exact::Real;

class VertexContact : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Contacts = VertexContacts;

  static fcl::Transform3d still() { return fcl::Transform3d::Identity(); }
  static fcl::Transform3d moved(double x, double y, double z) {
    fcl::Transform3d tf = still();
    tf.translation() = fcl::Vector3d(x, y, z);
    return tf;
  }

  RandomGeometry random_{41};
};

/// The vertices of one mesh as the other sees them, in long double.
class Judge {
 public:
  Judge(const DeformableMesh& mesh, const fcl::Transform3d& tf, const DeformableMesh& other,
        const fcl::Transform3d& other_tf)
      : mesh_(mesh),
        other_(other),
        tf_(exact::placement(tf)),
        other_tf_(exact::placement(other_tf)) {
    size_ = 1e-300L;
    for (const auto& p : other.vertices())
      size_ = std::max<Real>(size_, exact::of(p).cwiseAbs().maxCoeff());
    const Real far = (tf_.T - other_tf_.T).cwiseAbs().maxCoeff();
    for (const auto& p : mesh.vertices())
      size_ = std::max<Real>(size_, exact::of(p).cwiseAbs().maxCoeff() + far);
    is_used_.resize(mesh.vertices().size());
    for (const fcl::Triangle& t : mesh.triangles())
      for (int k = 0; k < 3; ++k) is_used_[t[k]] = true;
  }

  Real size() const { return size_; }
  bool isUsed(unsigned v) const { return is_used_[v]; }
  exact::Point seen(unsigned v) const { return inOther(tf_(exact::of(mesh_.vertices()[v]))); }
  exact::Point inOther(const exact::Point& world) const {
    return other_tf_.R.transpose() * (world - other_tf_.T);
  }
  exact::Triangle triangle(int t) const {
    const fcl::Triangle& v = other_.triangles()[std::size_t(t)];
    return {exact::of(other_.vertices()[v[0]]), exact::of(other_.vertices()[v[1]]),
            exact::of(other_.vertices()[v[2]])};
  }
  static Real distance(const exact::Triangle& t, const exact::Point& x) {
    const auto point = [](const exact::Point& p) { return quad::Point{p[0], p[1], p[2]}; };
    return Real(quad::distance(point(x), {point(t[0]), point(t[1]), point(t[2])}));
  }
  Real distance(const exact::Point& x) const {
    Real least = std::numeric_limits<Real>::infinity();
    for (int t = 0; t < numTriangles(other_); ++t)
      least = std::min(least, distance(triangle(t), x));
    return least;
  }
  bool isInside(const exact::Point& x) const {
    return std::lround(windingNumberOf(other_, x)) != 0;
  }
  Real areaOf(unsigned vertex) const {
    Real sum = 0;
    for (const fcl::Triangle& t : mesh_.triangles()) {
      if (t[0] != vertex && t[1] != vertex && t[2] != vertex) continue;
      const exact::Point a = exact::of(mesh_.vertices()[t[0]]);
      sum += (exact::of(mesh_.vertices()[t[1]]) - a)
                 .cross(exact::of(mesh_.vertices()[t[2]]) - a)
                 .norm();
    }
    return sum / 6;
  }

  /// Checks all that is returned, and that nothing is missing. Returns the number of vertices that
  /// were judged.
  long check(const VertexContacts& found, double margin) const {
    const Real rounding = size_ * Real(4e-14), epsilon = std::numeric_limits<double>::epsilon();
    EXPECT_TRUE(std::is_sorted(found.vertices.begin(), found.vertices.end()));
    long judged = 0;
    std::size_t next = 0;
    for (unsigned v = 0; v < mesh_.vertices().size(); ++v) {
      const bool is_found = next < found.size() && found.vertices[next] == v;
      const std::size_t i = is_found ? next++ : 0;
      if (!isUsed(v)) {
        EXPECT_FALSE(is_found);
        continue;
      }
      const exact::Point x = seen(v);
      const Real d = distance(x);
      const bool is_inside = d > rounding && isInside(x);
      judged += d > rounding;
      if (d > rounding && std::abs(d - margin) > rounding) {
        EXPECT_EQ(is_inside || d < margin, is_found) << double(d) << " " << is_inside;
      }
      if (is_found) checkContact(found, i, x, d, is_inside, rounding, epsilon);
    }
    EXPECT_EQ(found.size(), next) << "vertices that there are not, or twice";
    return judged;
  }

 private:
  void checkContact(const VertexContacts& found, std::size_t i, const exact::Point& x, Real d,
                    bool is_inside, Real rounding, Real epsilon) const {
    const Real signed_distance = is_inside ? -d : d;
    const Real tolerance = rounding + epsilon * d;
    if (d > rounding) {
      EXPECT_NEAR(double(signed_distance), double(found.distances[i]), double(tolerance));
    } else {
      EXPECT_LE(std::abs(found.distances[i]), 2 * tolerance);
    }
    const exact::Point position = tf_(exact::of(mesh_.vertices()[found.vertices[i]]));
    const Real world = size_ + tf_.T.norm() + other_tf_.T.norm();
    EXPECT_LE((exact::of(found.positions[i]) - position).norm(), 8 * epsilon * world);
    // The nearest point, in the world and by the corners of its triangle.
    ASSERT_GE(found.triangles[i], 0);
    const exact::Triangle t = triangle(found.triangles[i]);
    EXPECT_LE(std::abs(distance(t, x) - d), rounding);
    const exact::Point weights = exact::of(found.barycentric[i]);
    EXPECT_GE(weights.minCoeff(), -4 * epsilon);
    EXPECT_NEAR(1, double(weights.sum()), double(4 * epsilon));
    const exact::Point on_face = weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2];
    EXPECT_LE(std::abs((on_face - x).norm() - d), rounding + 16 * epsilon * size_);
    EXPECT_LE((inOther(exact::of(found.nearest_points[i])) - on_face).norm(),
              rounding + 32 * epsilon * world);
    // The normal, where the direction is certain.
    const exact::Point normal = exact::of(found.normals[i]);
    EXPECT_NEAR(1, double(normal.norm()), double(4 * epsilon));
    if (d > 1e-6L * size_) {
      const exact::Point precise = nearestOf(t, x);
      const exact::Point into = is_inside ? x - precise : precise - x;
      EXPECT_LE((other_tf_.R * into.normalized() - normal).norm(), 1e-6L + 16 * epsilon);
    }
    const Real area = areaOf(found.vertices[i]);
    EXPECT_NEAR(double(area), double(found.areas[i]), double(area * 4 * epsilon) + 1e-300);
  }
  /// The point of a triangle nearest to x.
  static exact::Point nearestOf(const exact::Triangle& t, const exact::Point& x) {
    exact::Point best = t[0];
    for (std::size_t k = 0; k < 3; ++k) {
      const exact::Point p = exact::nearestOnSegment(t[k], t[(k + 1) % 3], x);
      if ((p - x).norm() < (best - x).norm()) best = p;
    }
    const exact::Point u = t[1] - t[0], v = t[2] - t[0], n = u.cross(v), w = x - t[0];
    const Real b = w.cross(v).dot(n) / n.squaredNorm(), c = u.cross(w).dot(n) / n.squaredNorm();
    if (b >= 0 && c >= 0 && b + c <= 1) {
      const exact::Point p = t[0] + b * u + c * v;
      if ((p - x).norm() < (best - x).norm()) best = p;
    }
    return best;
  }

  const DeformableMesh &mesh_, &other_;
  const exact::Placement tf_, other_tf_;
  Real size_;
  std::vector<bool> is_used_;
};

/// Bodies of all kinds, scales and poses, overlapping, deformed.
TEST_F(VertexContact, AreThoseOfAllTriangles) {
  using Model = Model;
  auto& random = this->random_;
  long judged = 0, found = 0, inside = 0;
  for (int body = 0; body < manySteps(12); ++body) {
    const double scale = random.size(-6, 6);
    TriangleMesh mesh = random.oneIn(4) ? plate(6, 6) : closedBody(random);
    TriangleMesh other = closedBody(random);
    mesh.vertices.push_back(fcl::Vector3d::Zero());  // of no triangle
    for (TriangleMesh* m : {&mesh, &other})
      for (fcl::Vector3d& p : m->vertices) p *= scale;
    Model a(mesh), b(other);
    Contacts result;
    for (int step = 0; step < 3; ++step) {
      for (fcl::Vector3d& p : other.vertices) p += 0.03 * scale * random.point();
      b.update(other.vertices);
      auto tf = random.pose(scale), other_tf = random.pose(scale);
      const double margin = random.oneIn(3)   ? 0.
                            : random.oneIn(6) ? std::numeric_limits<double>::infinity()
                                              : scale * random.size(-3, 0);
      vertexContacts(a, tf, b, other_tf, margin, result);
      judged += Judge(a, tf, b, other_tf).check(result, margin);
      found += long(result.size());
      for (const double d : result.distances) inside += d < 0;
    }
  }
  EXPECT_GT(judged, 2000);
  EXPECT_GT(found, judged / 10);
  EXPECT_GT(inside, found / 10);
  std::printf("%ld vertices judged, %ld contacts, %ld inside\n", judged, found, inside);
}

/// Boxes on a lattice, stacked face on face, edge on edge, and so that vertices lie on vertices.
TEST_F(VertexContact, OnALatticeTouchingIsAtDistanceZero) {
  using Model = Model;
  auto& random = this->random_;
  long judged = 0;
  for (int body = 0; body < manySteps(60); ++body) {
    const int n = 1 + random.below(4);
    const Model a(latticeBox(1 + random.below(4))), b(latticeBox(n));
    const double half = random.oneIn(2) ? 0.5 : 1.;
    const auto shift = [&] { return half * double(random.below(2 * n + 3) - n); };
    const auto tf = this->moved(shift(), shift(), shift());
    const double margin = random.oneIn(2) ? 0. : 0.5 * double(random.below(3));
    Contacts result;
    vertexContacts(a, tf, b, this->still(), margin, result);
    std::size_t next = 0;
    for (unsigned v = 0; v < a.vertices().size(); ++v) {
      const fcl::Vector3d p = tf * a.vertices()[v];
      const fcl::Vector3d low = p, high = fcl::Vector3d::Constant(double(n)) - p;
      const double depth = std::min(low.minCoeff(), high.minCoeff());
      const double away = (-low).cwiseMax(-high).cwiseMax(fcl::Vector3d::Zero()).norm();
      const bool is_contact = depth > 0 || away <= margin;
      ASSERT_EQ(is_contact, next < result.size() && result.vertices[next] == v) << p.transpose();
      ++judged;
      if (!is_contact) continue;
      const double expected = depth >= 0 ? -depth : away;
      EXPECT_NEAR(expected, result.distances[next], 8. * std::numeric_limits<double>::epsilon());
      EXPECT_EQ(depth == 0, result.distances[next] == 0);
      if (depth == 0) {
        fcl::Vector3d outward = fcl::Vector3d::Zero();
        for (int k = 0; k < 3; ++k) outward[k] = p[k] == 0 ? -1. : p[k] == double(n) ? 1. : 0.;
        EXPECT_LE((result.normals[next] + outward.normalized()).norm(), 1e-6)
            << p.transpose() << ": " << result.normals[next].transpose();
      }
      ++next;
    }
    ASSERT_EQ(next, result.size());
  }
  EXPECT_GT(judged, 1000);
}

/// The pseudo-normals of a mesh in long double, by their definition.
class NormalJudge {
 public:
  explicit NormalJudge(const TriangleMesh& mesh) : mesh_(mesh) {}

  exact::Point ofFace(const fcl::Triangle& t) const {
    return (point(t[1]) - point(t[0])).cross(point(t[2]) - point(t[0])).normalized();
  }
  exact::Point ofEdge(std::size_t a, std::size_t b) const {
    exact::Point sum = exact::Point::Zero();
    for (const fcl::Triangle& t : mesh_.triangles)
      if (has(t, a) && has(t, b)) sum += ofFace(t);
    return sum.normalized();
  }
  /// Zero where the directions nearly cancel each other.
  exact::Point ofVertex(std::size_t v) const {
    exact::Point sum = exact::Point::Zero();
    for (const fcl::Triangle& t : mesh_.triangles)
      for (int k = 0; k < 3; ++k) {
        if (t[k] != v) continue;
        const exact::Point u = (point(t[(k + 1) % 3]) - point(v)).normalized(),
                           w = (point(t[(k + 2) % 3]) - point(v)).normalized();
        sum += std::acos(exact::clamp(u.dot(w), -1, 1)) * ofFace(t);
      }
    return sum.norm() > 1e-4L ? exact::Point(sum.normalized()) : exact::Point::Zero();
  }

 private:
  static bool has(const fcl::Triangle& t, std::size_t v) {
    return t[0] == v || t[1] == v || t[2] == v;
  }
  exact::Point point(std::size_t v) const { return exact::of(mesh_.vertices[v]); }

  const TriangleMesh& mesh_;
};

/// Of vertices on vertices, on the middles of edges and inside of faces. A middle that is rounded
/// may be nearest to the edge or to a face beside it.
TEST_F(VertexContact, NormalsOfTouchingVerticesAreThoseOfTheFeatures) {
  using Model = Model;
  auto& random = this->random_;
  long judged = 0;
  for (int body = 0; body < manySteps(20); ++body) {
    TriangleMesh mesh = gridBall(5 + random.below(6), 3 + random.below(5));
    for (fcl::Vector3d& p : mesh.vertices) p += 0.1 * random.point();
    const Model b(mesh);
    TriangleMesh on_surface;
    for (const fcl::Triangle& t : mesh.triangles) {
      const auto &p = mesh.vertices[t[0]], &q = mesh.vertices[t[1]], &r = mesh.vertices[t[2]];
      const std::size_t first = on_surface.vertices.size();
      on_surface.vertices.insert(on_surface.vertices.end(),
                                 {p, fcl::Vector3d((p + q) / 2), fcl::Vector3d((p + q + r) / 3)});
      on_surface.triangles.emplace_back(first, first + 1, first + 2);
    }
    const Model a(on_surface);
    Contacts result;
    vertexContacts(a, this->still(), b, this->still(), 1e-5, result);
    ASSERT_EQ(a.vertices().size(), result.size());
    const NormalJudge judge(mesh);
    for (std::size_t i = 0; i < result.size(); ++i) {
      if (std::abs(result.distances[i]) > 1e-9) continue;
      const fcl::Triangle& t = mesh.triangles[i / 3];
      const exact::Point found = -exact::of(result.normals[i]);
      const auto expectNear = [&](std::initializer_list<exact::Point> directions) {
        Real least = 2;
        for (const exact::Point& n : directions) least = std::min(least, (n - found).norm());
        EXPECT_LE(least, 1e-6L + 8 * std::numeric_limits<double>::epsilon()) << i % 3;
      };
      const exact::Point of_vertex = judge.ofVertex(t[0]);
      const fcl::Triangle& other = mesh.triangles[std::size_t(result.triangles[i])];
      if (i % 3 == 0 && !of_vertex.isZero()) expectNear({of_vertex});
      if (i % 3 == 1) expectNear({judge.ofEdge(t[0], t[1]), judge.ofFace(other)});
      if (i % 3 == 2) expectNear({judge.ofFace(t)});
      ++judged;
    }
  }
  EXPECT_GT(judged, 1000);
}

/// Of a needle-shaped pyramid's apex, the mean by angles is along the axis, whatever the number of
/// triangles on each side.
TEST_F(VertexContact, TheNormalOfAVertexIsWeightedByAngles) {
  TriangleMesh pyramid;
  pyramid.vertices = {{0, 0, 1},  {1, 1, 0},   {-1, 1, 0}, {-1, -1, 0},
                      {1, -1, 0}, {0.5, 1, 0}, {0, 1, 0},  {-0.25, 1, 0}};
  const std::size_t rim[] = {1, 5, 6, 7, 2, 3, 4};
  for (std::size_t i = 0; i < 7; ++i) pyramid.triangles.emplace_back(0, rim[i], rim[(i + 1) % 7]);
  for (std::size_t i = 1; i + 1 < 7; ++i)
    pyramid.triangles.emplace_back(rim[0], rim[i + 1], rim[i]);
  const Model b(pyramid);
  TriangleMesh point;
  point.vertices = {{0, 0, 1}, {0, 0, 5}, {0, 1, 5}};
  point.triangles.emplace_back(0, 1, 2);
  Contacts result;
  vertexContacts(Model(point), this->still(), b, this->still(), 0., result);
  ASSERT_EQ(1u, result.size());
  EXPECT_EQ(0, result.distances[0]);
  EXPECT_LE((result.normals[0] - fcl::Vector3d(0, 0, -1)).norm(), 1e-6);
}

/// Both directions are the two calls.
TEST_F(VertexContact, OfBothAreThoseOfEach) {
  const Model a(latticeBox(3)), b(gridBall(9, 7));
  const auto tf = this->moved(0.4, 0.3, 0.2);
  Contacts one, two, of_first, of_second;
  vertexContacts(a, this->still(), b, tf, 0.1, one);
  vertexContacts(b, tf, a, this->still(), 0.1, two);
  EXPECT_EQ(one.size() + two.size(),
            vertexContacts(a, this->still(), b, tf, 0.1, of_first, of_second));
  EXPECT_GT(one.size(), 0u);
  EXPECT_GT(two.size(), 0u);
  EXPECT_EQ(one.vertices, of_first.vertices);
  EXPECT_EQ(one.normals, of_first.normals);
  EXPECT_EQ(two.distances, of_second.distances);
  EXPECT_EQ(two.triangles, of_second.triangles);
}

/// A penalty force pushes the bodies apart.
TEST_F(VertexContact, AForceAgainstTheNormalSeparates) {
  const Model a(gridBall(16, 12)), b(gridBall(20, 14));
  Contacts c;
  const double margin = 0.05;
  vertexContacts(a, this->moved(0, 0, 1.8), b, this->still(), margin, c);
  fcl::Vector3d force = fcl::Vector3d::Zero();
  for (std::size_t i = 0; i < c.size(); ++i)
    force -= (margin - c.distances[i]) * c.areas[i] * c.normals[i];
  EXPECT_GT(force[2], 0.01);
  EXPECT_LT(std::hypot(force[0], force[1]), 0.1 * force[2]);
}

TEST_F(VertexContact, RefusesWhatItCannotAnswer) {
  const Model closed(latticeBox(2)), open(plate(2, 2));
  Contacts result, other;
  vertexContacts(closed, this->still(), closed, this->still(), 0.1, result);
  const std::size_t before = result.size();
  ASSERT_GT(before, 0u);
  auto scaled = this->still();
  scaled.linear() *= 1.1;
  for (const double bad : {-1., std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(vertexContacts(closed, this->still(), closed, this->still(), bad, result),
                 std::invalid_argument);
  EXPECT_THROW(vertexContacts(closed, scaled, closed, this->still(), 1., result),
               std::invalid_argument);
  EXPECT_THROW(vertexContacts(closed, this->still(), closed, scaled, 1., result),
               std::invalid_argument);
  EXPECT_THROW(vertexContacts(open, this->still(), closed, this->still(), 1., result, other),
               std::invalid_argument);
  try {
    vertexContacts(closed, this->still(), open, this->still(), 1., result);
    FAIL() << "an open mesh";
  } catch (const std::invalid_argument& error) {
    // The first edge of plate's first triangle is on the rim.
    const fcl::Triangle& t = open.triangles()[0];
    EXPECT_NE(std::string::npos,
              std::string(error.what())
                  .find("the edge from vertex " + std::to_string(t[0]) + " to vertex " +
                        std::to_string(t[1]) + ", of triangle 0, is run through 1 time"))
        << error.what();
  }
  EXPECT_EQ(before, result.size());
}

}  // namespace vertex_contacts_test
}  // namespace adaptive_bvh_test
