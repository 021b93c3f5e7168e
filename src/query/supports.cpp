#include "query/supports.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

/// Of no box: less than any other, and its sum with one is finite.
constexpr float kLowest = -1e30f;

}  // namespace

void Supports::compute(const WideTree& tree, const Float4& direction) {
  const std::size_t slots = tree.slots().size();
  const Float4* const positions = tree.positions();
  of_slot_.resize((slots + 3) / 4 * 4);
  for (std::size_t i = 0; i < slots; i += 4) {
    const auto along = [&](std::size_t k) -> Float4 {
      return positions[std::min(i + k, slots - 1)] * direction;
    };
    float4::store(float4::sums(along(0), along(1), along(2), along(3)), &of_slot_[i]);
  }
  reaches_.resize(static_cast<std::size_t>(tree.size()));
  for (int n = tree.size(); n-- > 0;) {
    const WideNode& node = tree.nodes()[n];
    Float4 reach = float4::all(kLowest);
    for (int i = 0; i < int(node.count); ++i) {
      if (node.isLeaf()) {
        const VertexIndices at =
            tree.slots().slotsOf(static_cast<std::size_t>(node.first) + std::size_t(i));
        reach[i] = std::max(std::max(of_slot_[at[0]], of_slot_[at[1]]), of_slot_[at[2]]);
      } else {
        reach[i] = packs::largest(reaches_[static_cast<std::size_t>(node.below[i])]);
      }
    }
    reaches_[static_cast<std::size_t>(n)] = reach;
  }
}

/// The separation of two nodes along d is d t - h1 - h2: t where the second tree's origin is, h1
/// and h2 how far they reach along d and against it. Coordinates y2 of the second tree are M y2 + t
/// in the first.
void LineSeparation::compute(const WideTree& first, const WideTree& second,
                             const RelativeFrame& frame, const fcl::Vector3d& direction) {
  const auto rounded = [](const fcl::Vector3d& v) -> Float4 {
    return Float4{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), 0};
  };
  first_.compute(first, rounded(direction));
  second_.compute(second, rounded(-(frame.m().transpose() * direction)));
  const double ratio = first.scale() / second.scale();
  constexpr double kMostRatio = 1e30;  // the second's supports are in range
  along_ = ratio < kMostRatio ? direction.dot(frame.t()) : -std::numeric_limits<double>::infinity();
  length_ = direction.norm();
  error_ = Supports::kError * (1 + ratio) + 8 * double(frame.preciseError());
  rest_ = -std::numeric_limits<float>::infinity();
}

void LineSeparation::setLimit(double distance) {
  const double rest = along_ - distance * length_ * (1 + 0x1p-48) - error_;
  rest_ = static_cast<float>(rest - std::abs(rest) / (1 << 22));
}

}  // namespace adaptive_bvh
