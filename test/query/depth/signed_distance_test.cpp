// Signed distances with proven bounds, judged in long double: by points spread over both surfaces,
// by every pair of triangles, and by closed forms.
#include <gtest/gtest.h>

#include <fcl/geometry/shape/triangle_p.h>

#include "adaptive_bvh/penetration.h"
#include "support/depth_oracle.h"

namespace adaptive_bvh_test {
namespace signed_distance_test {

using adaptive_bvh::DeepBody;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::SignedDistance;
using exact::Point;
using exact::Real;

fcl::Transform3d still() { return fcl::Transform3d::Identity(); }
fcl::Transform3d moved(double x, double y, double z) {
  fcl::Transform3d tf = still();
  tf.translation() = fcl::Vector3d(x, y, z);
  return tf;
}

class SignedDistances : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Result = SignedDistance;
  static constexpr Real kEpsilon = std::numeric_limits<double>::epsilon();

  /// What both bounds may be off by that hold for other numbers than the judge's: `size` bounds the
  /// coordinates.
  static Real rounding(Real size) { return size * (16 * kEpsilon + 1e-12L); }

  /// A small closed body of about size 1.
  TriangleMesh smallBody() {
    TriangleMesh mesh;
    const int kind = random_.below(6);
    if (kind == 0) mesh = tetrahedron();
    if (kind == 1) mesh = octahedron();
    if (kind == 2) mesh = centred(1 + random_.below(2));
    if (kind == 3) mesh = gridBall(4, 2);
    if (kind == 4) {  // with a hollow
      mesh = octahedron();
      TriangleMesh hollow = octahedron();
      for (auto& p : hollow.vertices) p *= 0.6;
      addSurface(hollow, fcl::Vector3d(0, 0, 0.05), true, mesh);
    }
    if (kind == 5) {  // crossing itself, or two bodies
      mesh = tetrahedron();
      addSurface(octahedron(), fcl::Vector3d(random_.uniform() * 1.5 * fcl::Vector3d::UnitX()),
                 false, mesh);
    }
    const fcl::Vector3d shape(random_.size(-0.6, 0.1), random_.size(-0.6, 0.1),
                              random_.oneIn(6) ? random_.size(-3, 0) : random_.size(-0.6, 0.1));
    for (auto& p : mesh.vertices) p = p.cwiseProduct(shape);
    if (random_.oneIn(3))
      for (auto& p : mesh.vertices) p += 0.1 * random_.point();
    return mesh;
  }
  static TriangleMesh tetrahedron() {
    TriangleMesh mesh;
    mesh.vertices = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    for (const auto& t : {fcl::Triangle(0, 1, 2), fcl::Triangle(0, 3, 1), fcl::Triangle(0, 2, 3),
                          fcl::Triangle(1, 3, 2)})
      mesh.triangles.push_back(t);
    return mesh;
  }
  static TriangleMesh octahedron() {
    TriangleMesh mesh;
    mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (int i = 0; i < 8; ++i) {
      std::size_t a = std::size_t(i & 1), b = std::size_t(2 + (i >> 1 & 1)),
                  c = std::size_t(4 + (i >> 2 & 1));
      if ((i ^ i >> 1 ^ i >> 2) & 1) std::swap(a, b);
      mesh.triangles.emplace_back(a, b, c);
    }
    return mesh;
  }
  static TriangleMesh centred(int n) {
    TriangleMesh mesh = latticeBox(n);
    for (auto& p : mesh.vertices) p = p * (2. / double(n)) - fcl::Vector3d::Ones();
    return mesh;
  }
  double tolerance(double size) {
    const int kind = this->random_.below(6);
    return kind == 0 ? 0. : kind == 1 ? 0.3 * size : size * this->random_.size(-6, -1);
  }

