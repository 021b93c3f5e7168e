// Eight pairs of triangles at a time are judged as four are: the same pairs stay, in the same
// order. What four say is judged in test/triangles/triangle_pairs_test.cpp.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "query/pair_tests.h"

namespace adaptive_bvh_test {
namespace pair_tests_test {

using adaptive_bvh::Float4;
using adaptive_bvh::LeafIndexPair;
using adaptive_bvh::LeafSlots;
using adaptive_bvh::PairError;
using adaptive_bvh::PairSource;
using adaptive_bvh::PairTestTable;
using adaptive_bvh::PairVerdict;

/// Triangles of any size in one tree's coordinates; many nearly touch, or lie in one plane.
class Triangles {
 public:
  explicit Triangles(unsigned seed) : random_(seed) {
    constexpr unsigned kBlocks = 30, kVertices = 64, kLeaves = 40;
    for (unsigned block = 0; block < kBlocks; ++block) {
      const float size = std::ldexp(1.f, -int(block % 9)), flat = block % 3 ? 1.f : 1e-6f;
      for (unsigned v = 0; v < kVertices; ++v) {
        positions_.push_back(Float4{one() * size, one() * size, one() * size * flat, 0});
        residuals_.push_back(Float4{one() * 1e-7f, one() * 1e-7f, one() * 1e-7f, 0});
      }
      for (unsigned leaf = 0; leaf < kLeaves; ++leaf)
        leaves_.push_back({block * kVertices, {corner(), corner(), corner()}});
    }
  }

  std::vector<LeafIndexPair> pairs(std::size_t count) {
    std::uniform_int_distribution<unsigned> leaf(0, unsigned(leaves_.size()) - 1);
    std::vector<LeafIndexPair> pairs(count);
    for (LeafIndexPair& pair : pairs) pair = {leaf(random_), leaf(random_)};
    return pairs;
  }
  PairSource source() const {
    return {{leaves_.data(), positions_.data(), residuals_.data()},
            {leaves_.data(), positions_.data(), residuals_.data()}};
  }

 private:
  float one() { return std::uniform_real_distribution<float>(-1, 1)(random_); }
  std::uint8_t corner() {
    return std::uint8_t(std::uniform_int_distribution<unsigned>(0, 63)(random_));
  }

  std::mt19937 random_;
  std::vector<LeafSlots> leaves_;
  std::vector<Float4> positions_, residuals_;
};

/// What is left after each stage, and the verdicts about it.
struct Outcome {
  std::vector<LeafIndexPair> by_planes, by_normals;
  std::vector<PairVerdict> verdicts;

  Outcome(const PairTestTable& tests, const PairSource& from, std::vector<LeafIndexPair> pairs,
          const PairError& coarse, const PairError& fine) {
    pairs.reserve(pairs.size() + 1);
    pairs.resize(std::size_t(tests.keepByPlanes(from, pairs.data(), int(pairs.size()), coarse)));
    by_planes = pairs;
    pairs.resize(std::size_t(tests.keepByNormals(from, pairs.data(), int(pairs.size()), fine)));
    by_normals = pairs;
    verdicts.resize(pairs.size());
    tests.judge(from, pairs.data(), int(pairs.size()), fine, verdicts.data());
  }
};

bool same(const std::vector<LeafIndexPair>& a, const std::vector<LeafIndexPair>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const LeafIndexPair& p, const LeafIndexPair& q) {
                      return p.first == q.first && p.second == q.second;
                    });
}

TEST(PairTests, EightAtATimeSayWhatFourSay) {
  const PairTestTable* const eight = adaptive_bvh::pairTests8();
  if (!eight) GTEST_SKIP() << "no AVX2";
  const PairError coarse = {4e-7f, 1e-15f, 1e-30f}, fine = {1e-13f, 1e-15f, 1e-30f};
  std::size_t seen[3] = {0, 0, 0}, left_by_planes = 0, left_by_normals = 0, all = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Triangles triangles(seed);
    for (std::size_t count = 0; count < 260; count += 1 + count / 9) {
      const std::vector<LeafIndexPair> pairs = triangles.pairs(count);
      const Outcome a(adaptive_bvh::pairTests4(), triangles.source(), pairs, coarse, fine),
          b(*eight, triangles.source(), pairs, coarse, fine);
      EXPECT_TRUE(same(a.by_planes, b.by_planes));
      EXPECT_TRUE(same(a.by_normals, b.by_normals));
      EXPECT_EQ(a.verdicts, b.verdicts);
      for (const PairVerdict verdict : a.verdicts) ++seen[int(verdict)];
      all += count;
      left_by_planes += a.by_planes.size();
      left_by_normals += a.by_normals.size();
    }
  }
  for (const std::size_t count : seen) EXPECT_GT(count, 20u);
  EXPECT_LT(left_by_planes, all);
  EXPECT_LT(left_by_normals, left_by_planes);
}

TEST(PairTests, TheWidestAreUsed) {
  const PairTestTable* const eight = adaptive_bvh::pairTests8();
  EXPECT_EQ(eight ? eight : &adaptive_bvh::pairTests4(), &adaptive_bvh::pairTests());
}

}  // namespace pair_tests_test
}  // namespace adaptive_bvh_test
