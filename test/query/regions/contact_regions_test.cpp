// Regions and curves of two closed meshes, judged by convex polyhedra that are clipped in long
// double, by cells between the planes of voxel bodies, and by closed forms.
#include <gtest/gtest.h>

#include "adaptive_bvh/contact_regions.h"
#include "support/clipped_polyhedra.h"
#include "support/closed_bodies.h"
#include "support/voxel_bodies.h"

namespace adaptive_bvh_test {
namespace contact_regions_test {

using adaptive_bvh::contactRegions;
using adaptive_bvh::ContactRegions;
using adaptive_bvh::DeformableMesh;
using exact::Real;

class ContactRegion : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Regions = ContactRegions;

  static fcl::Transform3d still() { return fcl::Transform3d::Identity(); }
  static fcl::Transform3d moved(double x, double y, double z) {
    fcl::Transform3d tf = still();
    tf.translation() = fcl::Vector3d(x, y, z);
    return tf;
  }
  static Real unit() { return std::numeric_limits<double>::epsilon(); }

  RandomGeometry random_{413};
};

Real sumOf(const std::vector<double>& numbers) {
  Real sum = 0;
  for (const double x : numbers) sum += x;
  return sum;
}

/// A rotation by quarter turns, without rounding.
fcl::Matrix3d quarterTurns(RandomGeometry& random) {
  fcl::Matrix3d turn = fcl::Matrix3d::Zero();
  const int first = random.below(3), second = (first + 1 + random.below(2)) % 3;
  turn(first, 0) = random.oneIn(2) ? 1. : -1.;
  turn(second, 1) = random.oneIn(2) ? 1. : -1.;
  turn.col(2) = turn.col(0).cross(turn.col(1));
  return turn;
}

/// What holds of every result: arrays fit together, and curves follow the two meshes.
void expectWhole(const DeformableMesh& first, const fcl::Transform3d& tf1,
                 const DeformableMesh& second, const fcl::Transform3d& tf2,
                 const ContactRegions& result, Real tolerance) {
  const std::size_t count = result.size();
  ASSERT_EQ(count, result.depths.size());
  ASSERT_EQ(count, result.normals.size());
  for (const auto* side : {&result.first, &result.second}) {
    ASSERT_EQ(count, side->areas.size());
    ASSERT_EQ(count + 1, side->begins.size());
    ASSERT_EQ(side->triangles.size(), side->begins.back());
    for (std::size_t r = 0; r < count; ++r)
      for (std::size_t i = side->begins[r] + 1; i < side->begins[r + 1]; ++i)
        ASSERT_LT(side->triangles[i - 1], side->triangles[i]);
  }
  const auto smallest = [&](std::size_t r) {
    const auto of = [&](const adaptive_bvh::ContactPatches& side) {
      return side.begins[r] < side.begins[r + 1] ? side.triangles[side.begins[r]] : ~0u;
    };
    return std::make_pair(of(result.first), of(result.second));
  };
  for (std::size_t r = 1; r < count; ++r) ASSERT_LE(smallest(r - 1), smallest(r));
  ASSERT_EQ(result.numCurves() + 1, result.curve_begins.size());
  ASSERT_EQ(result.curve_points.size(), result.curve_begins.back());
  ASSERT_TRUE(std::is_sorted(result.curve_regions.begin(), result.curve_regions.end()));
  const auto corners = [](const DeformableMesh& mesh, const fcl::Transform3d& tf,
                          unsigned t) -> exact::Triangle {
    const exact::Placement place = exact::placement(tf);
    const auto at = [&](int k) -> exact::Point {
      return place(exact::of(mesh.vertices()[mesh.triangles()[t][k]]));
    };
    return {at(0), at(1), at(2)};
  };
  for (std::size_t c = 0; c < result.numCurves(); ++c) {
    const std::size_t begin = result.curve_begins[c], end = result.curve_begins[c + 1];
    ASSERT_LT(begin + 1, end);
    for (std::size_t i = begin; i < end; ++i) {
      const exact::Triangle t1 = corners(first, tf1, result.curve_first[i]),
                            t2 = corners(second, tf2, result.curve_second[i]);
      for (const std::size_t at : {i, i + 1 < end ? i + 1 : begin}) {
        const exact::Point x = exact::of(result.curve_points[at]);
        EXPECT_LE(exact::distance(t1, x), tolerance);
        EXPECT_LE(exact::distance(t2, x), tolerance);
      }
    }
  }
}

/// Two tetrahedra of any shape.
TEST_F(ContactRegion, OfTetrahedraEqualClippedPolyhedra) {
  auto& random = this->random_;
  Regions result;
  long crossing = 0, nested = 0;
  for (int step = 0; step < manySteps(4000); ++step) {
    std::array<TriangleMesh, 2> meshes;
    std::array<exact::Tetrahedron, 2> bodies;
    const fcl::Transform3d tf[2] = {random.pose(0.3), random.pose(0.3)};
    for (std::size_t b = 0; b < 2; ++b) {
      const fcl::Vector3d shape(1, random.oneIn(3) ? random.size(-3, 0) : 1.,
                                random.oneIn(3) ? random.size(-2, 0) : 1.);
      const double scale = random.oneIn(4) ? random.size(-1, 0.5) : 1.;
      for (std::size_t k = 0; k < 4; ++k)
        meshes[b].vertices.push_back(scale * random.point().cwiseProduct(shape));
      const auto& v = meshes[b].vertices;
      const exact::Placement place = exact::placement(tf[b]);
      for (std::size_t k = 0; k < 4; ++k) bodies[b].p[k] = place(exact::of(v[k]));
      const bool flips = bodies[b].volume() < 0;
      const std::size_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
      for (const auto& f : faces)
        meshes[b].triangles.emplace_back(f[0], f[flips ? 2 : 1], f[flips ? 1 : 2]);
    }
    const DeformableMesh first(meshes[0]), second(meshes[1]);
    contactRegions(first, tf[0], second, tf[1], result);
    const exact::Moments in_second = exact::insideOf(bodies[0], bodies[1]),
                         in_first = exact::insideOf(bodies[1], bodies[0]);
    const Real volume = exact::commonVolume(bodies[0], bodies[1]);
    const Real size = 4, tolerance = 4000 * this->unit() * size;
    expectWhole(first, tf[0], second, tf[1], result, tolerance);
    ASSERT_LE(result.size(), 1u);
    ASSERT_LE(std::abs(volume - sumOf(result.volumes)), tolerance) << step;
    ASSERT_LE(std::abs(in_second.area - sumOf(result.first.areas)), tolerance * size) << step;
    ASSERT_LE(std::abs(in_first.area - sumOf(result.second.areas)), tolerance * size) << step;
    if (result.size() == 0) continue;
    ++(result.numCurves() > 0 ? crossing : nested);
    const auto expectCentroid = [&](const exact::Moments& m, const fcl::Vector3d& found) {
      if (m.area < 1e-4L) return;
      ASSERT_LE((exact::of(found) - m.first / m.area).norm(), tolerance * size / m.area) << step;
    };
    expectCentroid(in_second, result.first.centroids[0]);
    expectCentroid(in_first, result.second.centroids[0]);
    const Real flat = in_second.normal.norm();
    if (flat > 1e-4L) {
      EXPECT_LE((in_second.normal / flat - exact::of(result.normals[0])).norm(),
                tolerance * size / flat);
      EXPECT_LE((in_second.normal + in_first.normal).norm(), 1e-15L * 1000);
    }
  }
  EXPECT_GT(crossing, 1000);
  EXPECT_GT(nested, 2);
}

/// Bodies of cubes on one lattice, or on two: faces coincide, edges lie on edges.
TEST_F(ContactRegion, OfVoxelBodiesEqualCells) {
  auto& random = this->random_;
  Regions result;
  long regions = 0, touching = 0;
  for (int step = 0; step < manySteps(300); ++step) {
    const VoxelBody one = VoxelBody::random(random), two = VoxelBody::random(random);
    const double size = random.oneIn(2) ? 1. : 0.25 * double(1 + random.below(6));
    std::array<double, 3> origin;
    const double grid = random.oneIn(2) ? 1. : 0.125;
    for (double& x : origin) x = double(grid) * std::round(random.uniform(-2, 3) / grid);
    const DeformableMesh first(one.surface(1.)), second(two.surface(size));
    fcl::Transform3d tf1 = this->still(), tf2 = this->still();
    if (random.oneIn(2)) {
      tf1.linear() = quarterTurns(random);
      tf1.translation() = fcl::Vector3d(double(random.below(5)), double(random.below(5)), -2.);
    }
    tf2.linear() = tf1.linear();
    tf2.translation() =
        tf1 * fcl::Vector3d(double(origin[0]), double(origin[1]), double(origin[2]));
    contactRegions(first, tf1, second, tf2, result);
    const VoxelOverlap overlap(one, two, double(size), origin);
    const auto tolerance = static_cast<double>(200 * this->unit());
    expectWhole(first, tf1, second, tf2, result, tolerance);
    std::vector<VoxelOverlap::Region> found;
    for (std::size_t r = 0; r < result.size(); ++r)
      found.push_back({double(result.volumes[r]), double(result.first.areas[r]),
                       double(result.second.areas[r])});
    for (auto& f : found)  // numbers of eighths, so that rounding changes no order
      f = {std::round(f.volume * 4096) / 4096, std::round(f.first_area * 4096) / 4096,
           std::round(f.second_area * 4096) / 4096};
    std::sort(found.begin(), found.end());
    ASSERT_EQ(overlap.regions().size(), found.size()) << step;
    for (std::size_t r = 0; r < found.size(); ++r) {
      const VoxelOverlap::Region& expected = overlap.regions()[r];
      ASSERT_NEAR(expected.volume, found[r].volume, tolerance) << step;
      ASSERT_NEAR(expected.first_area, found[r].first_area, tolerance) << step;
      ASSERT_NEAR(expected.second_area, found[r].second_area, tolerance) << step;
      ++regions;
      touching += expected.volume == 0;
    }
  }
  EXPECT_GT(regions, 200);
  EXPECT_GT(touching, 20);
}

/// The cones from a point to the triangles of a closed mesh: each counts once, or is taken away.
class SignedCones {
 public:
  SignedCones(const DeformableMesh& mesh, const fcl::Transform3d& tf) {
    const exact::Placement place = exact::placement(tf);
    const exact::Point apex = place(exact::Point(0.0123L, -0.0345L, 0.0217L));
    for (const fcl::Triangle& t : mesh.triangles()) {
      exact::Polygon face;
      for (int k = 0; k < 3; ++k) face.push_back(place(exact::of(mesh.vertices()[t[k]])));
      faces_.push_back(face);
      const exact::Tetrahedron body{{apex, face[0], face[1], face[2]}};
      const Real volume = body.volume();
      if (std::abs(volume) < 1e-17L) continue;
      Cone cone{
          {body.half(0), body.half(1), body.half(2), body.half(3)}, volume < 0 ? -1 : 1, {}, {}};
      cone.low = apex.cwiseMin(face[0]).cwiseMin(face[1]).cwiseMin(face[2]);
      cone.high = apex.cwiseMax(face[0]).cwiseMax(face[1]).cwiseMax(face[2]);
      cones_.push_back(cone);
    }
  }
  /// The parts of this mesh's triangles inside another body, as often as it winds around them.
  exact::Moments inside(const SignedCones& other) const {
    exact::Moments sum;
    for (const exact::Polygon& face : faces_) {
      const exact::Point low = face[0].cwiseMin(face[1]).cwiseMin(face[2]),
                         high = face[0].cwiseMax(face[1]).cwiseMax(face[2]);
      for (const Cone& cone : other.cones_) {
        if ((low.array() > cone.high.array()).any() || (high.array() < cone.low.array()).any())
          continue;
        exact::Polygon part = face;
        for (std::size_t k = 0; k < 4 && !part.empty(); ++k) part = clipped(part, cone.halves[k]);
        sum.add(part, cone.sign);
      }
    }
    return sum;
  }
  /// How far a point is from the surface.
  Real distance(const exact::Point& x) const {
    Real least = std::numeric_limits<Real>::infinity();
    for (const exact::Polygon& f : faces_)
      least = std::min(least, exact::distance({f[0], f[1], f[2]}, x));
    return least;
  }

