// Regions of bodies of boxes on a lattice, whose faces coincide, with cavities: counted in whole
// numbers, cell by cell. In any order, of any orientation, of any size, and turned in space.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>

#include "adaptive_bvh/contact_regions.h"
#include "support/box_bodies.h"
#include "support/closed_bodies.h"

namespace adaptive_bvh_test {
namespace coinciding_test {

using adaptive_bvh::contactRegions;
using adaptive_bvh::ContactRegions;
using adaptive_bvh::DeformableMesh;
using Corner = BoxBody::Corner;
using Regions = std::vector<BoxOverlap::Region>;

fcl::Transform3d moved(double x, double y, double z) {
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.translation() = fcl::Vector3d(x, y, z);
  return tf;
}

BoxBody bodyOf(std::initializer_list<BoxBody::Box> boxes) {
  BoxBody body;
  for (const BoxBody::Box& box : boxes) body.add(box.low, box.high, box.sign);
  return body;
}

/// Two bodies, and where the second is.
struct Case {
  BoxBody first, second;
  Corner offset{};

  static Case random(RandomGeometry& random) {
    Case bodies;
    while (bodies.first.isEmpty()) bodies.first = BoxBody::random(random);
    while (bodies.second.isEmpty()) bodies.second = BoxBody::random(random);
    if (random.oneIn(20)) bodies.second = bodies.first;
    for (int& x : bodies.offset) x = random.below(3) - 1;
    return bodies;
  }
  fcl::Transform3d place(double size = 1) const {
    return moved(size * double(offset[0]), size * double(offset[1]), size * double(offset[2]));
  }
};

/// What was found, in whole numbers; of the normals only what is asked for.
Regions foundIn(const ContactRegions& result, double size = 1) {
  Regions found;
  for (std::size_t r = 0; r < result.size(); ++r) {
    BoxOverlap::Region region;
    region.volume = std::lround(result.volumes[r] / size / size / size);
    region.first_area = std::lround(result.first.areas[r] / size / size);
    region.second_area = std::lround(result.second.areas[r] / size / size);
    EXPECT_NEAR(double(region.volume), double(result.volumes[r] / size / size / size), 1e-2);
    EXPECT_GE(result.volumes[r], 0);
    found.push_back(region);
  }
  std::sort(found.begin(), found.end());
  return found;
}

Regions withoutNormals(Regions regions) {
  for (BoxOverlap::Region& region : regions) region.normal = {};
  std::sort(regions.begin(), regions.end());
  return regions;
}

/// Mean normals with the volumes of their regions, in thousandths, of regions with a volume.
using Normals = std::vector<std::array<long, 4>>;

std::array<long, 4> keyOf(long volume, const fcl::Vector3d& normal) {
  return {volume, std::lround(1000 * normal[0]), std::lround(1000 * normal[1]),
          std::lround(1000 * normal[2])};
}
Normals expectedNormals(const Regions& regions) {
  Normals normals;
  for (const BoxOverlap::Region& region : regions) {
    if (region.volume == 0) continue;
    fcl::Vector3d sum(double(region.normal[0]), double(region.normal[1]), double(region.normal[2]));
    normals.push_back(keyOf(region.volume, sum.norm() > 0 ? sum.normalized() : sum));
  }
  std::sort(normals.begin(), normals.end());
  return normals;
}

Normals normalsIn(const ContactRegions& result, const fcl::Matrix3d& turn, double sense = 1) {
  Normals normals;
  for (std::size_t r = 0; r < result.size(); ++r) {
    const fcl::Vector3d normal = (turn.transpose() * result.normals[r]);
    const long volume = std::lround(result.volumes[r]);
    if (volume > 0) normals.push_back(keyOf(volume, sense * normal));
  }
  std::sort(normals.begin(), normals.end());
  return normals;
}

class CoincidingRegions : public testing::Test {
 protected:
  ContactRegions result_;
  RandomGeometry random_{911};
};

/// Volumes, areas and normals, whichever way the triangles of either body face.
TEST_F(CoincidingRegions, OfBoxesEqualCells) {
  long regions = 0, several = 0;
  for (int step = 0; step < manySteps(1000); ++step) {
    const Case bodies = Case::random(this->random_);
    const BoxOverlap overlap(bodies.first, bodies.second, bodies.offset);
    const bool turns1 = this->random_.oneIn(3), turns2 = this->random_.oneIn(3);
    const DeformableMesh first(bodies.first.surface(1., turns1)),
        second(bodies.second.surface(1., turns2));
    contactRegions(first, moved(0, 0, 0), second, bodies.place(), this->result_);
    ASSERT_EQ(withoutNormals(overlap.regions()), foundIn(this->result_)) << step;
    ASSERT_EQ(expectedNormals(overlap.regions()),
              normalsIn(this->result_, fcl::Matrix3d::Identity()))
        << step;
    regions += long(overlap.regions().size());
    several += overlap.regions().size() > 1;
  }
  EXPECT_GT(regions, manySteps(500));
  EXPECT_GT(several, manySteps(100));
}

/// Where no face touches another from outside, the regions of both orders are the same, and so are
/// the normals, but for their sign.
TEST_F(CoincidingRegions, SwappedHaveOppositeNormals) {
  const fcl::Matrix3d still = fcl::Matrix3d::Identity();
  ContactRegions swapped;
  int compared = 0;
  for (int step = 0; step < manySteps(1000); ++step) {
    const Case bodies = Case::random(this->random_);
    const DeformableMesh first(bodies.first.surface(1.)), second(bodies.second.surface(1.));
    contactRegions(first, moved(0, 0, 0), second, bodies.place(), this->result_);
    contactRegions(second, bodies.place(), first, moved(0, 0, 0), swapped);
    const Normals normals = normalsIn(this->result_, still),
                  opposite = normalsIn(swapped, still, -1);
    const auto volumesOf = [](const Normals& all) {
      std::vector<long> volumes;
      for (const auto& normal : all) volumes.push_back(normal[0]);
      return volumes;
    };
    if (volumesOf(normals) != volumesOf(opposite)) continue;  // what touches connects others
    ASSERT_EQ(normals, opposite) << step;
    ++compared;
  }
  EXPECT_GT(compared, manySteps(800));
}

/// In a common pose, which rounds positions: faces that coincide cross anywhere.
TEST_F(CoincidingRegions, TurnedInSpaceKeepVolumesAndNormals) {
  int compared = 0;
  for (int step = 0; step < manySteps(500); ++step) {
    const Case bodies = Case::random(this->random_);
    const Regions expected = BoxOverlap(bodies.first, bodies.second, bodies.offset).regions();
    const DeformableMesh first(bodies.first.surface(1.)), second(bodies.second.surface(1.));
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = Eigen::AngleAxis<double>(this->random_.uniform(-3, 3), this->random_.direction())
                      .toRotationMatrix();
    tf.translation() = 5. * this->random_.point();
    contactRegions(first, tf, second, tf * bodies.place(), this->result_);
    long volume = 0;
    for (const BoxOverlap::Region& region : expected) volume += region.volume;
    double sum = 0;
    for (const double part : this->result_.volumes) sum += double(part);
    ASSERT_NEAR(double(volume), sum, 0.02) << step;
    const Normals wanted = expectedNormals(expected), found = normalsIn(this->result_, tf.linear());
    if (wanted.size() != 1 || found.size() != 1) continue;
    for (std::size_t k = 1; k < 4; ++k) ASSERT_NEAR(wanted[0][k], found[0][k], 3) << step;
    ++compared;
  }
  EXPECT_GT(compared, manySteps(200));
}

/// Boxes with flush sides: the side walls coincide, and the normal is the axis.
TEST_F(CoincidingRegions, OfFlushBoxesHaveTheAxis) {
  using V = fcl::Vector3d;
  const DeformableMesh cube(latticeBox(1)), fine(latticeBox(4));
  for (int axis = 0; axis < 3; ++axis)
    for (const double by : {0.9, 0.1, 1., -0.9}) {
      const V shift = by * V::Unit(axis), expected = by > 0 ? V::Unit(axis) : V(-V::Unit(axis));
      const std::size_t regions = contactRegions(
          cube, moved(0, 0, 0), cube, moved(shift[0], shift[1], shift[2]), this->result_);
      ASSERT_EQ(1u, regions);
      EXPECT_LT((this->result_.normals[0] - expected).norm(), 1e-6) << axis << ", " << by;
    }
  // However little they overlap.
  for (int i = 0; i < std::numeric_limits<double>::digits + 3; ++i) {
    const double by = 1 - std::ldexp(1., -i);
    const auto tf = this->random_.pose(3.);
    if (contactRegions(cube, tf, cube, tf * moved(by, 0, 0), this->result_) == 0) continue;
    EXPECT_LT((this->result_.normals[0] - (by > 0 ? tf.linear().col(0) : V(V::Zero()))).norm(),
              1e-3)
        << i;
  }
  // Walls across y are common, and do not count.
  ASSERT_EQ(1u, contactRegions(fine, moved(0, 0, 0), fine, moved(3, 0, 2), this->result_));
  const V normal = this->result_.normals[0];
  ASSERT_EQ(1u, contactRegions(fine, moved(3, 0, 2), fine, moved(0, 0, 0), this->result_));
  EXPECT_LT((normal - V(2, 0, 1).normalized()).norm(), 1e-6);
  EXPECT_LT((normal + this->result_.normals[0]).norm(), 1e-6);
  // The same body twice.
  ASSERT_EQ(1u, contactRegions(fine, moved(0, 0, 0), fine, moved(0, 0, 0), this->result_));
  EXPECT_EQ(V::Zero(), this->result_.normals[0]);
}

/// A body whose triangles all face inward has the regions of the same body that faces outward.
TEST_F(CoincidingRegions, DoNotDependOnOrientation) {
  ContactRegions turned;
  const double tolerance = 1e4 * std::numeric_limits<double>::epsilon();
  const auto insideOut = [](const TriangleMesh& mesh) {
    TriangleMesh other;
    addSurface(mesh, fcl::Vector3d(0, 0, 0), true, other);
    return DeformableMesh(other);
  };
  for (int step = 0; step < manySteps(50); ++step) {
    const TriangleMesh one = gridBall(7, 6), two = latticeBox(2);
    const auto tf1 = this->random_.pose(1.5), tf2 = this->random_.pose(1.5);
    contactRegions(DeformableMesh(one), tf1, DeformableMesh(two), tf2, this->result_);
    for (int turns = 1; turns < 4; ++turns) {
      const DeformableMesh first = turns % 2 ? insideOut(one) : DeformableMesh(one),
                           second = turns > 1 ? insideOut(two) : DeformableMesh(two);
      contactRegions(first, tf1, second, tf2, turned);
      ASSERT_EQ(this->result_.size(), turned.size());
      for (std::size_t r = 0; r < turned.size(); ++r) {
        EXPECT_GE(turned.volumes[r], 0);
        EXPECT_NEAR(this->result_.volumes[r], turned.volumes[r], tolerance);
        EXPECT_NEAR(this->result_.first.areas[r], turned.first.areas[r], tolerance);
        EXPECT_NEAR(this->result_.second.areas[r], turned.second.areas[r], tolerance);
        EXPECT_NEAR(this->result_.depths[r], turned.depths[r], tolerance);
        const double area = turned.first.areas[r];
        EXPECT_LE((this->result_.normals[r] - turned.normals[r]).norm() * area, tolerance);
      }
      ASSERT_EQ(this->result_.curve_first, turned.curve_first);
      ASSERT_EQ(this->result_.curve_second, turned.curve_second);
      for (std::size_t i = 0; i < turned.curve_points.size(); ++i)
        EXPECT_LE((this->result_.curve_points[i] - turned.curve_points[i]).norm(), tolerance);
    }
  }
}

/// A box in a cavity in a box, and so on.
TEST_F(CoincidingRegions, OfNestsEqualCells) {
  constexpr int kSide = 12, kDepth = 5;
  for (int step = 0; step < manySteps(200); ++step) {
    const auto nest = [&] {
      return BoxBody::nest(1 + this->random_.below(kDepth), kSide, this->random_);
    };
    Case bodies{nest(), nest()};
    for (int& x : bodies.offset) x = this->random_.below(5) - 2;
    const BoxOverlap overlap(bodies.first, bodies.second, bodies.offset, kSide);
    const DeformableMesh first(bodies.first.surface(1., this->random_.oneIn(3))),
        second(bodies.second.surface(1., this->random_.oneIn(3)));
    contactRegions(first, moved(0, 0, 0), second, bodies.place(), this->result_);
    ASSERT_EQ(withoutNormals(overlap.regions()), foundIn(this->result_)) << step;
  }
}

/// Cubes in each other around a point, from these half sides, every second one a cavity.
DeformableMesh cubesAround(const Corner& at, std::initializer_list<int> halves) {
  BoxBody body;
  int sign = 1;
  for (const int half : halves) {
    body.add({at[0] - half, at[1] - half, at[2] - half}, {at[0] + half, at[1] + half, at[2] + half},
             sign);
    sign = -sign;
  }
  return DeformableMesh(body.surface(1.));
}

/// In either order: two regions with a cavity each, where every wall is thinner than the space
/// inside; and walls that pass through one triangle of a face, of which they cut rings.
TEST_F(CoincidingRegions, OfNestedCubesHaveTheirOwnCavities) {
  const auto tf = moved(0, 0, 0);
  const auto cube = [](long side) -> long { return side * side * side; };
  const auto expectVolumes = [&](const auto& a, const auto& b, std::vector<long> expected) {
    for (const bool is_swapped : {false, true}) {
      contactRegions(is_swapped ? b : a, tf, is_swapped ? a : b, tf, this->result_);
      std::vector<long> volumes;
      for (const BoxOverlap::Region& region : foundIn(this->result_))
        volumes.push_back(region.volume);
      EXPECT_EQ(volumes, expected);
    }
  };
  const auto three = cubesAround({0, 0, 0}, {12, 11, 10}), two = cubesAround({0, 0, 0}, {12, 8});
  expectVolumes(three, two, {cube(24) - cube(22), cube(20) - cube(16)});
  const auto five = cubesAround({500, 0, 1000}, {12, 11, 10, 8, 7}),
             block = cubesAround({0, 0, 0}, {1000});
  expectVolumes(five, block, {cube(14) / 2, (cube(24) - cube(22)) / 2, (cube(20) - cube(16)) / 2});
}

/// A cavity touches the outer surface of its region, and there is another region, whichever
/// triangle comes first.
TEST_F(CoincidingRegions, HaveCavitiesThatTouchTheirSurface) {
  const BoxBody first = bodyOf({{{0, 0, 0}, {3, 3, 3}, 1}, {{10, 0, 0}, {11, 1, 1}, 1}});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    BoxBody::Box cavity = {{1, 1, 1}, {2, 2, 2}, -1};
    cavity.high[axis] = 3;
    const BoxBody second =
        bodyOf({{{-1, -1, -1}, {4, 4, 4}, 1}, cavity, {{9, -1, -1}, {12, 2, 2}, 1}});
    for (int turns = 0; turns < 12; ++turns) {
      TriangleMesh surface = second.surface(1.);
      std::rotate(surface.triangles.begin(), surface.triangles.begin() + 12 + turns,
                  surface.triangles.end());
      const DeformableMesh one(first.surface(1.)), two(surface);
      for (const bool swaps : {false, true}) {
        contactRegions(swaps ? two : one, moved(0, 0, 0), swaps ? one : two, moved(0, 0, 0),
                       this->result_);
        const Regions found = foundIn(this->result_);
        ASSERT_EQ(2u, found.size());
        EXPECT_EQ(1, found[0].volume);
        EXPECT_EQ(25, found[1].volume);
      }
    }
  }
}

/// The same, but for one more rounding where it is too small to have all digits.
void expectScaled(double expected, int exponent, double found) {
  EXPECT_LE(std::abs(std::ldexp(expected, exponent) - found),
            std::numeric_limits<double>::denorm_min());
}

/// Powers of two scale every result exactly, also where volumes underflow.
TEST_F(CoincidingRegions, ScaleExactly) {
  const int most = std::numeric_limits<double>::max_exponent / 4 - 10,
            least = std::numeric_limits<double>::min_exponent / 2 +
                    std::numeric_limits<double>::digits + 10;
  ContactRegions scaled;
  const auto compare = [&](int exponent) {
    const ContactRegions& result = this->result_;
    const double size = std::ldexp(1., exponent);
    ASSERT_EQ(result.size(), scaled.size());
    for (std::size_t r = 0; r < scaled.size(); ++r) {
      expectScaled(result.volumes[r], 3 * exponent, scaled.volumes[r]);
      expectScaled(result.first.areas[r], 2 * exponent, scaled.first.areas[r]);
      expectScaled(result.second.areas[r], 2 * exponent, scaled.second.areas[r]);
      expectScaled(result.depths[r], exponent, scaled.depths[r]);
      EXPECT_EQ(result.normals[r], scaled.normals[r]);
      EXPECT_EQ(size * result.deepest_points[r], scaled.deepest_points[r]);
      EXPECT_EQ(size * result.first.centroids[r], scaled.first.centroids[r]);
    }
    ASSERT_EQ(result.curve_points.size(), scaled.curve_points.size());
    for (std::size_t i = 0; i < scaled.curve_points.size(); ++i)
      EXPECT_EQ(size * result.curve_points[i], scaled.curve_points[i]);
  };
  for (int step = 0; step < manySteps(100) && !this->HasFailure(); ++step) {
    const Case bodies = Case::random(this->random_);
    const DeformableMesh first(bodies.first.surface(1.)), second(bodies.second.surface(1.));
    contactRegions(first, moved(0, 0, 0), second, bodies.place(1.), this->result_);
    for (int i = 0; i < 10; ++i) {
      const int exponent = least + this->random_.below(most - least + 1);
      SCOPED_TRACE(testing::Message() << step << ", times 2^" << exponent);
      const double size = std::ldexp(1., exponent);
      const DeformableMesh one(bodies.first.surface(size)), two(bodies.second.surface(size));
      contactRegions(one, moved(0, 0, 0), two, bodies.place(size), scaled);
      compare(exponent);
    }
  }
}

/// The tetrahedron (0, 0, 0), (s, 0, 0), (0, s, 0), (0, 0, s) and its copy, and two cubes.
TEST(TinyRegions, HaveAnswers) {
  for (const double size : {1., 0x1p-120, 0x1p-340, 0x1p-358, 0x1p-400, 0x1p-480}) {
    SCOPED_TRACE(size);
    const DeformableMesh tetrahedron(
        {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0, 0, size}},
        std::vector<fcl::Triangle>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
    ContactRegions result;
    ASSERT_EQ(1u, contactRegions(tetrahedron, moved(0, 0, 0), tetrahedron,
                                 moved(.2 * size, .1 * size, .3 * size), result));
    // What is common is a tetrahedron with legs of 1 - .6.
    if (size > 0x1p-300) {
      EXPECT_NEAR(.4 * .4 * .4 / 6, result.volumes[0] / size / size / size, 1e-12);
    }
    EXPECT_NEAR(.4 * .4 * std::sqrt(3.) / 2, result.first.areas[0] / size / size, 1e-12);
    EXPECT_NEAR(3 * .4 * .4 / 2, result.second.areas[0] / size / size, 1e-12);
    const DeformableMesh cube([&] {
      auto mesh = latticeBox(1);
      for (fcl::Vector3d& x : mesh.vertices) x *= size;
      return mesh;
    }());
    ASSERT_EQ(1u, contactRegions(cube, moved(0, 0, 0), cube, moved(.7 * size, .4 * size, .2 * size),
                                 result));
    EXPECT_NEAR(.3 * .6 + .3 * .8 + .6 * .8, result.first.areas[0] / size / size, 1e-12);
    EXPECT_NEAR(.3, result.depths[0] / size, .2);
  }
}

}  // namespace coinciding_test
}  // namespace adaptive_bvh_test