  /// What holds for any two bodies: the bounds are near each other, the points are where they are
  /// said to be, and no sampled point is deeper.
  void check(const Result& found, const JudgedBody& one, const JudgedBody& two, bool is_flat,
             double tolerance, Real size, Real distance) {
    const Real rounding = this->rounding(size),
               at_most = std::max<Real>(tolerance, size * (4e-9L + 64 * kEpsilon));
    ASSERT_LE(found.lower, found.upper);
    ASSERT_LE(Real(found.upper) - Real(found.lower), at_most + rounding);
    const SampledDepth first(one, two, 5, true), second(two, one, is_flat ? 5 : 0, is_flat);
    points_ += first.points + second.points;
    const Real deepest = std::max(first.depth, second.depth);
    const Point p = exact::of(found.points[0]), q = exact::of(found.points[1]),
                n = exact::of(found.normal);
    ASSERT_NEAR(1, double(n.norm()), double(8 * kEpsilon));
    ASSERT_LE(one.distance(p), rounding);
    ASSERT_LE(two.distance(q), rounding);
    ++judged_;
    if (deepest > rounding) {
      ++inside_;
      ASSERT_LE(deepest, -Real(found.lower) + rounding);
      ASSERT_LE(found.upper, 0);
      if (found.upper < -rounding) {
        ASSERT_NE(found.deep_body, DeepBody::None);
      }
    } else if (distance > rounding) {
      ASSERT_GE(found.upper, 0) << double(deepest) << " " << double(distance);
      ASSERT_LE(found.lower, distance + rounding);
      ASSERT_GE(found.upper, distance - rounding);
      ASSERT_EQ(found.deep_body, DeepBody::None);
      ASSERT_LE(std::abs((q - p).norm() - distance), rounding);
      if (distance > 1e-3L * size) {
        ASSERT_LE(((q - p).normalized() - n).norm(), 1e3L * rounding / size + 1e-6L);
      }
    } else {
      ASSERT_LE(found.upper, 2 * rounding);  // too little is inside to be sampled
    }
    if (found.deep_body == DeepBody::None) return;
    const bool is_first = found.deep_body == DeepBody::First;
    const Real depth = is_first ? two.depth(p) : one.depth(q);
    ASSERT_LE(std::abs(depth + Real(found.upper)), 2 * rounding);
    ASSERT_LE(std::abs((p - q).norm() - depth), 2 * rounding);
    if (depth > 1e-3L * size) {
      ASSERT_LE(((p - q).normalized() - n).norm(), 1e3L * rounding / size + 1e-6L);
    }
  }
  static Real distance(const JudgedMesh& one, const JudgedMesh& two) {
    Real least = std::numeric_limits<Real>::infinity();
    for (const exact::Triangle& p : one.triangles())
      for (const exact::Triangle& q : two.triangles())
        least = std::min(least, exact::distance(p, q));
    return least;
  }
  void report(const char* what) const {
    std::printf("%s: %ld results judged, %ld inside, %ld points\n", what, judged_, inside_,
                points_);
  }