 private:
  struct Cone {
    std::array<exact::HalfSpace, 4> halves;
    int sign;
    exact::Point low, high;
  };
  std::vector<exact::Polygon> faces_;
  std::vector<Cone> cones_;
};

/// Moves some vertices onto others: triangles without area.
void collapseSome(RandomGeometry& random, TriangleMesh& mesh) {
  for (int i = 0; i < 4; ++i) {
    const fcl::Triangle& t = mesh.triangles[std::size_t(random.below(int(mesh.triangles.size())))];
    const fcl::Vector3d to = mesh.vertices[t[0]];
    if (random.oneIn(2))
      mesh.vertices[t[1]] = to;
    else
      mesh.vertices[t[1]] = (to + mesh.vertices[t[2]]) / 2;
  }
}

/// Bodies of any kind, also two in one mesh, with cavities, and such as cross themselves.
TEST_F(ContactRegion, OfAnyBodiesEqualSumsOverCones) {
  auto& random = this->random_;
  Regions result;
  long regions = 0;
  for (int step = 0; step < manySteps(8); ++step) {
    TriangleMesh mesh1 = closedBody(random), mesh2 = closedBody(random);
    if (random.oneIn(2)) collapseSome(random, mesh1);
    if (random.oneIn(2)) collapseSome(random, mesh2);
    const DeformableMesh first(mesh1), second(mesh2);
    fcl::Transform3d tf1 = random.pose(0.7), tf2 = random.pose(0.7);
    contactRegions(first, tf1, second, tf2, result);
    const SignedCones one(first, tf1), two(second, tf2);
    const exact::Moments in_second = one.inside(two), in_first = two.inside(one);
    const Real tolerance = 1e5L * this->unit();
    expectWhole(first, tf1, second, tf2, result, tolerance);
    ASSERT_LE(std::abs(in_second.volume + in_first.volume - sumOf(result.volumes)), tolerance)
        << step;
    ASSERT_LE(std::abs(in_second.area - sumOf(result.first.areas)), tolerance) << step;
    ASSERT_LE(std::abs(in_first.area - sumOf(result.second.areas)), tolerance) << step;
    regions += long(result.size());
    // The deepest point is so deep, and no vertex is deeper.
    Real depth = 0, deepest = 0;
    for (std::size_t r = 0; r < result.size(); ++r) {
      const exact::Point x = exact::of(result.deepest_points[r]);
      ASSERT_LE(std::abs(result.depths[r] - std::max(one.distance(x), two.distance(x))), tolerance);
      ASSERT_LE(std::min(one.distance(x), two.distance(x)), tolerance);
      depth = std::max<Real>(depth, result.depths[r]);
    }
    const auto tryVertices = [&](const auto& mesh, const auto& tf, const auto& other,
                                 const auto& other_tf, const SignedCones& cones) {
      for (const auto& v : mesh.vertices()) {
        const exact::Point x = exact::placement(tf)(exact::of(v));
        const Real away = cones.distance(x);
        if (away <= deepest + tolerance) continue;
        const exact::Placement place = exact::placement(other_tf);
        const exact::Point local = place.R.transpose() * (x - place.T);
        if (std::lround(windingNumberOf(other, local)) != 0) deepest = away;
      }
    };
    tryVertices(first, tf1, second, tf2, two);
    tryVertices(second, tf2, first, tf1, one);
    ASSERT_GE(depth, deepest - tolerance);
  }
  EXPECT_GT(regions, 4);
}

/// A tube around the z axis, closed: corners on a circle of radius 1.
TriangleMesh cylinder(int around, int rings, double height) {
  TriangleMesh mesh;
  const auto at = [&](int ring, int i) { return std::size_t(ring * around + i % around); };
  for (int r = 0; r <= rings; ++r)
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * M_PI * (i + 0.5) / around;
      mesh.vertices.emplace_back(double(std::cos(angle)), double(std::sin(angle)),
                                 height * (double(r) / double(rings) - 0.5));
    }
  const std::size_t bottom = mesh.vertices.size(), top = bottom + 1;
  mesh.vertices.emplace_back(0., 0., -height / 2);
  mesh.vertices.emplace_back(0., 0., height / 2);
  for (int i = 0; i < around; ++i) {
    mesh.triangles.emplace_back(bottom, at(0, i + 1), at(0, i));
    mesh.triangles.emplace_back(top, at(rings, i), at(rings, i + 1));
    for (int r = 0; r < rings; ++r) {
      mesh.triangles.emplace_back(at(r, i), at(r, i + 1), at(r + 1, i + 1));
      mesh.triangles.emplace_back(at(r, i), at(r + 1, i + 1), at(r + 1, i));
    }
  }
  return mesh;
}

