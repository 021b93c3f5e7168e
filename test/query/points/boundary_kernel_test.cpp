// The sums over a boundary for packs of two numbers and of four: the same, bit for bit.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "query/points/boundary_kernel.h"

namespace adaptive_bvh {
namespace boundary_kernel_test {

struct Added {
  bool is_within;
  BoundaryTurn turn;
  std::vector<unsigned> listed;
};

Added addedBy(AddBoundary add, const BoundaryArrays& boundary, std::size_t count,
              const BoundaryView& view) {
  Added result{};
  std::size_t num_listed = 0;
  result.listed.resize(count);
  result.is_within = add(boundary, 0, count, view, result.turn, result.listed.data(), num_listed);
  result.listed.resize(num_listed);
  return result;
}

TEST(BoundaryKernel, AnswersAlikeForPacksOfAnySize) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  std::size_t listed = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::size_t count = 4 * (1 + random() % 64);
    std::vector<double> numbers[4];
    for (std::vector<double>& n : numbers)
      for (std::size_t k = 0; k < count + 4; ++k) n.push_back(any(random));
    for (double& weight : numbers[3]) weight = weight > -0.6 ? 1 : 0;
    BoundaryView view = {{any(random), any(random), any(random)},
                         {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                         random() % 2 == 0,
                         0x1p42};
    if (random() % 8 == 0)  // on a vertex
      for (std::size_t k = 0; k < 3; ++k) view.point[k] = numbers[k][count / 2];
    const BoundaryArrays boundary = {numbers[0].data(), numbers[1].data(), numbers[2].data(),
                                     numbers[3].data()};
    const Added two = addedBy(BoundaryKernel<Pack<double>>::add, boundary, count, view),
                four = addedBy(addBoundary(), boundary, count, view);
    ASSERT_EQ(two.is_within, four.is_within);
    ASSERT_EQ(two.listed, four.listed);
    ASSERT_EQ(two.turn.x, four.turn.x);
    ASSERT_EQ(two.turn.y, four.turn.y);
    ASSERT_EQ(two.turn.turns, four.turn.turns);
    listed += two.listed.size();
  }
  EXPECT_GT(listed, 1000u);
}

}  // namespace boundary_kernel_test
}  // namespace adaptive_bvh
