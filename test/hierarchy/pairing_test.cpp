// Who neighbours whom, and who is paired with whom: one level of the bottom-up build, by hand and
// against brute force.
#include "hierarchy/pairing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "hierarchy/links.h"
#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace pairing_test {

using adaptive_bvh::combined;
using adaptive_bvh::GroupGraph;
using adaptive_bvh::kNone;
using adaptive_bvh::Link;
using adaptive_bvh::MeshView;
using adaptive_bvh::pairGroups;
using adaptive_bvh::Scratch;
using adaptive_bvh::sharedEdges;

using Links = Scratch<Link>;

// ---- edges --------------------------------------------------------------------------------------

Links linksOf(const TriangleMesh& mesh) {
  MeshView<double> view;
  view.vertices = mesh.vertices.data();
  view.triangles = mesh.triangles.data();
  Links links = sharedEdges(view, unsigned(mesh.triangles.size()));
  std::sort(links.begin(), links.end(), [](const Link& a, const Link& b) {
    return std::make_pair(a.first, a.second) < std::make_pair(b.first, b.second);
  });
  return links;
}

void expectLink(unsigned first, unsigned second, double weight, const Link& link) {
  EXPECT_EQ(first, link.first);
  EXPECT_EQ(second, link.second);
  EXPECT_NEAR(weight, link.weight, 1e-4 * weight) << "lengths are kept to 16 binary digits";
}

//  3---2---5      0: 0 1 2, 1: 0 2 3, 2: 1 4 2, 3: 4 5 2; edges of length 1 and diagonals.
//  | / | \ |
//  0---1---4
TEST(SharedEdges, LinkTrianglesByTheLengthTheyShare) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}, {4, 5, 2}};
  const Links links = linksOf(mesh);
  ASSERT_EQ(3u, links.size()) << "a shared vertex is not enough";
  expectLink(0, 1, std::sqrt(2), links[0]);
  expectLink(0, 2, 1, links[1]);
  expectLink(2, 3, std::sqrt(2), links[2]);
}

TEST(SharedEdges, SumWhatTwoTrianglesShare) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
  const Links links = linksOf(mesh);
  ASSERT_EQ(1u, links.size());
  expectLink(0, 1, 12, links[0]);
}

/// Triangles around one edge of length 2.
TriangleMesh book(std::size_t pages) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, 2}};
  for (std::size_t page = 0; page < pages; ++page) {
    mesh.vertices.emplace_back(1, page, 0);
    mesh.triangles.emplace_back(0, 1, 2 + page);
  }
  return mesh;
}

TEST(SharedEdges, LinkAllPagesOfABook) {
  const Links links = linksOf(book(5));
  ASSERT_EQ(10u, links.size());
  for (const Link& link : links) EXPECT_DOUBLE_EQ(2, link.weight);
}

TEST(SharedEdges, GrowLinearlyWithThePagesOfAThickBook) {
  const Links links = linksOf(book(20000));
  EXPECT_LE(links.size(), 16u * 20000);
  EXPECT_GE(links.size(), 19999u) << "one connected component";
}

// Cutting the mesh apart changes nothing: same positions, same links.
TEST(SharedEdges, ConnectTrianglesWithVerticesOfTheirOwn) {
  const TriangleMesh mesh = tube(7, 5);
  TriangleMesh apart;
  for (const fcl::Triangle& t : mesh.triangles) {
    const std::size_t v = apart.vertices.size();
    for (int k = 0; k < 3; ++k) apart.vertices.push_back(mesh.vertices[t[k]]);
    apart.triangles.emplace_back(v, v + 1, v + 2);
  }
  const Links links = linksOf(mesh), links_apart = linksOf(apart);
  ASSERT_EQ(links.size(), links_apart.size());
  for (std::size_t i = 0; i < links.size(); ++i)
    expectLink(links[i].first, links[i].second, links[i].weight, links_apart[i]);
}

