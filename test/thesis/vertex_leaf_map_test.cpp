// Dirty flags and the way from a vertex up the tree, judged by sets and by walking FCL's nodes.
#include "thesis/vertex_leaf_map.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace vertex_leaf_map_test {

using adaptive_bvh::DirtyPairs;
using adaptive_bvh::Topology;
using adaptive_bvh::VertexLeafMap;

/// All dirty pairs, from the last to the first.
std::vector<int> listOf(const DirtyPairs& dirty, int pairs) {
  std::vector<int> found;
  for (int left = 2 * pairs + 1; (left = dirty.before(left)) > 0;) found.push_back(left);
  return found;
}

TEST(DirtyPairs, KeepsFlagsAcrossWords) {
  DirtyPairs dirty;
  dirty.reset(200);
  EXPECT_EQ(-1, dirty.before(401));
  for (const int left : {1, 127, 129, 255, 257, 399}) {  // 64 pairs a word: 1 to 127, 129 to 255
    EXPECT_FALSE(dirty.isDirty(left));
    EXPECT_FALSE(dirty.set(left)) << "was not dirty";
    EXPECT_TRUE(dirty.set(left)) << "is by now";
    EXPECT_TRUE(dirty.isDirty(left));
  }
  EXPECT_EQ((std::vector<int>{399, 257, 255, 129, 127, 1}), listOf(dirty, 200));
  EXPECT_EQ(-1, dirty.before(1)) << "before the first";
  EXPECT_EQ(1, dirty.before(127)) << "before, not at";
  dirty.unset(255);
  EXPECT_FALSE(dirty.isDirty(255));
  EXPECT_TRUE(dirty.isDirty(257)) << "its neighbour stays";
  EXPECT_EQ((std::vector<int>{399, 257, 129, 127, 1}), listOf(dirty, 200));
  dirty.reset(200);
  EXPECT_TRUE(listOf(dirty, 200).empty());
}

/// Any sequence of set and unset, of any number of pairs, against std::set.
TEST(DirtyPairs, AreASetOfPairs) {
  std::mt19937 random(testSeed(5));
  for (const int pairs : {1, 2, 63, 64, 65, 128, 129, 1000}) {
    DirtyPairs dirty;
    dirty.reset(std::size_t(pairs));
    EXPECT_GE(dirty.bytes() * 8, std::size_t(pairs));
    std::set<int> expected;
    for (int step = 0; step < 3000; ++step) {
      const int left = 2 * int(random() % unsigned(pairs)) + 1;
      if (random() % 3 > 0) {
        ASSERT_EQ(!expected.insert(left).second, dirty.set(left));
      } else {
        dirty.unset(left);
        expected.erase(left);
      }
      const int from = 2 * int(random() % unsigned(pairs + 1)) + 1;
      const auto next = expected.lower_bound(from);
      ASSERT_EQ(next == expected.begin() ? -1 : *std::prev(next), dirty.before(from)) << from;
      ASSERT_EQ(expected.count(left) > 0, dirty.isDirty(left));
    }
    EXPECT_EQ((std::vector<int>(expected.rbegin(), expected.rend())), listOf(dirty, pairs));
  }
}

template <typename S>
class VertexLeaves : public testing::Test {
 protected:
  using Model = fcl::BVHModel<fcl::RSS<S>>;

  void build(const TriangleMesh<S>& mesh) {
    fillModel(mesh, model_);
    topology_.assign(model_);
    leaves_.assign(topology_, model_.num_vertices);
    dirty_.reset(topology_.slots.leaves() - 1);
  }

  /// The pairs of siblings on the ways from the leaves of a vertex to the root, by FCL's links.
  std::set<int> above(unsigned vertex) const {
    std::map<int, int> parent;
    std::vector<int> open;
    for (int i = 0; i < model_.getNumBVs(); ++i) {
      const auto& node = model_.getBV(i);
      if (!node.isLeaf()) {
        parent[node.leftChild()] = parent[node.rightChild()] = i;
        continue;
      }
      const fcl::Triangle& t = model_.tri_indices[node.primitiveId()];
      if (t[0] == vertex || t[1] == vertex || t[2] == vertex) open.push_back(i);
    }
    std::set<int> pairs;
    for (int node : open)
      for (; node > 0; node = parent[node]) pairs.insert(model_.getBV(parent[node]).leftChild());
    return pairs;
  }

  Model model_;
  Topology topology_;
  VertexLeafMap leaves_;
  DirtyPairs dirty_;
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(VertexLeaves, Scalars);

/// Of every vertex of a sheet, a hose and a soup: all pairs above its triangles, no other.
TYPED_TEST(VertexLeaves, MarksWhatIsAboveAVertex) {
  using S = TypeParam;
  std::mt19937 random(testSeed(7));
  for (const auto& mesh : {plate<S>(1, 1), plate<S>(5, 4), tube<S>(6, 5), soup<S>(40, random)}) {
    this->build(mesh);
    EXPECT_FALSE(this->leaves_.empty());
    const int pairs = int(mesh.triangles.size()) - 1;
    for (unsigned v = 0; v < mesh.vertices.size(); ++v) {
      this->leaves_.markAncestors(v, this->dirty_);
      const std::set<int> expected = this->above(v);
      const std::vector<int> found = listOf(this->dirty_, pairs);
      ASSERT_EQ((std::vector<int>(expected.rbegin(), expected.rend())), found) << v;
      for (const int left : found) this->dirty_.unset(left);
    }
  }
}

/// Marks of several vertices add up: a way that meets a dirty pair may end there.
TYPED_TEST(VertexLeaves, MarksOfSeveralVerticesAddUp) {
  this->build(plate<TypeParam>(6, 6));
  std::set<int> expected;
  for (const unsigned v : {0u, 24u, 48u, 25u, 0u}) {
    this->leaves_.markAncestors(v, this->dirty_);
    const std::set<int> above = this->above(v);
    expected.insert(above.begin(), above.end());
    EXPECT_EQ((std::vector<int>(expected.rbegin(), expected.rend())), listOf(this->dirty_, 71));
  }
}

/// A vertex without triangles has nothing above it.
TYPED_TEST(VertexLeaves, KnowsAVertexWithoutTriangles) {
  using S = TypeParam;
  TriangleMesh<S> mesh = plate<S>(2, 2);
  mesh.vertices.emplace_back(5, 5, 5);
  this->build(mesh);
  this->leaves_.markAncestors(9, this->dirty_);
  EXPECT_EQ(-1, this->dirty_.before(15));
  this->leaves_.clear();
  EXPECT_TRUE(this->leaves_.empty());
  EXPECT_EQ(0u, this->leaves_.bytes());
}

}  // namespace vertex_leaf_map_test
}  // namespace adaptive_bvh_test
