// Boxes of moving bodies at two times.
#include "ccd/moving_boxes.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

/// The boxes of the triangles of a leaf, each with its corners cornerOf(vertex) and a margin.
template <typename Corner>
Boxes4 boxesOfLeaf(const WideTree& tree, const WideNode& leaf, const Float4& margin,
                   const Corner& cornerOf) {
  const Box none = {float4::all(kNowhere), float4::all(-kNowhere)};
  Box boxes[4] = {none, none, none, none};
  for (int i = 0; i < int(leaf.count); ++i) {
    const Int4& v = tree.corners(static_cast<unsigned>(leaf.first + i));
    const Float4 a = cornerOf(std::size_t(v[0])), b = cornerOf(std::size_t(v[1])),
                 c = cornerOf(std::size_t(v[2]));
    boxes[i] = {float4::lower<Float4>(float4::lower<Float4>(a, b), c) - margin,
                float4::upper<Float4>(float4::upper<Float4>(a, b), c) + margin};
  }
  return boxes4(boxes[0], boxes[1], boxes[2], boxes[3]);
}

}  // namespace

void MovingBoxes::assign(const MovingBody& body, double scale, double begin, double end) {
  body_ = &body;
  scale_ = scale;
  ends_[0] = body.at(begin);
  ends_[1] = body.at(end);
  for (int e = 0; e < 2; ++e) origins_[e] = ends_[e].frame(body.middle());
  size_ = 2 * body.radius() * scale;
  margin_ = float4::all(static_cast<float>(16 * kFloatUnit * size_ + 4 * scale * body.error()));
  is_lazy_ = body.mesh() && body.isUndeformed() && body.frame().isRigid();
  ++epoch_;
  if (!body.mesh()) return assignSolid();
  const WideTree& tree = body.mesh()->tree;
  links_ = tree.nodes();
  depth_ = tree.depth();
  const auto count = static_cast<std::size_t>(tree.size());
  if (made_.size() < count) {
    for (auto& nodes : nodes_) nodes.resize(count);
    made_.resize(count);
  }
  if (is_lazy_)
    assignUndeformed();
  else
    assignDeformed();
}

void MovingBoxes::assignUndeformed() {
  const BodyCoordinates& own = body_->mesh()->tree.coordinates();
  const double factor = scale_ / own.scale;
  for (int e = 0; e < 2; ++e) {
    const FrameAt& frame = ends_[e].frame;
    const fcl::Matrix3d turn = factor * frame.linear * own.axes();
    const fcl::Vector3d offset = scale_ * (frame(own.origin) - origins_[e]);
    // Of coordinates below 2 in the tree's unit: the rounding of the matrix, of centres and half
    // sides, of products and sums.
    const double reach = turn.cwiseAbs().rowwise().sum().maxCoeff();
    const double rounding = kFloatUnit * (32 * reach + 4 * offset.lpNorm<Eigen::Infinity>());
    changes_[e] =
        FrameChange(turn, offset, rounding + 2 * scale_ * body_->error() + 8 * kFloatUnit * size_);
  }
}

void MovingBoxes::make(std::size_t node) {
  made_[node] = epoch_;
  const WideNode& links = links_[node];
  for (std::size_t e = 0; e < 2; ++e)
    nodes_[e][node].boxes = links.isLeaf()
                                ? boxesOfLeaf(body_->mesh()->tree, links, margin_,
                                              [&](std::size_t v) { return positionOf(v, e); })
                                : changes_[e](links.boxes);
}

Float4 MovingBoxes::positionOf(std::size_t vertex, std::size_t end) const {
  const fcl::Vector3d y = scale_ * (body_->vertex(vertex, ends_[end]) - origins_[end]);
  return Float4{static_cast<float>(y[0]), static_cast<float>(y[1]), static_cast<float>(y[2]), 0};
}

void MovingBoxes::assignDeformed() {
  const WideTree& tree = body_->mesh()->tree;
  positions_.resize(body_->mesh()->vertices.size());
  for (std::size_t e = 0; e < 2; ++e) {
    for (std::size_t v = 0; v < positions_.size(); ++v) positions_[v] = positionOf(v, e);
    std::vector<WideNode>& nodes = nodes_[e];
    for (auto i = static_cast<std::size_t>(tree.size()); i-- > 0;) {
      WideNode& node = nodes[i];
      const WideNode& links = links_[i];
      std::copy(links.below, links.below + 4, node.below);
      node.first = links.first;
      node.count = links.count;
      if (node.isLeaf())
        node.boxes = boxesOfLeaf(tree, node, margin_, [&](std::size_t v) { return positions_[v]; });
      else
        refitInner(node, nodes.data());
    }
  }
}

/// A plane or half-space has no box.
void MovingBoxes::assignSolid() {
  single_.first = 0;
  single_.count = 1;
  single_.leaf = 0;
  links_ = &single_;
  depth_ = 1;
  for (auto& nodes : nodes_)
    if (nodes.empty()) nodes.resize(1);
  if (body_->flat()) return;
  for (int e = 0; e < 2; ++e) {
    Boxes4 boxes = kEmptyBoxes;
    for (int k = 0; k < 3; ++k) {
      const auto side = [&](double sign) -> double {
        return scale_ *
               (body_->support(ends_[e], sign * fcl::Vector3d::Unit(k))[k] - origins_[e][k]);
      };
      boxes.low[k][0] = static_cast<float>(side(-1)) - margin_[0];
      boxes.high[k][0] = static_cast<float>(side(1)) + margin_[0];
    }
    nodes_[e][0].boxes = boxes;
  }
}

}  // namespace adaptive_bvh