// Two coincident layers are linked along their borders only: inside, their edges have two
// triangles already. They may move apart.
TEST(SharedEdges, DoNotSewCoincidentLayers) {
  TriangleMesh mesh = plate(4, 4);
  const std::size_t layer = mesh.vertices.size(), triangles = mesh.triangles.size();
  for (std::size_t v = 0; v < layer; ++v) mesh.vertices.push_back(mesh.vertices[v]);
  for (std::size_t t = 0; t < triangles; ++t)
    mesh.triangles.emplace_back(mesh.triangles[t][0] + layer, mesh.triangles[t][1] + layer,
                                mesh.triangles[t][2] + layer);
  std::size_t between = 0;
  for (const Link& link : linksOf(mesh))
    between += (link.first < triangles) != (link.second < triangles);
  EXPECT_EQ(14u, between) << "16 sides of the border; two triangles have two of them";
}

TEST(SharedEdges, IgnoreDegenerateTriangles) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  mesh.triangles = {{0, 0, 0}, {0, 1, 0}, {0, 1, 2}, {0, 3, 0}};
  const Links links = linksOf(mesh);
  ASSERT_EQ(1u, links.size());
  EXPECT_EQ(1u, links[0].first);
  EXPECT_EQ(2u, links[0].second);
}

// ---- graphs -------------------------------------------------------------------------------------

TEST(Combined, SumsEqualLinksAndDropsLoops) {
  const Links links =
      combined(3, {{0, 1, 1}, {1, 2, 5}, {0, 1, 2}, {1, 1, 9}, {0, 2, 4}, {0, 1, 3}});
  ASSERT_EQ(3u, links.size());
  expectLink(0, 1, 6, links[0]);
  expectLink(0, 2, 4, links[1]);
  expectLink(1, 2, 5, links[2]);
}

TEST(Graph, ListsTheBestNeighbourFirst) {
  const GroupGraph graph(4, {{0, 1, 1}, {0, 2, 3}, {0, 3, 1}});
  ASSERT_EQ(3, graph.end(0) - graph.begin(0));
  EXPECT_EQ(2u, graph.begin(0)[0].group);
  EXPECT_EQ(1u, graph.begin(0)[1].group) << "ties in order of numbers";
  EXPECT_EQ(3u, graph.begin(0)[2].group);
  EXPECT_EQ(1, graph.end(3) - graph.begin(3));
}

// ---- pairs --------------------------------------------------------------------------------------

using Mates = Scratch<unsigned>;

/// Mates are mutual neighbours.
void expectPairs(const GroupGraph& graph, const Mates& mate) {
  for (unsigned g = 0; g < graph.size(); ++g) {
    if (mate[g] == kNone) continue;
    ASSERT_EQ(g, mate[mate[g]]);
    EXPECT_TRUE(std::any_of(graph.begin(g), graph.end(g),
                            [&](const auto& n) { return n.group == mate[g]; }));
  }
}

// 0 -1- 1 -2- 2 -3- 3: the walk goes 0, 1, 2, 3. 3 and 2 have no better partner; then 1 and 0 are
// left to each other.
TEST(Pairing, WalksToTheBetterPartnerAndBack) {
  EXPECT_EQ((Mates{1, 0, 3, 2}), pairGroups(GroupGraph(4, {{0, 1, 1}, {1, 2, 2}, {2, 3, 3}}), {}));
}

// A favoured group does not ask whether its best neighbour has a better partner.
TEST(Pairing, ServesTheFavouredFirst) {
  const GroupGraph graph(3, {{0, 1, 1}, {1, 2, 2}});
  EXPECT_EQ((Mates{kNone, 2, 1}), pairGroups(graph, {}));
  EXPECT_EQ((Mates{1, 0, kNone}), pairGroups(graph, {0}));
}

