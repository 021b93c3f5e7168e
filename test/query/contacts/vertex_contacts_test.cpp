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

template <typename S>
class VertexContact : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Contacts = VertexContacts<S>;

  static fcl::Transform3<S> still() { return fcl::Transform3<S>::Identity(); }
  static fcl::Transform3<S> moved(S x, S y, S z) {
    fcl::Transform3<S> tf = still();
    tf.translation() = Vector3<S>(x, y, z);
    return tf;
  }

  RandomGeometry<S> random_{41};
};

TYPED_TEST_SUITE(VertexContact, QueryScalars);

/// The vertices of one mesh as the other sees them, in long double.
template <typename S>
class Judge {
 public:
  Judge(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf, const DeformableMesh<S>& other,
        const fcl::Transform3<S>& other_tf)
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
  long check(const VertexContacts<S>& found, S margin) const {
    const Real rounding = size_ * Real(4e-14), epsilon = std::numeric_limits<S>::epsilon();
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
  void checkContact(const VertexContacts<S>& found, std::size_t i, const exact::Point& x, Real d,
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

  const DeformableMesh<S>&mesh_, &other_;
  const exact::Placement tf_, other_tf_;
  Real size_;
  std::vector<bool> is_used_;
};

/// Bodies of all kinds, scales and poses, overlapping, deformed.
TYPED_TEST(VertexContact, AreThoseOfAllTriangles) {
  using S = TypeParam;
  using Model = typename TestFixture::Model;
  auto& random = this->random_;
  long judged = 0, found = 0, inside = 0;
  for (int body = 0; body < manySteps(12); ++body) {
    const S scale = random.size(-6, 6);
    TriangleMesh<S> mesh = random.oneIn(4) ? plate<S>(6, 6) : closedBody(random);
    TriangleMesh<S> other = closedBody(random);
    mesh.vertices.push_back(Vector3<S>::Zero());  // of no triangle
    for (TriangleMesh<S>* m : {&mesh, &other})
      for (Vector3<S>& p : m->vertices) p *= scale;
    Model a(mesh), b(other);
    typename TestFixture::Contacts result;
    for (int step = 0; step < 3; ++step) {
      for (Vector3<S>& p : other.vertices) p += S(0.03) * scale * random.point();
      b.update(other.vertices);
      auto tf = random.pose(scale), other_tf = random.pose(scale);
      const S margin = random.oneIn(3)   ? S(0)
                       : random.oneIn(6) ? std::numeric_limits<S>::infinity()
                                         : scale * random.size(-3, 0);
      vertexContacts(a, tf, b, other_tf, margin, result);
      judged += Judge<S>(a, tf, b, other_tf).check(result, margin);
      found += long(result.size());
      for (const S d : result.distances) inside += d < 0;
    }
  }
  EXPECT_GT(judged, 2000);
  EXPECT_GT(found, judged / 10);
  EXPECT_GT(inside, found / 10);
  std::printf("%ld vertices judged, %ld contacts, %ld inside\n", judged, found, inside);
}

/// Boxes on a lattice, stacked face on face, edge on edge, and so that vertices lie on vertices.
TYPED_TEST(VertexContact, OnALatticeTouchingIsAtDistanceZero) {
  using S = TypeParam;
  using Model = typename TestFixture::Model;
  auto& random = this->random_;
  long judged = 0;
  for (int body = 0; body < manySteps(60); ++body) {
    const int n = 1 + random.below(4);
    const Model a(latticeBox<S>(1 + random.below(4))), b(latticeBox<S>(n));
    const S half = random.oneIn(2) ? S(0.5) : S(1);
    const auto shift = [&] { return half * S(random.below(2 * n + 3) - n); };
    const auto tf = this->moved(shift(), shift(), shift());
    const S margin = random.oneIn(2) ? S(0) : S(0.5) * S(random.below(3));
    typename TestFixture::Contacts result;
    vertexContacts(a, tf, b, this->still(), margin, result);
    std::size_t next = 0;
    for (unsigned v = 0; v < a.vertices().size(); ++v) {
      const Vector3<S> p = tf * a.vertices()[v];
      const Vector3<S> low = p, high = Vector3<S>::Constant(S(n)) - p;
      const S depth = std::min(low.minCoeff(), high.minCoeff());
      const S away = (-low).cwiseMax(-high).cwiseMax(Vector3<S>::Zero()).norm();
      const bool is_contact = depth > 0 || away <= margin;
      ASSERT_EQ(is_contact, next < result.size() && result.vertices[next] == v) << p.transpose();
      ++judged;
      if (!is_contact) continue;
      const S expected = depth >= 0 ? -depth : away;
      EXPECT_NEAR(expected, result.distances[next], S(8) * std::numeric_limits<S>::epsilon());
      EXPECT_EQ(depth == 0, result.distances[next] == 0);
      if (depth == 0) {
        Vector3<S> outward = Vector3<S>::Zero();
        for (int k = 0; k < 3; ++k) outward[k] = p[k] == 0 ? S(-1) : p[k] == S(n) ? S(1) : S(0);
        EXPECT_LE((result.normals[next] + outward.normalized()).norm(), S(1e-6))
            << p.transpose() << ": " << result.normals[next].transpose();
      }
      ++next;
    }
    ASSERT_EQ(next, result.size());
  }
  EXPECT_GT(judged, 1000);
}

/// The pseudo-normals of a mesh in long double, by their definition.
template <typename S>
class NormalJudge {
 public:
  explicit NormalJudge(const TriangleMesh<S>& mesh) : mesh_(mesh) {}

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

  const TriangleMesh<S>& mesh_;
};

/// Of vertices on vertices, on the middles of edges and inside of faces. A middle that is rounded
/// may be nearest to the edge or to a face beside it.
TYPED_TEST(VertexContact, NormalsOfTouchingVerticesAreThoseOfTheFeatures) {
  using S = TypeParam;
  using Model = typename TestFixture::Model;
  auto& random = this->random_;
  long judged = 0;
  for (int body = 0; body < manySteps(20); ++body) {
    TriangleMesh<S> mesh = gridBall<S>(5 + random.below(6), 3 + random.below(5));
    for (Vector3<S>& p : mesh.vertices) p += S(0.1) * random.point();
    const Model b(mesh);
    TriangleMesh<S> on_surface;
    for (const fcl::Triangle& t : mesh.triangles) {
      const auto &p = mesh.vertices[t[0]], &q = mesh.vertices[t[1]], &r = mesh.vertices[t[2]];
      const std::size_t first = on_surface.vertices.size();
      on_surface.vertices.insert(on_surface.vertices.end(),
                                 {p, Vector3<S>((p + q) / 2), Vector3<S>((p + q + r) / 3)});
      on_surface.triangles.emplace_back(first, first + 1, first + 2);
    }
    const Model a(on_surface);
    typename TestFixture::Contacts result;
    vertexContacts(a, this->still(), b, this->still(), S(1e-5), result);
    ASSERT_EQ(a.vertices().size(), result.size());
    const NormalJudge<S> judge(mesh);
    for (std::size_t i = 0; i < result.size(); ++i) {
      if (std::abs(result.distances[i]) > S(1e-9)) continue;
      const fcl::Triangle& t = mesh.triangles[i / 3];
      const exact::Point found = -exact::of(result.normals[i]);
      const auto expectNear = [&](std::initializer_list<exact::Point> directions) {
        Real least = 2;
        for (const exact::Point& n : directions) least = std::min(least, (n - found).norm());
        EXPECT_LE(least, 1e-6L + 8 * std::numeric_limits<S>::epsilon()) << i % 3;
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
TYPED_TEST(VertexContact, TheNormalOfAVertexIsWeightedByAngles) {
  using S = TypeParam;
  TriangleMesh<S> pyramid;
  pyramid.vertices = {{0, 0, 1},  {1, 1, 0},      {-1, 1, 0}, {-1, -1, 0},
                      {1, -1, 0}, {S(0.5), 1, 0}, {0, 1, 0},  {S(-0.25), 1, 0}};
  const std::size_t rim[] = {1, 5, 6, 7, 2, 3, 4};
  for (std::size_t i = 0; i < 7; ++i) pyramid.triangles.emplace_back(0, rim[i], rim[(i + 1) % 7]);
  for (std::size_t i = 1; i + 1 < 7; ++i)
    pyramid.triangles.emplace_back(rim[0], rim[i + 1], rim[i]);
  const typename TestFixture::Model b(pyramid);
  TriangleMesh<S> point;
  point.vertices = {{0, 0, 1}, {0, 0, 5}, {0, 1, 5}};
  point.triangles.emplace_back(0, 1, 2);
  typename TestFixture::Contacts result;
  vertexContacts(typename TestFixture::Model(point), this->still(), b, this->still(), S(0), result);
  ASSERT_EQ(1u, result.size());
  EXPECT_EQ(0, result.distances[0]);
  EXPECT_LE((result.normals[0] - Vector3<S>(0, 0, -1)).norm(), S(1e-6));
}

/// Both directions are the two calls.
TYPED_TEST(VertexContact, OfBothAreThoseOfEach) {
  using S = TypeParam;
  const typename TestFixture::Model a(latticeBox<S>(3)), b(gridBall<S>(9, 7));
  const auto tf = this->moved(S(0.4), S(0.3), S(0.2));
  typename TestFixture::Contacts one, two, of_first, of_second;
  vertexContacts(a, this->still(), b, tf, S(0.1), one);
  vertexContacts(b, tf, a, this->still(), S(0.1), two);
  EXPECT_EQ(one.size() + two.size(),
            vertexContacts(a, this->still(), b, tf, S(0.1), of_first, of_second));
  EXPECT_GT(one.size(), 0u);
  EXPECT_GT(two.size(), 0u);
  EXPECT_EQ(one.vertices, of_first.vertices);
  EXPECT_EQ(one.normals, of_first.normals);
  EXPECT_EQ(two.distances, of_second.distances);
  EXPECT_EQ(two.triangles, of_second.triangles);
}

/// A penalty force pushes the bodies apart.
TYPED_TEST(VertexContact, AForceAgainstTheNormalSeparates) {
  using S = TypeParam;
  const typename TestFixture::Model a(gridBall<S>(16, 12)), b(gridBall<S>(20, 14));
  typename TestFixture::Contacts c;
  const S margin = S(0.05);
  vertexContacts(a, this->moved(0, 0, S(1.8)), b, this->still(), margin, c);
  Vector3<S> force = Vector3<S>::Zero();
  for (std::size_t i = 0; i < c.size(); ++i)
    force -= (margin - c.distances[i]) * c.areas[i] * c.normals[i];
  EXPECT_GT(force[2], S(0.01));
  EXPECT_LT(std::hypot(force[0], force[1]), S(0.1) * force[2]);
}

TYPED_TEST(VertexContact, RefusesWhatItCannotAnswer) {
  using S = TypeParam;
  const typename TestFixture::Model closed(latticeBox<S>(2)), open(plate<S>(2, 2));
  typename TestFixture::Contacts result, other;
  vertexContacts(closed, this->still(), closed, this->still(), S(0.1), result);
  const std::size_t before = result.size();
  ASSERT_GT(before, 0u);
  auto scaled = this->still();
  scaled.linear() *= S(1.1);
  for (const S bad : {S(-1), std::numeric_limits<S>::quiet_NaN()})
    EXPECT_THROW(vertexContacts(closed, this->still(), closed, this->still(), bad, result),
                 std::invalid_argument);
  EXPECT_THROW(vertexContacts(closed, scaled, closed, this->still(), S(1), result),
               std::invalid_argument);
  EXPECT_THROW(vertexContacts(closed, this->still(), closed, scaled, S(1), result),
               std::invalid_argument);
  EXPECT_THROW(vertexContacts(open, this->still(), closed, this->still(), S(1), result, other),
               std::invalid_argument);
  try {
    vertexContacts(closed, this->still(), open, this->still(), S(1), result);
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