  RandomGeometry random_{45};
  long judged_ = 0, inside_ = 0, points_ = 0;
};

TEST_F(SignedDistances, ContainTheDepthOfSampledSurfaces) {
  auto& random = this->random_;
  for (int body = 0; body < manySteps(40); ++body) {
    const double scale = random.size(-3, 3);
    TriangleMesh mesh = this->smallBody(), other = this->smallBody();
    for (TriangleMesh* m : {&mesh, &other})
      for (auto& p : m->vertices) p *= scale;
    if (random.oneIn(4))
      for (auto& p : other.vertices) p *= 0.2;
    const Model a(mesh), b(other);
    const auto tf = random.pose(0.5 * scale), other_tf = random.pose(0.5 * scale);
    const double tolerance = this->tolerance(scale);
    const JudgedMesh one(a, tf), two(b, other_tf);
    const auto found = signedDistance(a, tf, b, other_tf, tolerance);
    this->check(found, one, two, true, tolerance, 4 * scale, this->distance(one, two));
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(this->inside_, this->judged_ / 3);
  this->report("meshes");
}

/// Depth of the surface of box 1 in box 2, along the axes: the largest, over the faces, of the
/// least distance to a face of the other.
double depthOfBox(const fcl::Vector3d (&one)[2], const fcl::Vector3d (&two)[2]) {
  const auto tent = [&](int k, double x) { return std::min(x - two[0][k], two[1][k] - x); };
  const auto highest = [&](int k) {
    const double low = std::max(one[0][k], two[0][k]), high = std::min(one[1][k], two[1][k]),
                 middle = (two[0][k] + two[1][k]) / 2;
    return tent(k, std::max(low, std::min(middle, high)));
  };
  double deepest = -1;
  for (int k = 0; k < 3; ++k)
    for (const fcl::Vector3d& end : one)
      deepest = std::max(deepest,
                         std::min({tent(k, end[k]), highest((k + 1) % 3), highest((k + 2) % 3)}));
  return deepest;
}

/// Boxes on a lattice: faces in one plane, parallel edges, corners on corners, one in the other,
/// the same box twice; cut into triangles in different ways, turned by quarters. Depths are known.
TEST_F(SignedDistances, OfBoxesOnALattice) {
  auto& random = this->random_;
  long judged = 0, inside = 0, touching = 0;
  for (int body = 0; body < manySteps(400); ++body) {
    fcl::Vector3d ends[2][2];
    std::vector<Model> models;
    fcl::Transform3d tf[2];
    for (int i = 0; i < 2; ++i) {
      TriangleMesh mesh = latticeBox(1 + random.below(3));
      fcl::Vector3d scale;
      for (int k = 0; k < 3; ++k)
        scale[k] = double(1 + random.below(4)) / mesh.vertices.back().maxCoeff();
      for (auto& p : mesh.vertices) p = p.cwiseProduct(scale);
      tf[i] = moved(double(random.below(7)) / 2, double(random.below(7)) / 2,
                    double(random.below(7)) / 2);
      const int axis = random.below(3), turns = random.below(4);
      for (int turn = 0; turn < turns; ++turn) {
        fcl::Matrix3d quarter = fcl::Matrix3d::Zero();
        quarter(axis, axis) = 1;
        quarter((axis + 1) % 3, (axis + 2) % 3) = -1;
        quarter((axis + 2) % 3, (axis + 1) % 3) = 1;
        tf[i].linear() = tf[i].linear() * quarter;
      }
      ends[i][0] = fcl::Vector3d::Constant(1e9f);
      ends[i][1] = -ends[i][0];
      for (const auto& p : mesh.vertices) {
        ends[i][0] = ends[i][0].cwiseMin(tf[i] * p);
        ends[i][1] = ends[i][1].cwiseMax(tf[i] * p);
      }
      models.emplace_back(mesh);
    }
    const double depth = std::max(depthOfBox(ends[0], ends[1]), depthOfBox(ends[1], ends[0]));
    const fcl::Vector3d gap =
        (ends[0][0] - ends[1][1]).cwiseMax(ends[1][0] - ends[0][1]).cwiseMax(fcl::Vector3d::Zero());
    const double expected = depth > 0 ? -depth : gap.norm();
    const double tolerance = random.oneIn(2) ? 0. : 0.01;
    const auto found = signedDistance(models[0], tf[0], models[1], tf[1], tolerance);
    const double rounding = 40. * std::numeric_limits<double>::epsilon() + 1e-10;
    ASSERT_LE(found.lower, expected + rounding);
    ASSERT_GE(found.upper, expected - rounding);
    ASSERT_LE(found.upper - found.lower, std::max(tolerance, 2e-8) + rounding) << expected;
    ASSERT_EQ(found.deep_body == DeepBody::None, depth <= 0);
    ++judged;
    inside += depth > 0;
    touching += expected == 0;
  }
  EXPECT_GT(inside, judged / 6);
  EXPECT_GT(touching, judged / 50);
  std::printf("%ld lattice boxes, %ld inside, %ld touching\n", judged, inside, touching);
}

/// The deepest point is inside of a face: elsewhere depths by vertices were as different as the
/// tessellations.
TEST_F(SignedDistances, DoNotDependOnTheTessellation) {
  const Model large([] {
    TriangleMesh mesh = octahedron();
    for (auto& p : mesh.vertices) p *= 2;
    return mesh;
  }());
  // A box that is narrow where the tip of the octahedron is; |x| + |y| + |z| = 2 is 0.8 / sqrt(3)
  // away from the middle of its lowest face, and from the corners of that 0.2 / sqrt(3).
  const double expected = -0.8 / std::sqrt(3.), tolerance = 1e-4;
  for (const int n : {1, 2, 3, 5, 8}) {
    TriangleMesh mesh = latticeBox(n);
    for (auto& p : mesh.vertices) p *= 0.6 / double(n);
    const Model box(mesh);
    const auto tf = moved(-0.3, -0.3, 1.2);
    for (const bool is_first : {true, false}) {
      const auto found = is_first ? signedDistance(box, tf, large, still(), tolerance)
                                  : signedDistance(large, still(), box, tf, tolerance);
      EXPECT_LE(found.upper - found.lower, tolerance + 1e-6);
      EXPECT_LE(found.lower, expected + 1e-6);
      EXPECT_GE(found.upper, expected - 1e-6) << n;
      EXPECT_EQ(found.deep_body, is_first ? DeepBody::First : DeepBody::Second);
      EXPECT_LE((found.points[is_first ? 0 : 1] - fcl::Vector3d(0, 0, 1.2)).norm(), 2e-3);
    }
  }
}

TEST_F(SignedDistances, OfBalls) {
  const Model a(gridBall(64, 31)), b(gridBall(50, 24));
  for (const double apart : {0.3, 1.2, 1.9, 2.1}) {
    const fcl::Vector3d at = apart * fcl::Vector3d(0.36, 0.48, 0.8);
    const auto found = signedDistance(a, still(), b, moved(at[0], at[1], at[2]), 1e-3);
    // Flat faces are up to 0.012 below the sphere. Where the middles are near each other, so are
    // the surfaces.
    const double expected = apart < 1 ? -apart : apart - 2;
    EXPECT_NEAR(expected, found.lower, 0.03);
    EXPECT_NEAR(expected, found.upper, 0.03);
    EXPECT_LE(found.upper - found.lower, 1.001e-3);
    EXPECT_GT(found.normal.dot(at.normalized()) * (apart < 1 ? -1 : 1), 0.98) << apart;
  }
  const auto same = signedDistance(a, still(), a, still(), 1e-3);
  EXPECT_LE(same.upper, 0);
  EXPECT_GE(same.upper, -1e-5);
  EXPECT_GE(same.lower, -1.001e-3);
}

TEST_F(SignedDistances, ABodyInAHollowIsApart) {
  TriangleMesh shell = latticeBox(4);
  TriangleMesh hollow = latticeBox(2);
  addSurface(hollow, fcl::Vector3d(1, 1, 1), true, shell);
  const Model outer(shell), small(latticeBox(1));
  const auto in_hollow = signedDistance(small, moved(1.25, 1.5, 1.5), outer, still(), 1e-3);
  EXPECT_NEAR(0.25, in_hollow.lower, 1e-5);
  EXPECT_NEAR(0.25, in_hollow.upper, 1e-5);
  EXPECT_EQ(in_hollow.deep_body, DeepBody::None);
  EXPECT_LE((in_hollow.normal - fcl::Vector3d(-1, 0, 0)).norm(), 1e-5);
  // In the wall, 1 thick, it is deep by half of what is left on either side of its middle.
  TriangleMesh thin = latticeBox(1);
  for (auto& p : thin.vertices) p *= 0.5;
  const auto in_wall = signedDistance(Model(thin), moved(0.25, 1.5, 1.5), outer, still(), 0.);
  EXPECT_NEAR(-0.5, in_wall.upper, 1e-5);
  EXPECT_EQ(in_wall.deep_body, DeepBody::First);
  // A second part of the first body is inside, and the first part apart.
  TriangleMesh both = thin;
  addSurface(thin, fcl::Vector3d(10, 0, 0), false, both);
  const auto two_parts = signedDistance(Model(both), moved(-9.75, 1.5, 1.5), outer, still(), 1e-3);
  EXPECT_NEAR(-0.5, two_parts.upper, 2e-3);
}

/// Each of FCL's solids, its depth, and its surface.
struct Solid {
  std::string name;
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  std::shared_ptr<JudgedSolid> judged;
  JudgedShape shape;
};

/// The least distance of a point inside to an ellipsoid: by a grid of directions, then closer and
/// closer around the best.
inline Real depthInEllipsoid(const Point& x, const Point& radii) {
  if (x.cwiseQuotient(radii).squaredNorm() >= 1) return -judged_shapes::toEllipsoid(x, radii);
  const auto at = [&](Real u, Real v) {
    const Point p(std::sin(u) * std::cos(v), std::sin(u) * std::sin(v), std::cos(u));
    return (radii.cwiseProduct(p) - x).squaredNorm();
  };
  Real best = 1e30L, u = 0, v = 0;
  for (int i = 0; i <= 16; ++i)
    for (int j = 0; j < 32; ++j) {
      const Real a = i * std::acos(-1.L) / 16, b = j * std::acos(-1.L) / 16;
      if (at(a, b) < best) best = at(a, b), u = a, v = b;
    }
  for (Real step = 0.2L; step > 1e-13L;) {
    bool moves = false;
    for (const auto& [du, dv] :
         {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}})
      if (at(u + du * step, v + dv * step) < best) {
        u += du * step, v += dv * step, best = at(u, v);
        moves = true;
      }
    if (!moves) step /= 2;
  }
  return std::sqrt(best);
}

Solid solidOf(int kind, double size, const fcl::Transform3d& tf, RandomGeometry& random) {
  using namespace judged_shapes;
  const auto side = [&] { return size * random.size(-0.5, 0.1); };
  const double a = side(), b = side(), c = side();
  const Real r = a, half = Real(b) / 2, pi = std::acos(-1.L);
  const auto solid = [&](const JudgedShape& shape, auto depth) {
    return Solid{shape.name, shape.geometry, std::make_shared<JudgedSolid>(tf, depth), shape};
  };
  const auto ball = [pi](const Point& radii, Real z) {
    return [=](Real u, Real v) -> Point {
      return Point(0, 0, z) +
             radii.cwiseProduct(Point(std::sin(pi * u) * std::cos(2 * pi * v),
                                      std::sin(pi * u) * std::sin(2 * pi * v), std::cos(pi * u)));
    };
  };
  const auto turned = [pi](Real r0, Real z0, Real r1, Real z1) {
    return [=](Real u, Real v) -> Point {
      const Real radius = r0 + u * (r1 - r0);
      return {radius * std::cos(2 * pi * v), radius * std::sin(2 * pi * v), z0 + u * (z1 - z0)};
    };
  };
  const auto inBox = [](const Point& x, const Point& h) {
    const Point beyond = x.cwiseAbs() - h;
    const Real most = beyond.maxCoeff();
    return most <= 0 ? -most : -beyond.cwiseMax(Point::Zero()).norm();
  };
  switch (kind) {
    case 0: {
      auto found = solid(sphere(a), [=](const Point& x) { return r - x.norm(); });
      found.judged->add(ball(Point::Constant(r), 0));
      return found;
    }
    case 1: {
      auto found = solid(capsule(a, b), [=](const Point& x) {
        return r - (x - Point(0, 0, exact::clamp(x[2], -half, half))).norm();
      });
      // Halves of balls, by a quarter turn each.
      for (const Real sign : {1.L, -1.L})
        found.judged->add([=](Real u, Real v) -> Point {
          return Point(0, 0, sign * half) + r * Point(std::sin(pi / 2 * u) * std::cos(2 * pi * v),
                                                      std::sin(pi / 2 * u) * std::sin(2 * pi * v),
                                                      sign * std::cos(pi / 2 * u));
        });
      found.judged->add(turned(r, -half, r, half));
      return found;
    }
    case 2: {
      const Point h = Point(a, b, c) / 2;
      auto found = solid(box(fcl::Vector3d(a, b, c)), [=](const Point& x) { return inBox(x, h); });
      for (int k = 0; k < 6; ++k)
        found.judged->add([=](Real u, Real v) -> Point {
          Point p;
          p[k % 3] = k < 3 ? h[k % 3] : -h[k % 3];
          p[(k + 1) % 3] = (2 * u - 1) * h[(k + 1) % 3];
          p[(k + 2) % 3] = (2 * v - 1) * h[(k + 2) % 3];
          return p;
        });
      return found;
    }
    case 3: {
      auto found = solid(cylinder(a, b), [=](const Point& x) {
        const Real out = std::hypot(x[0], x[1]) - r, up = std::abs(x[2]) - half;
        return std::max(out, up) <= 0 ? -std::max(out, up)
                                      : -std::hypot(std::max(out, 0.L), std::max(up, 0.L));
      });
      found.judged->add(turned(0, half, r, half));
      found.judged->add(turned(0, -half, r, -half));
      found.judged->add(turned(r, -half, r, half));
      return found;
    }
    case 4: {
      auto found = solid(cone(a, b), [=](const Point& x) {
        const Real rho = std::hypot(x[0], x[1]), length = std::hypot(2 * half, r);
        const Real side = (r * (half - x[2]) - rho * 2 * half) / length, base = x[2] + half;
        if (side >= 0 && base >= 0) return std::min(side, base);
        return -toProfile(rho, x[2], {{0, -half}, {r, -half}, {0, half}});
      });
      found.judged->add(turned(0, -half, r, -half));
      found.judged->add(turned(0, half, r, -half));
      return found;
    }
    case 5: {
      const Point radii(a, b, c);
      auto found = solid(ellipsoid(fcl::Vector3d(a, b, c)),
                         [=](const Point& x) { return depthInEllipsoid(x, radii); });
      found.judged->add(ball(radii, 0));
      return found;
    }
    default: {
      const fcl::Vector3d h(a, b, c), shift = 0.2 * size * random.point();
      const JudgedShape shape = octahedron(h, shift);
      const auto distance = shape.distance;
      const Point e = exact::of(h), s = exact::of(shift);
      auto found = solid(shape, [=](const Point& x) {
        const Point n = e.cwiseInverse();
        const Real depth = (1 - (x - s).cwiseAbs().cwiseQuotient(e).sum()) / n.norm();
        return depth >= 0 ? depth : -distance(x);
      });
      for (int i = 0; i < 8; ++i)
        found.judged->add([=](Real u, Real v) -> Point {
          const Point l((1 - u), u * (1 - v), u * v);
          Point p;
          for (int k = 0; k < 3; ++k) p[k] = s[k] + (i >> k & 1 ? 1 : -1) * l[k] * e[k];
          return p;
        });
      return found;
    }
  }
}

TEST_F(SignedDistances, OfAMeshAndASolid) {
  auto& random = this->random_;
  for (int body = 0; body < manySteps(28); ++body) {
    const double scale = random.size(-3, 3);
    TriangleMesh mesh = this->smallBody();
    for (auto& p : mesh.vertices) p *= scale;
    const Model a(mesh);
    const auto tf = random.pose(0.5 * scale), other_tf = random.pose(0.5 * scale);
    const double size = random.oneIn(4) ? 0.2 * scale : random.oneIn(4) ? 4 * scale : scale;
    const Solid solid = solidOf(body % 7, size, other_tf, random);
    SCOPED_TRACE(solid.name);
    const double tolerance = std::max(this->tolerance(scale), 1e-6 * scale);
    const JudgedMesh one(a, tf);
    const fcl::CollisionGeometryd& geometry = *solid.geometry;
    const auto found = signedDistance(a, tf, geometry, other_tf, tolerance);
    const exact::Placement at = exact::placement(other_tf);
    Real distance = std::numeric_limits<Real>::infinity();
    for (exact::Triangle t : one.triangles()) {
      for (Point& p : t) p = at.R.transpose() * (p - at.T);
      distance = std::min(distance, solid.shape.distanceTo(t));
    }
    this->check(found, one, *solid.judged, false, tolerance, 8 * scale, distance);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(this->inside_, this->judged_ / 3);
  this->report("solids");
}

TEST_F(SignedDistances, OfAMeshAndAHalfSpace) {
  auto& random = this->random_;
  for (int body = 0; body < manySteps(50); ++body) {
    const Model a(this->smallBody());
    const auto tf = random.pose(1), other_tf = random.pose(1);
    const fcl::Halfspaced solid(random.direction(), random.uniform());
    const auto found = signedDistance(a, tf, solid, other_tf, 0.);
    const exact::Placement at = exact::placement(tf), other = exact::placement(other_tf);
    const Point n = exact::of(solid.n).normalized();
    Real lowest = std::numeric_limits<Real>::infinity();
    for (const auto& p : a.vertices())
      lowest = std::min(lowest, n.dot(other.inverse(at(exact::of(p)))) -
                                    Real(solid.d) / exact::of(solid.n).norm());
    const Real rounding = this->rounding(4);
    ASSERT_NEAR(double(lowest), double(found.lower), double(rounding));
    ASSERT_NEAR(double(lowest), double(found.upper), double(rounding));
    ASSERT_LE((exact::of(found.normal) + other.R * n).norm(), this->rounding(4));
    ASSERT_LE(
        std::abs(
            (exact::of(found.points[1]) - exact::of(found.points[0])).dot(exact::of(found.normal)) -
            lowest),
        2 * rounding);
    ASSERT_EQ(found.deep_body, lowest < 0 ? DeepBody::First : DeepBody::None);
  }
}

TEST_F(SignedDistances, RefuseWhatTheyCannotAnswer) {
  using Model = Model;
  const Model closed(latticeBox(2)), open(plate(2, 2));
  const fcl::Sphered sphere(1);
  auto scaled = still();
  scaled.linear() *= 1.1;
  const auto refuses = [&](const auto& call, const char* what) {
    try {
      call();
      ADD_FAILURE() << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(what)) << error.what();
    }
  };
  const fcl::CollisionGeometryd& solid = sphere;
  for (const double bad : {-1., std::numeric_limits<double>::quiet_NaN()}) {
    refuses([&] { signedDistance(closed, still(), closed, still(), bad); }, "tolerance");
    refuses([&] { signedDistance(closed, still(), solid, still(), bad); }, "tolerance");
  }
  refuses([&] { signedDistance(closed, scaled, closed, still(), 1.); }, "rigid");
  refuses([&] { signedDistance(closed, still(), solid, scaled, 1.); }, "rigid");
  refuses([&] { signedDistance(open, still(), closed, still(), 1.); }, "the edge from");
  refuses([&] { signedDistance(closed, still(), open, still(), 1.); }, "the edge from");
  refuses([&] { signedDistance(open, still(), solid, still(), 1.); }, "the edge from");
  const fcl::Planed plane(fcl::Vector3d::UnitX(), 0);
  const fcl::TriangleP<double> triangle(fcl::Vector3d::Zero(), fcl::Vector3d::UnitX(),
                                        fcl::Vector3d::UnitY());
  const fcl::CollisionGeometryd &flat = plane, &thin = triangle;
  refuses([&] { signedDistance(closed, still(), flat, still(), 1.); }, "no inside");
  refuses([&] { signedDistance(closed, still(), thin, still(), 1.); }, "of this type");
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>(
      std::vector<fcl::Vector3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  auto faces = std::make_shared<std::vector<int>>(std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3});
  const fcl::Convexd lacking(vertices, 2, faces);
  const fcl::CollisionGeometryd& convex = lacking;
  refuses([&] { signedDistance(closed, still(), convex, still(), 1.); }, "faces");
}

/// An infinite tolerance needs no search, and still gives bounds.
TEST_F(SignedDistances, OfAnyTolerance) {
  const Model a(gridBall(20, 13));
  const auto tf = moved(1.5, 0.2, 0);
  const double infinity = std::numeric_limits<double>::infinity();
  const auto loose = signedDistance(a, still(), a, tf, infinity),
             fine = signedDistance(a, still(), a, tf, 0.);
  EXPECT_LE(loose.lower, fine.lower);
  EXPECT_GE(loose.upper, fine.upper);
  EXPECT_GE(loose.lower, -10.);
  EXPECT_LT(loose.searches, 10u);
}

}  // namespace signed_distance_test
}  // namespace adaptive_bvh_test
