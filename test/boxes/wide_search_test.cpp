// A walk over four-wide trees finds the pairs of triangles whose boxes overlap, each once: compiled
// for every processor, and for those with AVX2.
#include "boxes/wide_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "deformable/mesh_state.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace wide_search_test {

using adaptive_bvh::Box;
using adaptive_bvh::Boxes4;
using adaptive_bvh::BoxFrame;
using adaptive_bvh::Float4;
using adaptive_bvh::FrameChange;
using adaptive_bvh::LeavesFound;
using adaptive_bvh::NodePair;
using adaptive_bvh::WideSearch;
using adaptive_bvh::WideTree;

using Pairs = std::vector<std::pair<int, int>>;

/// The triangles that a walk finds, up to so many.
struct Listing : adaptive_bvh::LeafSink {
  Pairs pairs;
  std::size_t enough = ~std::size_t(0);
  bool was_told_more = false;  ///< after it had enough

  bool take(const LeavesFound* found, int count) override {
    was_told_more |= pairs.size() >= enough;
    for (int i = 0; i < count; ++i)
      for (int bit = 0; bit < 16; ++bit)
        if (found[i].pairs >> bit & 1)
          pairs.emplace_back(found[i].first->first + (bit & 3),
                             found[i].second->first + (bit >> 2));
    return pairs.size() >= enough;
  }
};

/// A soup of triangles, and its tree.
class Soup {
 public:
  Soup(int triangles, RandomGeometry& random)
      : mesh_(soup(triangles, random.engine())),
        tree(adaptive_bvh::detail::MeshAccess::state(mesh_).tree) {}

  /// Calls act(triangle, its boxes, its lane).
  template <typename Do>
  void forEachTriangle(const Do& act) const {
    for (int i = 0; i < tree.size(); ++i)
      for (int lane = 0; tree.nodes()[i].isLeaf() && lane < tree.nodes()[i].count; ++lane)
        act(tree.nodes()[i].first + lane, tree.nodes()[i].boxes, lane);
  }

 private:
  const adaptive_bvh::DeformableMesh mesh_;

 public:
  const WideTree& tree;
};

/// Of all pairs of triangles those whose boxes overlap; each once where both trees are the same.
Pairs overlapping(const Soup& first, const Soup& second, const BoxFrame& frame) {
  Pairs pairs;
  first.forEachTriangle([&](int i, const Boxes4& a, int lane1) {
    second.forEachTriangle([&](int j, const Boxes4& unplaced, int lane2) {
      const Boxes4 b = frame(unplaced);
      bool overlap = &first != &second || i < j;
      for (int k = 0; k < 3; ++k)
        overlap =
            overlap && a.low[k][lane1] <= b.high[k][lane2] && b.low[k][lane2] <= a.high[k][lane1];
      if (overlap) pairs.emplace_back(i, j);
    });
  });
  return pairs;
}

