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

template <typename S>
class ContactRegion : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Regions = ContactRegions<S>;

  static fcl::Transform3<S> still() { return fcl::Transform3<S>::Identity(); }
  static fcl::Transform3<S> moved(S x, S y, S z) {
    fcl::Transform3<S> tf = still();
    tf.translation() = Vector3<S>(x, y, z);
    return tf;
  }
  static Real unit() { return std::numeric_limits<S>::epsilon(); }

  RandomGeometry<S> random_{413};
};

TYPED_TEST_SUITE(ContactRegion, MeshScalars);

template <typename S>
Real sumOf(const std::vector<S>& numbers) {
  Real sum = 0;
  for (const S x : numbers) sum += x;
  return sum;
}

/// A rotation by quarter turns, without rounding.
template <typename S>
fcl::Matrix3<S> quarterTurns(RandomGeometry<S>& random) {
  fcl::Matrix3<S> turn = fcl::Matrix3<S>::Zero();
  const int first = random.below(3), second = (first + 1 + random.below(2)) % 3;
  turn(first, 0) = random.oneIn(2) ? S(1) : S(-1);
  turn(second, 1) = random.oneIn(2) ? S(1) : S(-1);
  turn.col(2) = turn.col(0).cross(turn.col(1));
  return turn;
}

/// What holds of every result: arrays fit together, and curves follow the two meshes.
template <typename S>
void expectWhole(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                 const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                 const ContactRegions<S>& result, Real tolerance) {
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
  ASSERT_EQ(result.numCurves() + 1, result.curve_begins.size());
  ASSERT_EQ(result.curve_points.size(), result.curve_begins.back());
  ASSERT_TRUE(std::is_sorted(result.curve_regions.begin(), result.curve_regions.end()));
  const auto corners = [](const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
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
TYPED_TEST(ContactRegion, OfTetrahedraEqualClippedPolyhedra) {
  using S = TypeParam;
  auto& random = this->random_;
  typename TestFixture::Regions result;
  long crossing = 0, nested = 0;
  for (int step = 0; step < manySteps(4000); ++step) {
    std::array<TriangleMesh<S>, 2> meshes;
    std::array<exact::Tetrahedron, 2> bodies;
    const fcl::Transform3<S> tf[2] = {random.pose(S(0.3)), random.pose(S(0.3))};
    for (std::size_t b = 0; b < 2; ++b) {
      const Vector3<S> shape(1, random.oneIn(3) ? random.size(-3, 0) : S(1),
                             random.oneIn(3) ? random.size(-2, 0) : S(1));
      const S scale = random.oneIn(4) ? random.size(-1, 0.5) : S(1);
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
    const DeformableMesh<S> first(meshes[0]), second(meshes[1]);
    contactRegions(first, tf[0], second, tf[1], result);
    const exact::Moments in_second = exact::insideOf(bodies[0], bodies[1]),
                         in_first = exact::insideOf(bodies[1], bodies[0]);
    const Real volume = exact::commonVolume(bodies[0], bodies[1]);
    const Real size = 4, tolerance = 4000 * this->unit() * size;
    expectWhole(first, tf[0], second, tf[1], result, tolerance);
    ASSERT_LE(result.size(), 1u);
    ASSERT_NEAR(volume, sumOf(result.volumes), tolerance) << step;
    ASSERT_NEAR(in_second.area, sumOf(result.first.areas), tolerance * size) << step;
    ASSERT_NEAR(in_first.area, sumOf(result.second.areas), tolerance * size) << step;
    if (result.size() == 0) continue;
    ++(result.numCurves() > 0 ? crossing : nested);
    const auto expectCentroid = [&](const exact::Moments& m, const Vector3<S>& found) {
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
  EXPECT_GT(nested, 10);
}

/// Bodies of cubes on one lattice, or on two: faces coincide, edges lie on edges.
TYPED_TEST(ContactRegion, OfVoxelBodiesEqualCells) {
  using S = TypeParam;
  auto& random = this->random_;
  typename TestFixture::Regions result;
  long regions = 0, touching = 0;
  for (int step = 0; step < manySteps(300); ++step) {
    const VoxelBody one = VoxelBody::random(random), two = VoxelBody::random(random);
    const S size = random.oneIn(2) ? S(1) : S(0.25) * S(1 + random.below(6));
    std::array<double, 3> origin;
    const S grid = random.oneIn(2) ? S(1) : S(0.125);
    for (double& x : origin) x = double(grid) * std::round(random.uniform(-2, 3) / grid);
    const DeformableMesh<S> first(one.surface(S(1))), second(two.surface(size));
    fcl::Transform3<S> tf1 = this->still(), tf2 = this->still();
    if (random.oneIn(2)) {
      tf1.linear() = quarterTurns(random);
      tf1.translation() = Vector3<S>(S(random.below(5)), S(random.below(5)), S(-2));
    }
    tf2.linear() = tf1.linear();
    tf2.translation() = tf1 * Vector3<S>(S(origin[0]), S(origin[1]), S(origin[2]));
    contactRegions(first, tf1, second, tf2, result);
    const VoxelOverlap overlap(one, two, double(size), origin);
    const Real tolerance = 200 * this->unit();
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
      ASSERT_NEAR(expected.volume, found[r].volume, double(tolerance)) << step;
      ASSERT_NEAR(expected.first_area, found[r].first_area, double(tolerance)) << step;
      ASSERT_NEAR(expected.second_area, found[r].second_area, double(tolerance)) << step;
      ++regions;
      touching += expected.volume == 0;
    }
  }
  EXPECT_GT(regions, 200);
  EXPECT_GT(touching, 20);
}

}  // namespace contact_regions_test
}  // namespace adaptive_bvh_test