/// Errors at three tessellations, each with edges half as long: they shrink with the square.
void expectSquareOrder(const std::array<Real, 3>& errors, const char* what) {
  for (std::size_t i = 0; i + 1 < 3; ++i) {
    EXPECT_GT(errors[i] / errors[i + 1], 3) << what << ": " << errors[i] << ", " << errors[i + 1];
    EXPECT_LT(errors[i] / errors[i + 1], 5.5) << what << ": " << errors[i];
  }
}

TEST(ContactRegionShapes, OfSpheresConvergeToCaps) {
  const double apart = 1.4, pi = std::acos(-1.);
  std::array<Real, 3> volumes, areas, depths, centroids;
  for (std::size_t level = 0; level < 3; ++level) {
    const int n = 16 << level;
    const DeformableMesh ball(gridBall(2 * n, n - 1));
    fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
    const Eigen::Vector3d towards = Eigen::Vector3d(0.3, -0.2, 1).normalized();
    tf2.translation() = apart * towards;
    ContactRegions result;
    ASSERT_EQ(1u, contactRegions(ball, tf1, ball, tf2, result));
    ASSERT_EQ(1u, result.numCurves());
    volumes[level] =
        std::abs(result.volumes[0] - pi * (4 + apart) * (2 - apart) * (2 - apart) / 12);
    areas[level] = std::abs(result.first.areas[0] - 2 * pi * (1 - apart / 2)) +
                   std::abs(result.second.areas[0] - 2 * pi * (1 - apart / 2));
    depths[level] = std::abs(result.depths[0] - (2 - apart));
    // The centroid of a cap lies in the middle of its height.
    centroids[level] = (result.first.centroids[0] - (1 + apart / 2) / 2 * towards).norm();
    EXPECT_LE((result.normals[0] - towards).norm(), 1. / (n * n));
    for (const auto& x : result.curve_points) EXPECT_NEAR(apart / 2, x.dot(towards), 20. / (n * n));
  }
  expectSquareOrder(volumes, "volume");
  expectSquareOrder(areas, "area");
  EXPECT_LT(centroids[2], centroids[0] / 8);
  EXPECT_LT(depths[0], 0.02);
  EXPECT_LT(depths[2], 0.002);
}

