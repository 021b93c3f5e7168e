// A walk over four-wide trees finds the pairs of triangles whose boxes overlap, each once: compiled
// for every processor, and for those with AVX2.
#include "query/wide_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "mesh/mesh_state.h"
#include "query/within_tests.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace wide_search_test {

using adaptive_bvh::Boxes4;
using adaptive_bvh::GrownFrame;
using adaptive_bvh::NodePair;
using adaptive_bvh::SameFrame;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideSearch;
using adaptive_bvh::WideTree;

using Pairs = std::vector<std::pair<int, int>>;

/// The triangles that a walk finds.
struct Listing {
  Pairs pairs;

  void foundLeaves(const WideNode& a, const WideNode& b, unsigned bits) {
    for (int bit = 0; bit < 16; ++bit)
      if (bits >> bit & 1) pairs.emplace_back(a.first + (bit & 3), b.first + (bit >> 2));
  }
  void foundLeaf(const WideNode& a, unsigned bits) { foundLeaves(a, a, bits); }
  static bool isDone() { return false; }
};

/// A soup of triangles, and its tree.
class Soup {
 public:
  Soup(int triangles, RandomGeometry<double>& random)
      : mesh_(soup<double>(triangles, random.engine())),
        tree(adaptive_bvh::detail::MeshAccess<double>::state(mesh_).tree) {}

  /// Calls act(triangle, its boxes, its lane).
  template <typename Do>
  void forEachTriangle(const Do& act) const {
    for (int i = 0; i < tree.size(); ++i)
      for (int lane = 0; tree.nodes()[i].isLeaf() && lane < tree.nodes()[i].count; ++lane)
        act(tree.nodes()[i].first + lane, tree.nodes()[i].boxes, lane);
  }

 private:
  const adaptive_bvh::DeformableMeshd mesh_;

 public:
  const WideTree& tree;
};

/// Of all pairs of triangles those whose boxes overlap; each once where both trees are the same.
template <typename Frame>
Pairs overlapping(const Soup& first, const Soup& second, const Frame& frame) {
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

template <bool kIsSelf, typename Frame>
void expectAllFound(const Soup& first, const Soup& second, const Frame& frame) {
  using Search = WideSearch<Frame, kIsSelf, Listing>;
  const NodePair roots{0, 0};
  const int depth = first.tree.depth() + second.tree.depth();
  const auto found = [&](auto run) {
    Listing listing;
    Search search(first.tree.nodes(), second.tree.nodes(), frame, listing);
    (search.*run)({&roots, &roots + 1}, depth);
    return std::make_pair(listing.pairs, search.boxTests());
  };
  const auto anywhere = found(&Search::runAnywhere);
  EXPECT_EQ(anywhere, found(&Search::run));
  if (adaptive_bvh::packs::hasAvx2()) {
    EXPECT_EQ(anywhere, found(&Search::runWithAvx2));
  }
  Pairs sorted = anywhere.first;
  for (auto& pair : sorted)
    if (kIsSelf && pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(overlapping(first, second, frame), sorted);
}

TEST(WideSearch, FindsWhatOverlaps) {
  RandomGeometry<double> random(62);
  const SameFrame same;
  std::size_t seen = 0;
  for (const int triangles : {1, 2, 4, 5, 17, 300}) {
    const Soup a(triangles, random), b(triangles + 3, random);
    for (const double distance : {0., 0.01, 0.3}) {
      const GrownFrame<SameFrame> grown(same, distance);
      expectAllFound<false>(a, b, grown);
      expectAllFound<true>(a, a, grown);
      seen += overlapping(a, b, grown).size();
    }
    expectAllFound<false>(a, b, same);
    expectAllFound<true>(a, a, same);
  }
  EXPECT_GT(seen, 1000u);
}

}  // namespace wide_search_test
}  // namespace adaptive_bvh_test
