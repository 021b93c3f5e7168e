// Boxes of moving bodies at two times.
#include "ccd/moving_boxes.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

template <typename T>
void enlargeTo(std::size_t size, std::vector<T>& elements) {
  if (elements.size() < size) elements.resize(size);
}

}  // namespace

void MovingBoxes::assign(const MovingBody& body, double scale, double begin, double end) {
  body_ = &body;
  scale_ = scale;
  ends_[0] = body.at(begin);
  ends_[1] = body.at(end);
  for (int e = 0; e < 2; ++e) origins_[e] = ends_[e].frame(body.middle());
  const double deviation = std::max(body.deviation(begin), body.deviation(end));
  size_ = 2 * scale * (body.radius() + 2 * std::min(deviation, body.radius()));
  margin_ = float4::all(static_cast<float>(16 * kFloatUnit * size_ + 4 * scale * body.error()));
  ++epoch_;
  if (body.mesh())
    assignMesh();
  else
    assignSolid();
}

void MovingBoxes::assignMesh() {
  constexpr double kCoarse = 16;  // boxes grow by at most an eighth of their largest side
  const WideTree& tree = body_->mesh()->tree;
  links_ = tree.nodes();
  depth_ = tree.depth();
  enlargeTo(static_cast<std::size_t>(tree.size()), nodes_);
  enlargeTo(body_->mesh()->vertices.size(), vertices_);
  const BodyCoordinates& own = tree.coordinates();
  const double factor = scale_ / own.scale;
  double most = 0;
  for (int e = 0; e < 2; ++e) {
    const FrameAt& frame = ends_[e].frame;
    const fcl::Matrix3d turn = factor * frame.linear * own.axes();
    const fcl::Vector3d offset = scale_ * (frame(own.origin) - origins_[e]);
    // Of coordinates below 2 in the tree's unit: the rounding of the matrix, of centres and half
    // sides, of products and sums.
    const double reach = turn.cwiseAbs().rowwise().sum().maxCoeff();
    const double rounding = kFloatUnit * (32 * reach + 4 * offset.lpNorm<Eigen::Infinity>());
    const double deviation = body_->deviation(ends_[e].t);
    changes_[e] = FrameChange(
        turn, offset,
        std::min(rounding + scale_ * (2 * body_->error() + deviation) + 8 * kFloatUnit * size_,
                 double(kNowhere)));
    most = std::max(most, deviation);
  }
  least_side_ = static_cast<float>(std::min(kCoarse * own.scale * most, double(kNowhere)));
}

/// Whether boxes of the mesh's tree are large enough to be enlarged by how far vertices are from
/// the positions of the tree.
bool MovingBoxes::isCoarse(const WideNode& links) const {
  Float4 side = float4::all(0);
  for (int k = 0; k < 3; ++k)
    side = float4::upper<Float4>(side, links.boxes.high[k] - links.boxes.low[k]);
  return float4::bits(side >= float4::all(least_side_)) != 0;
}

void MovingBoxes::make(int node) {
  const WideNode& links = links_[node];
  if (links.isLeaf() || !isCoarse(links)) return makeBelow(node);
  Node& made = nodes_[static_cast<std::size_t>(node)];
  made.epoch = epoch_;
  for (int e = 0; e < 2; ++e) made.boxes.at[e] = changes_[e](links.boxes);
}

/// Makes the boxes of a node and of those below from the positions of vertices.
void MovingBoxes::makeBelow(int node) {
  const WideNode& links = links_[node];
  Node& made = nodes_[static_cast<std::size_t>(node)];
  made.epoch = epoch_;
  if (links.isLeaf()) return makeLeaf(links, made.boxes);
  for (int lane = 0; lane < int(links.count); ++lane)
    if (!isMade(links.below[lane])) makeBelow(links.below[lane]);
  for (int e = 0; e < 2; ++e)
    refitInner(
        links, [&](int child) -> const Boxes4& { return nodes_[std::size_t(child)].boxes.at[e]; },
        made.boxes.at[e]);
}

void MovingBoxes::makeLeaf(const WideNode& leaf, MovingNode& node) {
  const Box none = {float4::all(kNowhere), float4::all(-kNowhere)};
  Box boxes[2][4] = {{none, none, none, none}, {none, none, none, none}};
  for (int i = 0; i < int(leaf.count); ++i) {
    const Int4& v = body_->mesh()->tree.corners(static_cast<unsigned>(leaf.first + i));
    const Float4 *const a = positionsOf(v[0]), *const b = positionsOf(v[1]),
                        *const c = positionsOf(v[2]);
    for (int e = 0; e < 2; ++e)
      boxes[e][i] = {float4::lower<Float4>(float4::lower<Float4>(a[e], b[e]), c[e]) - margin_,
                     float4::upper<Float4>(float4::upper<Float4>(a[e], b[e]), c[e]) + margin_};
  }
  for (int e = 0; e < 2; ++e)
    node.at[e] = boxes4(boxes[e][0], boxes[e][1], boxes[e][2], boxes[e][3]);
}

/// The positions of a vertex at both ends.
const Float4* MovingBoxes::positionsOf(int vertex) {
  const auto v = static_cast<std::size_t>(vertex);
  Vertex& moved = vertices_[v];
  if (moved.epoch == epoch_) return moved.at;
  moved.epoch = epoch_;
  for (int e = 0; e < 2; ++e) {
    const fcl::Vector3d y = scale_ * (body_->vertex(v, ends_[e]) - origins_[e]);
    moved.at[e] =
        Float4{static_cast<float>(y[0]), static_cast<float>(y[1]), static_cast<float>(y[2]), 0};
  }
  return moved.at;
}

/// A plane or half-space has no box.
void MovingBoxes::assignSolid() {
  single_.first = 0;
  single_.count = 1;
  single_.leaf = 0;
  links_ = &single_;
  depth_ = 1;
  enlargeTo(1, nodes_);
  nodes_[0].epoch = epoch_;
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
    nodes_[0].boxes.at[e] = boxes;
  }
}

}  // namespace adaptive_bvh