/// Two cylinders of the same radius that cross: Steinmetz.
TEST(ContactRegionShapes, OfCrossingCylindersConverge) {
  std::array<Real, 3> volumes, areas;
  for (std::size_t level = 0; level < 3; ++level) {
    const int n = 24 << level;
    const DeformableMesh tube(cylinder(n, n / 4, 4.));
    const fcl::Transform3d tf1 = fcl::Transform3d::Identity();
    fcl::Transform3d tf2 = tf1;
    tf2.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    ContactRegions result;
    ASSERT_EQ(1u, contactRegions(tube, tf1, tube, tf2, result));
    volumes[level] = std::abs(result.volumes[0] - 16. / 3);
    areas[level] = std::abs(result.first.areas[0] + result.second.areas[0] - 16);
  }
  expectSquareOrder(volumes, "volume");
  expectSquareOrder(areas, "area");
}

/// [0, size] along each axis, of twelve triangles.
TriangleMesh block(const fcl::Vector3d& size) {
  TriangleMesh mesh = latticeBox(1);
  for (fcl::Vector3d& p : mesh.vertices) p = p.cwiseProduct(size);
  return mesh;
}

/// Cavities and holes: a curve inside one triangle, and a surface that no curve joins.
TEST_F(ContactRegion, JoinHolesAndCavities) {
  using V = fcl::Vector3d;
  const double tolerance = double(400 * this->unit());
  Regions result;
  // A shell and the ball between its surfaces: nothing crosses.
  TriangleMesh shell = block(V(6, 6, 6));
  addSurface(block(V(2, 2, 2)), V(2, 2, 2), true, shell);
  const DeformableMesh hollow(shell), middle(block(V(4, 4, 4)));
  ASSERT_EQ(1u, contactRegions(middle, this->moved(1, 1, 1), hollow, this->still(), result));
  EXPECT_EQ(0u, result.numCurves());
  EXPECT_NEAR(double(64 - 8), result.volumes[0], 64 * tolerance);
  EXPECT_NEAR(96., result.first.areas[0], 96 * tolerance);
  EXPECT_NEAR(24., result.second.areas[0], 96 * tolerance);
  EXPECT_EQ(V(3, 3, 3), result.first.centroids[0]);
  EXPECT_EQ(V::Zero(), result.normals[0]);
  EXPECT_NEAR(1., result.depths[0], tolerance);
  // Two of them: each has its cavity.
  TriangleMesh shells = shell, bodies = block(V(4, 4, 4));
  addSurface(shell, V(7, 0, 0), false, shells);
  addSurface(block(V(4, 4, 4)), V(7, 0, 0), false, bodies);
  const DeformableMesh two(shells), both(bodies);
  ASSERT_EQ(2u, contactRegions(both, this->moved(1, 1, 1), two, this->still(), result));
  for (const double volume : result.volumes) EXPECT_NEAR(double(64 - 8), volume, 64 * tolerance);
  // A pole that enters one triangle of a block, and leaves by another, of a body or of a cavity.
  const double turn = 0.3;
  fcl::Transform3d tf = this->moved(0.9, 1.9, -3);
  tf.linear() = Eigen::AngleAxis<double>(turn, V::UnitZ()).toRotationMatrix();
  const DeformableMesh cube(block(V(4, 4, 4))), pole(block(V(0.5, 0.5, 10)));
  ASSERT_EQ(1u, contactRegions(cube, this->still(), pole, tf, result));
  EXPECT_EQ(2u, result.numCurves());
  EXPECT_NEAR(1., result.volumes[0], 64 * tolerance);
  EXPECT_NEAR(0.5, result.first.areas[0], 64 * tolerance);
  EXPECT_NEAR(8., result.second.areas[0], 64 * tolerance);
  EXPECT_EQ(2u, result.first.triangles.size());
  EXPECT_EQ(8u, result.second.triangles.size());
  TriangleMesh tunnel = block(V(20, 20, 20));
  for (V& p : tunnel.vertices) p -= V(10, 10, 10);
  TriangleMesh inner = block(V(0.5, 0.5, 10));
  for (V& p : inner.vertices) p = tf * p;
  addSurface(inner, V(0, 0, 0), true, tunnel);
  ASSERT_EQ(1u, contactRegions(cube, this->still(), DeformableMesh(tunnel), this->still(), result));
  EXPECT_EQ(2u, result.numCurves());
  EXPECT_NEAR(63., result.volumes[0], 64 * tolerance);
  EXPECT_NEAR(95.5, result.first.areas[0], 640 * tolerance);
  // A pipe through a triangle: its part is a ring, and within it is another pole's.
  TriangleMesh pipe = block(V(1, 1, 10)), hole = block(V(0.75, 0.75, 9));
  addSurface(hole, V(0.125, 0.125, 0.5), true, pipe);
  addSurface(block(V(0.25, 0.25, 8)), V(0.375, 0.375, 1), false, pipe);
  ASSERT_EQ(2u, contactRegions(cube, this->still(), DeformableMesh(pipe),
                               this->moved(0.5, 1.75, -2), result));
  EXPECT_EQ(6u, result.numCurves());
  const double ring = double(1 - 0.75 * 0.75), core = 0.0625;
  EXPECT_NEAR(4 * (ring + core), double(sumOf(result.volumes)), 64 * tolerance);
  EXPECT_NEAR(4 * core, std::min(result.volumes[0], result.volumes[1]), 64 * tolerance);
}

