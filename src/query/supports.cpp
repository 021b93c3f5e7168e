#include "query/supports.h"

#include <algorithm>
#include <limits>

namespace adaptive_bvh {

template <typename S>
void Supports::compute(const WideTree& tree, const fcl::Vector3<S>* vertices,
                       const fcl::Vector3d& from, const fcl::Vector3d& direction) {
  const std::vector<unsigned>& vertex_of = tree.slots().vertices();
  of_slot_.resize(vertex_of.size());
  for (std::size_t i = 0; i < vertex_of.size(); ++i)
    of_slot_[i] = direction.dot(vertices[vertex_of[i]].template cast<double>() - from);
  reaches_.resize(static_cast<std::size_t>(tree.size()));
  for (int n = tree.size(); n-- > 0;) {
    const WideNode& node = tree.nodes()[n];
    Four& reach = reaches_[static_cast<std::size_t>(n)];
    for (int i = 0; i < 4; ++i) {
      if (i >= int(node.count)) {
        reach.of[i] = -std::numeric_limits<double>::infinity();
      } else if (node.isLeaf()) {
        const VertexIndices at =
            tree.slots().slotsOf(static_cast<std::size_t>(node.first) + std::size_t(i));
        reach.of[i] = std::max(std::max(of_slot_[at[0]], of_slot_[at[1]]), of_slot_[at[2]]);
      } else {
        const double* const below = reaches_[static_cast<std::size_t>(node.below[i])].of;
        reach.of[i] = std::max(std::max(below[0], below[1]), std::max(below[2], below[3]));
      }
    }
  }
}

template <typename S>
void LineSeparation::compute(const WideTree& first, const WideTree& second,
                             const TriangleSeparation<S>& triangles) {
  const typename TriangleSeparation<S>::Line& line = triangles.line();
  first_.compute(first, triangles.vertices1(), line.from, line.along1);
  second_.compute(second, triangles.vertices2(), line.to, -line.along2);
  offset_ = line.offset;
  setLimit(std::numeric_limits<double>::infinity());
}

template void LineSeparation::compute(const WideTree&, const WideTree&,
                                      const TriangleSeparation<float>&);
template void LineSeparation::compute(const WideTree&, const WideTree&,
                                      const TriangleSeparation<double>&);
template void Supports::compute(const WideTree&, const fcl::Vector3f*, const fcl::Vector3d&,
                                const fcl::Vector3d&);
template void Supports::compute(const WideTree&, const fcl::Vector3d*, const fcl::Vector3d&,
                                const fcl::Vector3d&);

}  // namespace adaptive_bvh
