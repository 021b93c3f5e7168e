#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/LU>

#include "support/meshes.h"

// Whether the volumes of a model hold its triangles, in numbers that are finer than the model's.
namespace adaptive_bvh_test {

using Fine = long double;
using FinePoint = Eigen::Matrix<Fine, 3, 1>;

/// Whether the volume holds p. Any point of the rectangle bounds the distance from above, so this
/// never says yes wrongly but by the rounding of long double.
template <typename S>
bool holds(const fcl::RSS<S>& bv, const fcl::Vector3<S>& p) {
  const FinePoint a0 = bv.axis.col(0).template cast<Fine>();
  const FinePoint a1 = bv.axis.col(1).template cast<Fine>();
  const FinePoint d = p.template cast<Fine>() - bv.To.template cast<Fine>();
  const auto within = [](Fine x, S side) { return std::min(std::max(x, Fine(0)), Fine(side)); };
  Fine x = 0, y = 0;
  for (int k = 0; k < 3; ++k) {  // axes are orthogonal up to rounding: a few rounds find the point
    x = within(a0.dot(d - y * a1) / a0.squaredNorm(), bv.l[0]);
    y = within(a1.dot(d - x * a0) / a1.squaredNorm(), bv.l[1]);
  }
  return (d - x * a0 - y * a1).norm() <= Fine(bv.r);
}

/// Also the box, both as its extents along its axes and as the sums of its axes.
template <typename S>
bool holds(const fcl::OBBRSS<S>& bv, const fcl::Vector3<S>& p) {
  const Eigen::Matrix<Fine, 3, 3> axes = bv.obb.axis.template cast<Fine>();
  const FinePoint d = p.template cast<Fine>() - bv.obb.To.template cast<Fine>();
  const FinePoint extent = bv.obb.extent.template cast<Fine>();
  const FinePoint along = axes.transpose() * d, sums = axes.inverse() * d;
  return holds(bv.rss, p) && (along.cwiseAbs().array() <= extent.array()).all() &&
         (sums.cwiseAbs().array() <= extent.array()).all();
}

/// Nodes that do not hold one of the triangles below them: where it is and, after a two-frame
/// update, in the one before.
template <typename BV>
int failures(const fcl::BVHModel<BV>& model, long& checked) {
  // Every vertex below a node, not only those of its children's volumes: in preorder the nodes of a
  // subtree follow its root, so the vertices of leaves are gathered from the back.
  std::vector<std::vector<std::size_t>> below(std::size_t(model.getNumBVs()));
  int failed = 0;
  for (int i = model.getNumBVs() - 1; i >= 0; --i) {
    const auto& node = model.getBV(i);
    auto& mine = below[std::size_t(i)];
    if (node.isLeaf()) {
      const fcl::Triangle& t = model.tri_indices[node.primitiveId()];
      mine = {t[0], t[1], t[2]};
    } else {
      for (int child : {node.leftChild(), node.rightChild()}) {
        auto& theirs = below[std::size_t(child)];
        mine.insert(mine.end(), theirs.begin(), theirs.end());
        theirs.clear();
      }
    }
    bool sound = true;
    for (std::size_t v : mine) {
      sound = sound && holds(node.bv, model.vertices[v]);
      if (model.prev_vertices) sound = sound && holds(node.bv, model.prev_vertices[v]);
    }
    failed += !sound;
    ++checked;
  }
  return failed;
}

}  // namespace adaptive_bvh_test
