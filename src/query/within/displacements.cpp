#include "query/within/displacements.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
/// Displacements in units of the limit, beyond which single precision is too coarse.
constexpr double kFarthest = 1e4;
/// Exceeds the rounding of a displacement to single precision, relative to it.
constexpr float kDisplacementRounding = 1.f / (1 << 22);

Box emptyBox() { return {float4::all(kInfinite), float4::all(-kInfinite)}; }

/// A box of displacements, enlarged by their rounding.
Box withRounding(const Box& box) {
  const Float4 rounding =
      float4::upper<Float4>(float4::absolute(box.low), float4::absolute(box.high)) *
      float4::all(kDisplacementRounding);
  return {box.low - rounding, box.high + rounding};
}

Box boxOfLeaf(const WideTree& tree, const WideNode& leaf, const std::vector<Float4>& to) {
  Box box = emptyBox();
  for (int i = 0; i < int(leaf.count); ++i) {
    const Int4& v = tree.corners(unsigned(leaf.first + i));
    for (int k = 0; k < 3; ++k) box.add(to[std::size_t(v[k])]);
  }
  return withRounding(box);
}

}  // namespace

/// Sums over the vertices, and over the leaves, of both meshes. In units of the limit.
struct Displacements::Sums {
  std::size_t vertices = 0, leaves = 0, moved_leaves = 0;
  fcl::Vector3d total = fcl::Vector3d::Zero();
  double squares = 0, largest = 0;  ///< of squared lengths
  double of_leaves = 0;
};

void Displacements::restart(const KeptMeshes& meshes) {
  is_self_ = meshes.is_self;
  for (int i = 0; i < meshes.sides(); ++i)
    meshes.withMap(i, [&](const auto& map) {
      const std::vector<fcl::Vector3d>& now = meshes.mesh(i).vertices;
      std::vector<fcl::Vector3d>& from = sides_[std::size_t(i)].from;
      from.resize(now.size());
      for (std::size_t v = 0; v < from.size(); ++v) from[v] = map(now[v]);
    });
}

void Displacements::measure(const KeptMeshes& meshes, double limit) {
  Sums sums;
  fcl::Vector3d means[2];
  for (int i = 0; i < meshes.sides(); ++i) {
    const fcl::Vector3d before = sums.total;
    Side& side = sides_[std::size_t(i)];
    meshes.withMap(
        i, [&](const auto& map) { measureVertices(meshes.mesh(i), map, limit, side, sums); });
    means[i] = (sums.total - before) / double(side.from.size());
  }
  const Box &first = sides_[0].all, &second = sides_[is_self_ ? 0 : 1].all;
  const double n = double(sums.vertices), most = std::sqrt(double(largestSquare(first, second))),
               apart = is_self_ ? 0 : (means[0] - means[1]).norm();
  largest_ = limit * most;
  local_ = limit * apart;
  deviation_ = limit * std::sqrt(std::max(0., sums.squares / n - (sums.total / n).squaredNorm()));
  moved_ = apart > 1 || !(sums.largest < kFarthest * kFarthest) ? 1 : 0;
  if (most <= 1 || moved_ == 1) return;
  for (int i = 0; i < meshes.sides(); ++i)
    fitNodes(meshes.mesh(i).tree, sides_[std::size_t(i)], sums);
  moved_ = double(sums.moved_leaves) / double(sums.leaves);
  local_ = std::max(local_, limit * sums.of_leaves / double(sums.leaves));
}

template <typename ToFirst>
void Displacements::measureVertices(const MeshState& mesh, const ToFirst& to_first, double limit,
                                    Side& side, Sums& sums) {
  const double scale = 1 / limit;
  side.to.resize(side.from.size());
  Box all = emptyBox();
  for (std::size_t v = 0; v < side.from.size(); ++v) {
    const fcl::Vector3d u = (to_first(mesh.vertices[v]) - side.from[v]) * scale;
    side.to[v] =
        Float4{static_cast<float>(u[0]), static_cast<float>(u[1]), static_cast<float>(u[2]), 0};
    all.add(side.to[v]);
    const double square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    sums.total += u;
    sums.squares += square;
    sums.largest = std::max(sums.largest, square);
  }
  sums.vertices += side.from.size();
  side.all = withRounding(all);
}

/// Fits boxes, children first: they have larger numbers.
void Displacements::fitNodes(const WideTree& tree, Side& side, Sums& sums) {
  side.nodes.resize(static_cast<std::size_t>(tree.size()));
  for (int n = tree.size(); n-- > 0;) {
    const WideNode& node = tree.nodes()[n];
    Box& box = side.nodes[std::size_t(n)];
    if (node.isLeaf()) {
      box = boxOfLeaf(tree, node, side.to);
      const float square = largestSquare(box, box);
      ++sums.leaves;
      sums.moved_leaves += !(square <= 1);
      sums.of_leaves += std::sqrt(double(square));
      continue;
    }
    box = side.nodes[std::size_t(node.below[0])];
    for (int i = 1; i < int(node.count); ++i) box.add(side.nodes[std::size_t(node.below[i])]);
  }
}

}  // namespace adaptive_bvh