/// A body with itself: every vertex lies on a vertex, every face on a face.
TEST_F(ContactRegion, OfCoincidentBodiesIsTheBody) {
  Regions result;
  for (const TriangleMesh& mesh : {latticeBox(3), gridBall(9, 7), block({1, 2, 3})}) {
    const DeformableMesh body(mesh);
    const auto tf = this->moved(0.5, -2., 1.);
    ASSERT_GE(contactRegions(body, tf, body, tf, result), 1u);
    exact::Moments whole;
    for (const fcl::Triangle& t : mesh.triangles)
      whole.add({exact::of(mesh.vertices[t[0]]), exact::of(mesh.vertices[t[1]]),
                 exact::of(mesh.vertices[t[2]])});
    EXPECT_LE(std::abs(whole.volume - sumOf(result.volumes)), 1000 * this->unit() * whole.volume);
    // Each face counts for one of both.
    EXPECT_LE(std::abs(whole.area - sumOf(result.first.areas) - sumOf(result.second.areas)),
              1000 * this->unit() * whole.area);
    for (const double depth : result.depths) EXPECT_LE(depth, double(100 * this->unit()));
  }
}

TEST_F(ContactRegion, RefusesWhatItCannotAnswer) {
  const DeformableMesh closed(latticeBox(2)), open(plate(2, 2));
  Regions result;
  ASSERT_EQ(1u, contactRegions(closed, this->moved(1, 1, 1), closed, this->still(), result));
  auto scaled = this->still();
  scaled.linear() *= 1.1;
  EXPECT_THROW(contactRegions(closed, scaled, closed, this->still(), result),
               std::invalid_argument);
  EXPECT_THROW(contactRegions(closed, this->still(), closed, scaled, result),
               std::invalid_argument);
  for (const bool is_first : {false, true}) {
    try {
      contactRegions(is_first ? open : closed, this->still(), is_first ? closed : open,
                     this->still(), result);
      FAIL() << "an open mesh";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find("the edge from vertex"));
    }
  }
  EXPECT_EQ(1u, result.size());
  EXPECT_NEAR(1., result.volumes[0], double(10 * this->unit()));
  EXPECT_EQ(0u, contactRegions(closed, this->moved(9, 0, 0), closed, this->still(), result));
  EXPECT_EQ(0u, result.numCurves());
}

}  // namespace contact_regions_test
}  // namespace adaptive_bvh_test
