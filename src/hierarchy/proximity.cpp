#include "hierarchy/proximity.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace adaptive_bvh {
namespace {

/// The low 21 bits of x, two zeros after each.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

}  // namespace

Scratch<unsigned> mortonOrder(const Scratch<AlignedBox>& boxes) {
  AlignedBox all;
  for (const AlignedBox& box : boxes) all.extend(box.center());
  const double extent = boxes.empty() ? 0 : all.sizes().maxCoeff();
  const double scale = extent > 1e-290 ? 0x1fffff / extent : 0;

  Scratch<std::pair<std::uint64_t, unsigned>> keyed;
  keyed.reserve(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Eigen::Vector3d cell = (boxes[i].center() - all.min()) * scale;
    std::uint64_t code = 0;
    for (int k = 0; k < 3; ++k) code |= spread(static_cast<std::uint64_t>(cell[k])) << k;
    keyed.emplace_back(code, static_cast<unsigned>(i));
  }
  std::sort(keyed.begin(), keyed.end());
  Scratch<unsigned> order;
  order.reserve(keyed.size());
  for (const auto& entry : keyed) order.push_back(entry.second);
  return order;
}

Scratch<Link> proximityLinks(const Scratch<AlignedBox>& boxes_in_order) {
  constexpr std::size_t kWindow = 4;
  Scratch<Link> links;
  links.reserve(kWindow * boxes_in_order.size());
  for (std::size_t i = 0; i < boxes_in_order.size(); ++i)
    for (std::size_t j = i + 1; j < std::min(boxes_in_order.size(), i + 1 + kWindow); ++j) {
      const AlignedBox around = boxes_in_order[i].merged(boxes_in_order[j]);
      links.push_back(
          {static_cast<unsigned>(i), static_cast<unsigned>(j), -around.diagonal().squaredNorm()});
    }
  return links;
}

}  // namespace adaptive_bvh