void expectAllFound(const Soup& first, const Soup& second, const BoxFrame& frame) {
  const bool is_self = &first == &second;
  const NodePair root{0, 0};
  WideSearch search({first.tree.nodes(), second.tree.nodes(),
                     first.tree.depth() + second.tree.depth(), frame, is_self});
  const auto found = [&](auto run, std::vector<NodePair> from, std::size_t enough) {
    Listing listing;
    listing.enough = enough;
    (search.*run)({from.data(), from.data() + from.size()}, listing);
    EXPECT_FALSE(listing.was_told_more);
    return listing.pairs;
  };
  constexpr std::size_t kAll = ~std::size_t(0);
  const Pairs anywhere = found(&WideSearch::runAnywhere, {root}, kAll);
  EXPECT_EQ(anywhere, found(&WideSearch::run, {root}, kAll));
  if (adaptive_bvh::packs::hasAvx2()) {
    EXPECT_EQ(anywhere, found(&WideSearch::runWithAvx2, {root}, kAll));
  }
  Pairs sorted = anywhere;
  for (auto& pair : sorted)
    if (is_self && pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(overlapping(first, second, frame), sorted);

  std::vector<NodePair> below{root};
  search.split(below, 20, adaptive_bvh::TaskPool(1));
  EXPECT_EQ(anywhere, found(&WideSearch::run, below, kAll)) << "in the same order";
  const Pairs few = found(&WideSearch::run, {root}, 1);
  ASSERT_EQ(few.empty(), anywhere.empty());
  EXPECT_TRUE(std::equal(few.begin(), few.end(), anywhere.begin()));
  EXPECT_FALSE(search.hasMorePairs(1 << 20));
  EXPECT_EQ(anywhere.size() > 1000, search.hasMorePairs(40) && anywhere.size() > 1000);
}

TEST(WideSearch, FindsWhatOverlaps) {
  RandomGeometry random(62);
  std::size_t seen = 0;
  for (const int triangles : {1, 2, 4, 5, 17, 300}) {
    const Soup a(triangles, random), b(triangles + 3, random);
    const FrameChange turned(random.rotation(), fcl::Vector3d(0.1, 0, 0), 1e-6);
    for (const FrameChange* change : {static_cast<const FrameChange*>(nullptr), &turned})
      for (const double distance : {0., 0.01, 0.3}) {
        const BoxFrame frame(change, distance);
        EXPECT_EQ(!change && distance == 0, frame.isIdentity());
        expectAllFound(a, b, frame);
        if (!change) expectAllFound(a, a, frame);
        seen += overlapping(a, b, frame).size();
      }
  }
  EXPECT_GT(seen, 1000u);
}

/// Boxes of displacements that are points in most leaves; by triangle the box of its leaf.
std::vector<Box> moveSome(const WideTree& tree, RandomGeometry& random,
                          std::vector<Box>& of_triangles) {
  const auto anyBox = [&]() -> Box {
    const Float4 at = {float(random.uniform(-0.4, 0.4)), float(random.uniform(-0.4, 0.4)), 0, 0},
                 side = {random.oneIn(8) ? 1.f : 0.f, 0, 0, 0};
    return {at, at + side};
  };
  std::vector<Box> boxes(std::size_t(tree.size()));
  for (int n = tree.size(); n-- > 0;) {
    const adaptive_bvh::WideNode& node = tree.nodes()[n];
    Box& box = boxes[std::size_t(n)];
    box = node.isLeaf() ? anyBox() : boxes[std::size_t(node.below[0])];
    for (int i = 0; i < int(node.count); ++i) {
      if (!node.isLeaf()) box.add(boxes[std::size_t(node.below[i])]);
      if (!node.isLeaf()) continue;
      of_triangles.resize(std::max(of_triangles.size(), std::size_t(node.first + i + 1)));
      of_triangles[std::size_t(node.first + i)] = box;
    }
  }
  return boxes;
}

TEST(WideSearch, FindsPairsOfMovedNodes) {
  RandomGeometry random(63);
  std::size_t seen = 0, left_out = 0;
  for (const int triangles : {2, 17, 300})
    for (const bool is_self : {false, true}) {
      const Soup a(triangles, random), other(triangles + 3, random);
      const Soup& b = is_self ? a : other;
      std::vector<Box> first, second;
      const auto boxes1 = moveSome(a.tree, random, first);
      const auto boxes2 = is_self ? boxes1 : moveSome(b.tree, random, second);
      if (is_self) second = first;
      const BoxFrame frame(nullptr, 0.05);
      const NodePair root{0, 0};
      WideSearch search({a.tree.nodes(),
                         b.tree.nodes(),
                         a.tree.depth() + b.tree.depth(),
                         frame,
                         is_self,
                         nullptr,
                         {boxes1.data(), boxes2.data()}});
      std::vector<NodePair> below{root};
      for (const bool splits : {false, true}) {
        if (splits) search.split(below, 20, adaptive_bvh::TaskPool(1));
        Listing listing;
        search.run({below.data(), below.data() + below.size()}, listing);
        Pairs found = listing.pairs, expected;
        for (auto& pair : found)
          if (is_self && pair.first > pair.second) std::swap(pair.first, pair.second);
        std::sort(found.begin(), found.end());
        for (const auto& pair : overlapping(a, b, frame)) {
          const float most = adaptive_bvh::largestSquare(first[std::size_t(pair.first)],
                                                         second[std::size_t(pair.second)]);
          if (most > 1)
            expected.push_back(pair);
          else
            ++left_out;
        }
        EXPECT_EQ(expected, found);
        seen += found.size();
      }
    }
  EXPECT_GT(seen, 100u);
  EXPECT_GT(left_out, 100u);
}

}  // namespace wide_search_test
}  // namespace adaptive_bvh_test
