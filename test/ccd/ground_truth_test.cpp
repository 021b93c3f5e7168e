// Steps of two simulations with the truth about 24,320 pairs of features, from symbolic roots (Wang
// et al. 2022). Skipped where the data is not beside the project.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "adaptive_bvh/continuous_collision.h"
#include "support/exact_geometry.h"
#include "support/step_data.h"

namespace adaptive_bvh_test {
namespace ground_truth_test {

using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using exact::Real;
using P = Eigen::Vector3d;

struct Pair {
  FeatureKind kind;
  unsigned v[4];  ///< a vertex and a face, or two edges
  bool collides;
};

std::vector<Pair> loadPairs(const std::string& name) {
  std::ifstream file(dataFolder() + "/ccd/" + name + ".txt");
  std::vector<Pair> pairs;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    Pair pair;
    if (!(words >> kind) || kind[0] == '#') continue;
    words >> pair.v[0] >> pair.v[1] >> pair.v[2] >> pair.v[3] >> pair.collides;
    pair.kind = kind == "ee" ? FeatureKind::EdgeEdge : FeatureKind::VertexFace;
    pairs.push_back(pair);
  }
  return pairs;
}

class GroundTruth : public testing::TestWithParam<std::array<const char*, 2>> {
 protected:
  void SetUp() override {
    mesh_ = loadStep(GetParam()[0]);
    end_ = loadStep(GetParam()[1]).vertices;
    pairs_ = loadPairs(GetParam()[0]);
    if (pairs_.empty()) GTEST_SKIP() << "no data in " << dataFolder();
    for (unsigned t = 0; t < mesh_.triangles.size(); ++t) {
      std::array<unsigned, 3> c;
      for (unsigned k = 0; k < 3; ++k) {
        c[k] = unsigned(mesh_.triangles[t][int(k)]);
        const auto e = adaptive_bvh::edgeVertices(mesh_.triangles.data(), 3 * t + k);
        edges_.emplace(std::make_pair(std::min(e[0], e[1]), std::max(e[0], e[1])), 3 * t + k);
      }
      std::sort(c.begin(), c.end());
      faces_.emplace(c, t);
    }
  }
  unsigned edge(unsigned a, unsigned b) const {
    return edges_.at({std::min(a, b), std::max(a, b)});
  }
  FeaturePair numbersOf(const Pair& pair) const {
    const unsigned* v = pair.v;
    if (pair.kind == FeatureKind::VertexFace) {
      std::array<unsigned, 3> c = {v[1], v[2], v[3]};
      std::sort(c.begin(), c.end());
      return {v[0], faces_.at(c)};
    }
    const unsigned a = edge(v[0], v[1]), b = edge(v[2], v[3]);
    return {std::min(a, b), std::max(a, b)};
  }

  /// The first contact by signs of the volume that the corners span, in long double; 2 without one.
  Real firstContact(const Pair& pair) const {
    const auto at = [&](int i, Real t) -> exact::Point {
      const exact::Point a = exact::of(mesh_.vertices[pair.v[i]]);
      return a + t * (exact::of(end_[pair.v[i]]) - a);
    };
    const auto volume = [&](Real t) {
      const exact::Point o = at(0, t);
      return (at(1, t) - o).cross(at(2, t) - o).dot(at(3, t) - o);
    };
    const auto distance = [&](Real t) {
      if (pair.kind == FeatureKind::EdgeEdge)
        return exact::distance(at(0, t), at(1, t), at(2, t), at(3, t));
      return exact::distance(exact::Triangle{at(1, t), at(2, t), at(3, t)}, at(0, t));
    };
    constexpr int kParts = 512;
    for (int i = 0; i < kParts; ++i) {
      Real low = Real(i) / kParts, high = Real(i + 1) / kParts;
      const bool side = volume(low) > 0;
      if (side == (volume(high) > 0)) continue;
      for (int k = 0; k < 70; ++k) {
        const Real middle = (low + high) / 2;
        (side == (volume(middle) > 0) ? low : high) = middle;
      }
      if (distance(low) <= 1e-15L) return low;
    }
    return 2;
  }

  TriangleMesh mesh_;
  std::vector<P> end_;
  std::vector<Pair> pairs_;
  std::map<std::pair<unsigned, unsigned>, unsigned> edges_;
  std::map<std::array<unsigned, 3>, unsigned> faces_;
};

/// Every colliding pair is a candidate and has a time, also where the meshes are scaled or moved;
/// at most one in twenty of the other pairs has one.
TEST_P(GroundTruth, EveryCollidingPairIsReported) {
  struct Place {
    double scale, move;
  };
  for (const Place place : {Place{1, 0}, Place{1e-3, 0}, Place{1e3, 0}, Place{1, 1e3}}) {
    auto start = mesh_.vertices, end = end_;
    for (auto* positions : {&start, &end})
      for (P& x : *positions) x = x * place.scale + P::Constant(place.move);
    const adaptive_bvh::DeformableMesh model(start, mesh_.triangles);
    const adaptive_bvh::Motion motion(model, start, end);
    adaptive_bvh::FeaturePairs found, listed;
    const double first = selfEarliestImpact(motion, 0, found).time;
    std::sort(found.vertex_face.begin(), found.vertex_face.end());
    std::sort(found.edge_edge.begin(), found.edge_edge.end());
    int missing = 0, unreported = 0, innocent = 0, accused = 0;
    double earliest = 2;
    for (const Pair& pair : pairs_) {
      const auto& all = pair.kind == FeatureKind::EdgeEdge ? found.edge_edge : found.vertex_face;
      missing += pair.collides && !std::binary_search(all.begin(), all.end(), numbersOf(pair));
      (pair.kind == FeatureKind::EdgeEdge ? listed.edge_edge : listed.vertex_face)
          .push_back(numbersOf(pair));
    }
    adaptive_bvh::ImpactTimes times;
    selfTimesOfImpact(motion, listed, 0, times);
    std::size_t next[2] = {0, 0};
    for (const Pair& pair : pairs_) {
      const bool edges = pair.kind == FeatureKind::EdgeEdge;
      const double time = (edges ? times.edge_edge : times.vertex_face)[next[edges]++];
      earliest = std::min(earliest, time);
      unreported += pair.collides && !(time <= 1);
      innocent += !pair.collides;
      accused += !pair.collides && time <= 1;
      if (place.move == 0 && place.scale == 1) {
        ASSERT_LE(std::min(time, 2.), firstContact(pair));
      }
    }
    EXPECT_EQ(0, missing) << place.scale << ' ' << place.move;
    EXPECT_EQ(0, unreported) << place.scale << ' ' << place.move;
    EXPECT_LE(20 * accused, innocent + 19) << place.scale << ' ' << place.move;
    EXPECT_LE(first, earliest);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Steps, GroundTruth,
    testing::Values(std::array<const char*, 2>{"armadillo_rollers_326", "armadillo_rollers_327"},
                    std::array<const char*, 2>{"cloth_funnel_227", "cloth_funnel_228"}),
    [](const auto& info) { return std::string(info.param[0]); });

}  // namespace ground_truth_test
}  // namespace adaptive_bvh_test
