// Boxes of moving bodies at two times.
#include "ccd/moving_boxes.h"

#include <algorithm>

namespace adaptive_bvh {

void MovingBoxes::assign(const MovingBody& body, double scale, double begin, double end) {
  const MovingBody::At ends[2] = {body.at(begin), body.at(end)};
  for (int e = 0; e < 2; ++e) origins_[e] = ends[e].frame(body.middle());
  size_ = 2 * body.radius() * scale;
  is_lazy_ = body.mesh() && body.isUndeformed() && body.frame().isRigid();
  ++epoch_;
  if (!body.mesh()) return assignSolid(body, scale, ends);
  const WideTree& tree = body.mesh()->tree;
  links_ = tree.nodes();
  depth_ = tree.depth();
  const auto count = static_cast<std::size_t>(tree.size());
  if (made_.size() < count) {
    for (auto& nodes : nodes_) nodes.resize(count);
    made_.resize(count);
  }
  if (!is_lazy_) return assignDeformed(body, scale, ends);
  for (int e = 0; e < 2; ++e) {
    const BodyCoordinates& own = tree.coordinates();
    const double factor = scale / own.scale;
    const fcl::Vector3d origin = ends[e].frame(own.origin);
    const fcl::Matrix3d turn = factor * ends[e].frame.linear * own.axes();
    const fcl::Vector3d offset = scale * (origin - origins_[e]);
    // Of coordinates below 2 in the tree's unit: the rounding of the matrix, of centres and half
    // sides, of products and sums.
    const double reach = turn.cwiseAbs().rowwise().sum().maxCoeff();
    const double rounding = kFloatUnit * (32 * reach + 4 * offset.lpNorm<Eigen::Infinity>());
    changes_[e] =
        FrameChange(turn, offset, rounding + 2 * scale * body.error() + 8 * kFloatUnit * size_);
  }
}

void MovingBoxes::make(std::size_t node) {
  made_[node] = epoch_;
  for (int e = 0; e < 2; ++e) nodes_[e][node].boxes = changes_[e](links_[node].boxes);
}

void MovingBoxes::assignDeformed(const MovingBody& body, double scale,
                                 const MovingBody::At (&ends)[2]) {
  const std::size_t count = body.mesh()->vertices.size();
  margin_ = float4::all(static_cast<float>(16 * kFloatUnit * size_ + 4 * scale * body.error()));
  for (std::size_t e = 0; e < 2; ++e) {
    positions_[e].resize(count);
    for (std::size_t v = 0; v < count; ++v) {
      const fcl::Vector3d y = scale * (body.vertex(v, ends[e]) - origins_[e]);
      positions_[e][v] =
          Float4{static_cast<float>(y[0]), static_cast<float>(y[1]), static_cast<float>(y[2]), 0};
    }
  }
  for (std::size_t e = 0; e < 2; ++e)
    for (auto i = static_cast<std::size_t>(body.mesh()->tree.size()); i-- > 0;) {
      WideNode& node = nodes_[e][i];
      const WideNode& links = links_[i];
      std::copy(links.below, links.below + 4, node.below);
      node.first = links.first;
      node.count = links.count;
      if (node.isLeaf())
        refitLeaf(body.mesh()->tree, e, node);
      else
        refitInner(node, nodes_[e].data());
    }
}

void MovingBoxes::refitLeaf(const WideTree& tree, std::size_t end, WideNode& leaf) const {
  const Box none = {float4::all(kNowhere), float4::all(-kNowhere)};
  const std::vector<Float4>& positions = positions_[end];
  Box boxes[4] = {none, none, none, none};
  for (int i = 0; i < int(leaf.count); ++i) {
    const Int4& v = tree.corners(static_cast<unsigned>(leaf.first + i));
    const Float4 &a = positions[std::size_t(v[0])], &b = positions[std::size_t(v[1])],
                 &c = positions[std::size_t(v[2])];
    boxes[i] = {float4::lower<Float4>(float4::lower<Float4>(a, b), c) - margin_,
                float4::upper<Float4>(float4::upper<Float4>(a, b), c) + margin_};
  }
  leaf.boxes = boxes4(boxes[0], boxes[1], boxes[2], boxes[3]);
}

/// A plane or half-space has no box.
void MovingBoxes::assignSolid(const MovingBody& body, double scale,
                              const MovingBody::At (&ends)[2]) {
  single_.first = 0;
  single_.count = 1;
  single_.leaf = 0;
  links_ = &single_;
  depth_ = 1;
  for (auto& nodes : nodes_)
    if (nodes.empty()) nodes.resize(1);
  if (body.flat()) return;
  const double margin = 16 * kFloatUnit * size_ + 4 * scale * body.error();
  for (int e = 0; e < 2; ++e) {
    Boxes4 boxes = kEmptyBoxes;
    for (int k = 0; k < 3; ++k) {
      const auto side = [&](double sign) -> double {
        return scale * (body.support(ends[e], sign * fcl::Vector3d::Unit(k))[k] - origins_[e][k]);
      };
      boxes.low[k][0] = static_cast<float>(side(-1) - margin);
      boxes.high[k][0] = static_cast<float>(side(1) + margin);
    }
    nodes_[e][0].boxes = boxes;
  }
}

}  // namespace adaptive_bvh
