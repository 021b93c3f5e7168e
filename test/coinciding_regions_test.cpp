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
namespace coinciding_regions_test {

using adaptive_bvh::contactRegions;
using adaptive_bvh::ContactRegions;
using adaptive_bvh::DeformableMesh;
using Corner = BoxBody::Corner;
using Regions = std::vector<BoxOverlap::Region>;

template <typename S>
fcl::Transform3<S> moved(S x, S y, S z) {
  fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  tf.translation() = Vector3<S>(x, y, z);
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

  template <typename S>
  static Case random(RandomGeometry<S>& random) {
    Case bodies;
    while (bodies.first.isEmpty()) bodies.first = BoxBody::random(random);
    while (bodies.second.isEmpty()) bodies.second = BoxBody::random(random);
    if (random.oneIn(20)) bodies.second = bodies.first;
    for (int& x : bodies.offset) x = random.below(3) - 1;
    return bodies;
  }
  template <typename S>
  fcl::Transform3<S> place(S size = 1) const {
    return moved<S>(size * S(offset[0]), size * S(offset[1]), size * S(offset[2]));
  }
};

/// What was found, in whole numbers; of the normals only what is asked for.
template <typename S>
Regions foundIn(const ContactRegions<S>& result, S size = 1) {
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
template <typename S>
Normals normalsIn(const ContactRegions<S>& result, const fcl::Matrix3<S>& turn, double sense = 1) {
  Normals normals;
  for (std::size_t r = 0; r < result.size(); ++r) {
    const fcl::Vector3d normal = (turn.transpose() * result.normals[r]).template cast<double>();
    const long volume = std::lround(result.volumes[r]);
    if (volume > 0) normals.push_back(keyOf(volume, sense * normal));
  }
  std::sort(normals.begin(), normals.end());
  return normals;
}

template <typename S>
class CoincidingRegions : public testing::Test {
 protected:
  ContactRegions<S> result_;
  RandomGeometry<S> random_{911};
};

TYPED_TEST_SUITE(CoincidingRegions, MeshScalars);

/// Volumes, areas and normals, whichever way the triangles of either body face.
TYPED_TEST(CoincidingRegions, OfBoxesEqualCells) {
  using S = TypeParam;
  long regions = 0, several = 0;
  for (int step = 0; step < manySteps(1000); ++step) {
    const Case bodies = Case::random(this->random_);
    const BoxOverlap overlap(bodies.first, bodies.second, bodies.offset);
    const bool turns1 = this->random_.oneIn(3), turns2 = this->random_.oneIn(3);
    const DeformableMesh<S> first(bodies.first.surface(S(1), turns1)),
        second(bodies.second.surface(S(1), turns2));
    contactRegions(first, moved<S>(0, 0, 0), second, bodies.template place<S>(), this->result_);
    ASSERT_EQ(withoutNormals(overlap.regions()), foundIn(this->result_)) << step;
    ASSERT_EQ(expectedNormals(overlap.regions()),
              normalsIn<S>(this->result_, fcl::Matrix3<S>::Identity()))
        << step;
    regions += long(overlap.regions().size());
    several += overlap.regions().size() > 1;
  }
  EXPECT_GT(regions, manySteps(500));
  EXPECT_GT(several, manySteps(100));
}

/// Where no face touches another from outside, the regions of both orders are the same, and so are
/// the normals, but for their sign.
TYPED_TEST(CoincidingRegions, SwappedHaveOppositeNormals) {
  using S = TypeParam;
  const fcl::Matrix3<S> still = fcl::Matrix3<S>::Identity();
  ContactRegions<S> swapped;
  int compared = 0;
  for (int step = 0; step < manySteps(1000); ++step) {
    const Case bodies = Case::random(this->random_);
    const DeformableMesh<S> first(bodies.first.surface(S(1))), second(bodies.second.surface(S(1)));
    contactRegions(first, moved<S>(0, 0, 0), second, bodies.template place<S>(), this->result_);
    contactRegions(second, bodies.template place<S>(), first, moved<S>(0, 0, 0), swapped);
    const Normals normals = normalsIn<S>(this->result_, still),
                  opposite = normalsIn<S>(swapped, still, -1);
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
TYPED_TEST(CoincidingRegions, TurnedInSpaceKeepVolumesAndNormals) {
  using S = TypeParam;
  int compared = 0;
  for (int step = 0; step < manySteps(500); ++step) {
    const Case bodies = Case::random(this->random_);
    const Regions expected = BoxOverlap(bodies.first, bodies.second, bodies.offset).regions();
    const DeformableMesh<S> first(bodies.first.surface(S(1))), second(bodies.second.surface(S(1)));
    fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
    tf.linear() = Eigen::AngleAxis<S>(this->random_.uniform(-3, 3), this->random_.direction())
                      .toRotationMatrix();
    tf.translation() = S(5) * this->random_.point();
    contactRegions(first, tf, second, tf * bodies.template place<S>(), this->result_);
    long volume = 0;
    for (const BoxOverlap::Region& region : expected) volume += region.volume;
    double sum = 0;
    for (const S part : this->result_.volumes) sum += double(part);
    ASSERT_NEAR(double(volume), sum, 0.02) << step;
    const Normals wanted = expectedNormals(expected),
                  found = normalsIn<S>(this->result_, tf.linear());
    if (wanted.size() != 1 || found.size() != 1) continue;
    for (std::size_t k = 1; k < 4; ++k) ASSERT_NEAR(wanted[0][k], found[0][k], 3) << step;
    ++compared;
  }
  EXPECT_GT(compared, manySteps(200));
}

/// Powers of two scale every result exactly, down to where the results underflow, as far as meshes
/// have such coordinates.
TYPED_TEST(CoincidingRegions, ScaleExactly) {
  using S = TypeParam;
  ContactRegions<S> scaled;
  const int most = std::numeric_limits<S>::max_exponent / 4 - 10,
            least = std::numeric_limits<S>::min_exponent + 24;
  int answered = 0;
  for (int step = 0; step < manySteps(100); ++step) {
    const Case bodies = Case::random(this->random_);
    const auto compare = [&](int exponent) {
      const S size = std::ldexp(S(1), exponent);
      const DeformableMesh<S> first(bodies.first.surface(size)),
          second(bodies.second.surface(size));
      contactRegions(first, moved<S>(0, 0, 0), second, bodies.place(size), scaled);
      ++answered;
      ASSERT_EQ(this->result_.size(), scaled.size());
      for (std::size_t r = 0; r < scaled.size(); ++r) {
        EXPECT_EQ(std::ldexp(this->result_.volumes[r], 3 * exponent), scaled.volumes[r]);
        EXPECT_EQ(std::ldexp(this->result_.first.areas[r], 2 * exponent), scaled.first.areas[r]);
        EXPECT_EQ(std::ldexp(this->result_.second.areas[r], 2 * exponent), scaled.second.areas[r]);
        EXPECT_EQ(this->result_.normals[r], scaled.normals[r]);
        EXPECT_EQ(size * this->result_.first.centroids[r], scaled.first.centroids[r]);
      }
      ASSERT_EQ(this->result_.curve_points.size(), scaled.curve_points.size());
      for (std::size_t i = 0; i < scaled.curve_points.size(); ++i)
        EXPECT_EQ(size * this->result_.curve_points[i], scaled.curve_points[i]);
    };
    const DeformableMesh<S> first(bodies.first.surface(S(1))), second(bodies.second.surface(S(1)));
    contactRegions(first, moved<S>(0, 0, 0), second, bodies.place(S(1)), this->result_);
    for (int i = 0; i < 10; ++i) {
      const int exponent = least + this->random_.below(most - least + 1);
      SCOPED_TRACE(testing::Message() << step << ", times 2^" << exponent);
      compare(exponent);
      if (this->HasFailure()) return;
    }
  }
  EXPECT_EQ(manySteps(100) * 10, answered);
}

}  // namespace coinciding_regions_test
}  // namespace adaptive_bvh_test
