// Extents of nodes along a direction at two times.
#include "ccd/motion_supports.h"

#include <algorithm>
#include <limits>

namespace adaptive_bvh {
namespace {

constexpr double kEmptyExtent = -std::numeric_limits<double>::infinity();

}  // namespace

std::size_t MotionSupports::cost(const MovingBody& first, const MovingBody& second) {
  constexpr std::size_t kFewest = 64;
  std::size_t vertices = 0;
  for (const MovingBody* body : {&first, &second})
    if (body->mesh()) vertices += body->mesh()->vertices.size();
  return kFewest + vertices;
}

void MotionSupports::assign(const MovingBody& first, const MovingBody& second,
                            const fcl::Vector3d& n, double begin, double end) {
  const MovingBody::At ends1[2] = {first.at(begin), first.at(end)},
                       ends2[2] = {second.at(begin), second.at(end)};
  fcl::Vector3d origins1[2], origins2[2];
  for (int e = 0; e < 2; ++e) {
    origins1[e] = ends1[e].frame(first.middle());
    origins2[e] = ends2[e].frame(second.middle());
    room_[e] = n.dot(origins2[e] - origins1[e]) - first.arc(end - begin) - second.arc(end - begin) -
               8 * (first.error() + second.error());
  }
  assignBody(first, n, ends1, origins1, heights_, first_);
  assignBody(second, -n, ends2, origins2, heights_, second_);
  is_set_ = true;
}

/// Sets the extents along n of the nodes of one body, seen from its origin.
void MotionSupports::assignBody(const MovingBody& body, const fcl::Vector3d& n,
                                const MovingBody::At (&ends)[2], const fcl::Vector3d (&origins)[2],
                                std::vector<double> (&heights)[2], std::vector<Extents>& extents) {
  if (!body.mesh()) {
    extents.assign(1, {{{kEmptyExtent, kEmptyExtent, kEmptyExtent, kEmptyExtent},
                        {kEmptyExtent, kEmptyExtent, kEmptyExtent, kEmptyExtent}}});
    for (int e = 0; e < 2; ++e) extents[0].at[e][0] = n.dot(body.support(ends[e], n) - origins[e]);
    return;
  }
  const WideTree& tree = body.mesh()->tree;
  const std::size_t count = body.mesh()->vertices.size();
  extents.resize(static_cast<std::size_t>(tree.size()));
  for (std::size_t e = 0; e < 2; ++e) {
    heights[e].resize(count);
    for (std::size_t v = 0; v < count; ++v)
      heights[e][v] = n.dot(body.vertex(v, ends[e]) - origins[e]);
    for (std::size_t i = extents.size(); i-- > 0;) {
      const WideNode& node = tree.nodes()[i];
      double* const lanes = extents[i].at[e];
      std::fill(lanes, lanes + 4, kEmptyExtent);
      for (int k = 0; k < int(node.count); ++k) {
        if (node.isLeaf()) {
          const Int4& v = tree.corners(static_cast<unsigned>(node.first + k));
          lanes[k] = std::max({heights[e][std::size_t(v[0])], heights[e][std::size_t(v[1])],
                               heights[e][std::size_t(v[2])]});
        } else {
          const double* const below = extents[std::size_t(node.below[k])].at[e];
          lanes[k] = std::max({below[0], below[1], below[2], below[3]});
        }
      }
    }
  }
}

/// Extents are convex functions of time: in between, at most their linear interpolation.
unsigned MotionSupports::apart(int first, int second, double from, double to,
                               double distance) const {
  const Extents &a = first_[std::size_t(first)], &b = second_[std::size_t(second)];
  unsigned apart = 0xffff;
  for (const double share : {from, to}) {
    const auto at = [&](const double(&ends)[2]) -> double {
      return (1 - share) * ends[0] + share * ends[1];
    };
    const double room = at(room_) - distance;
    unsigned now = 0;
    for (int j = 0; j < 4; ++j) {
      const double of_second[2] = {b.at[0][j], b.at[1][j]};
      const double most = room - at(of_second);
      for (int i = 0; i < 4; ++i) {
        const double of_first[2] = {a.at[0][i], a.at[1][i]};
        now |= unsigned(at(of_first) <= most) << (4 * j + i);
      }
    }
    apart &= now;
  }
  return apart;
}

}  // namespace adaptive_bvh