// 0 -1- 1 -3- 2 -1- 3: the walk pairs 1 with 2. 0 and 3 find each other, and both swap.
TEST(Pairing, ExchangesPartnersBetweenTwoIsolatedGroups) {
  EXPECT_EQ((Mates{1, 0, 3, 2}), pairGroups(GroupGraph(4, {{0, 1, 1}, {1, 2, 3}, {2, 3, 1}}), {}));
}

// The same along three pairs: all five middle links change.
TEST(Pairing, ExchangesPartnersAlongAPath) {
  Links links;
  for (unsigned g = 0; g + 1 < 8; ++g) links.push_back({g, g + 1, g % 2 == 1 ? 3. : 1.});
  EXPECT_EQ((Mates{1, 0, 3, 2, 5, 4, 7, 6}), pairGroups(GroupGraph(8, links), {}));
}

// Three groups around one: two stay alone, whatever one does.
TEST(Pairing, LeavesWhatCannotBePaired) {
  const GroupGraph claw(4, {{0, 1, 1}, {0, 2, 2}, {0, 3, 1}});
  EXPECT_EQ((Mates{2, kNone, 0, kNone}), pairGroups(claw, {}));
}

/// The greatest number of pairs in a bipartite graph, by the textbook's augmenting paths.
int mostPairs(unsigned left, unsigned right, const Links& links) {
  std::vector<std::vector<unsigned>> neighbours(left);
  for (const Link& link : links) neighbours[link.first].push_back(link.second - left);
  std::vector<int> owner(right, -1);
  std::vector<bool> tried;
  const std::function<bool(unsigned)> place = [&](unsigned g) {
    for (unsigned n : neighbours[g]) {
      if (tried[n]) continue;
      tried[n] = true;
      if (owner[n] < 0 || place(unsigned(owner[n]))) {
        owner[n] = int(g);
        return true;
      }
    }
    return false;
  };
  int pairs = 0;
  for (unsigned g = 0; g < left; ++g) {
    tried.assign(right, false);
    pairs += place(g);
  }
  return pairs;
}

// Without odd cycles the search misses nothing: as many pairs as there can be.
TEST(Pairing, PairsAsManyAsPossibleInBipartiteGraphs) {
  std::mt19937 random(testSeed(5));
  for (int run = 0; run < 300; ++run) {
    const unsigned left = 1 + random() % 40, right = 1 + random() % 40;
    Links links;
    for (unsigned g = 0; g < left; ++g)
      for (unsigned h = 0; h < right; ++h)
        if (random() % 12 == 0) links.push_back({g, left + h, double(1 + random() % 5)});
    const GroupGraph graph(left + right, links);
    const Mates mate = pairGroups(graph, {});
    expectPairs(graph, mate);
    const auto paired =
        std::count_if(mate.begin(), mate.end(), [](unsigned m) { return m != kNone; });
    EXPECT_EQ(2 * mostPairs(left, right, links), paired);
  }
}

// With odd cycles some may stay alone, but no two of them are neighbours, and none that was
// favoured and could have been served.
TEST(Pairing, LeavesNoTwoNeighboursAlone) {
  std::mt19937 random(testSeed(6));
  for (int run = 0; run < 300; ++run) {
    const unsigned groups = 2 + random() % 60;
    Links links;
    for (unsigned g = 0; g < groups; ++g)
      for (unsigned h = g + 1; h < groups; ++h)
        if (random() % 15 == 0) links.push_back({g, h, double(1 + random() % 5)});
    const GroupGraph graph(groups, links);
    const unsigned favoured = random() % groups;
    const Mates mate = pairGroups(graph, {favoured});
    expectPairs(graph, mate);
    EXPECT_EQ(graph.begin(favoured) == graph.end(favoured), mate[favoured] == kNone);
    for (const Link& link : links)
      EXPECT_TRUE(mate[link.first] != kNone || mate[link.second] != kNone);
  }
}

}  // namespace pairing_test
}  // namespace adaptive_bvh_test
