#include "ccd/swept_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

/// Returns a float that is at least x; x >= 0.
float roundedUp(double x) {
  constexpr double kLargest = 1e20;  // boxes of this size overlap all others
  return static_cast<float>(std::min(x, kLargest)) * (1 + 1.f / (1 << 20));
}

/// Sets the boxes of a leaf. `vertices`: boxes of vertices, by slot.
void refitLeaf(WideNode& node, const VertexSlots& slots, const Box* vertices) {
  Box boxes[4];
  for (Box& box : boxes) box = {float4::all(kNowhere), float4::all(-kNowhere)};
  for (int i = 0; i < node.count; ++i) {
    const VertexIndices corners = slots.slotsOf(std::size_t(node.first) + std::size_t(i));
    boxes[i] = vertices[corners[0]];
    boxes[i].add(vertices[corners[1]]);
    boxes[i].add(vertices[corners[2]]);
  }
  node.boxes = boxes4(boxes[0], boxes[1], boxes[2], boxes[3]);
}

}  // namespace

SweptFrame::SweptFrame(const MovingMesh& first, const MovingMesh& second) {
  fcl::Vector3d low = first.start[0], high = low;
  const auto add = [&](const fcl::Vector3d* positions, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      low = low.cwiseMin(positions[i]);
      high = high.cwiseMax(positions[i]);
    }
  };
  const MovingMesh* const meshes[2] = {&first, &second};
  for (int i = 0; i < (&first == &second ? 1 : 2); ++i) {
    add(meshes[i]->start, meshes[i]->num_vertices);
    add(meshes[i]->end, meshes[i]->num_vertices);
  }
  origin = 0.5 * (low + high);
  const double size = std::max((high - low).maxCoeff(), 1e-250);
  scale = std::ldexp(1., 1 - std::ilogb(size));  // half of the size is below 2
}

void SweptTree::resize(const MovingMesh& mesh) {
  nodes_.resize(static_cast<std::size_t>(mesh.num_nodes));
  boxes_.resize(mesh.slots->size());
  begins_.resize(mesh.slots->size());
  ends_.resize(mesh.slots->size());
  vertex_boxes_.resize(mesh.features->vertices().size() / 4);
  edge_boxes_.resize(mesh.features->edges().size() / 4);
}

/// Sets the margin of boxes. It covers the error of the mesh's positions, their rounding in double
/// and in single precision, and the padding.
void SweptTree::setMargin(const MovingMesh& mesh, const SweptFrame& frame, double padding) {
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  const double coordinate = frame.origin.lpNorm<Eigen::Infinity>() + 2 / frame.scale;
  position_error_ = kPositionError + roundedUp(frame.scale * (mesh.error + kRounding * coordinate));
  margin_ = float4::all(4 * position_error_ + roundedUp(frame.scale * padding));
}

void SweptTree::refit(const MovingMesh& mesh, const SweptFrame& frame, const TimeInterval& interval,
                      double padding) {
  resize(mesh);
  setMargin(mesh, frame, padding);
  const std::vector<unsigned>& vertices = mesh.slots->vertices();
  const Float4 margin = margin_;
  const double begin = interval.begin, end = interval.end;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const fcl::Vector3d &from = mesh.start[vertices[i]], &to = mesh.end[vertices[i]];
    const Float4 a = frame(begin == 0 ? from : fcl::Vector3d((1 - begin) * from + begin * to));
    const Float4 b = frame(end == 1 ? to : fcl::Vector3d((1 - end) * from + end * to));
    begins_[i] = a;
    ends_[i] = b;
    boxes_[i] = {float4::lower(a, b) - margin, float4::upper(a, b) + margin};
  }
  refitNodes(mesh);
}

void SweptTree::refitAroundStarts(const MovingMesh& mesh, const SweptFrame& frame,
                                  const std::vector<double>& radii, double most, double padding) {
  resize(mesh);
  setMargin(mesh, frame, padding);
  const std::vector<unsigned>& vertices = mesh.slots->vertices();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const double length = std::min(radii[vertices[i]], most);
    const Float4 half_side = margin_ + float4::all(roundedUp(frame.scale * length));
    begins_[i] = ends_[i] = frame(mesh.start[vertices[i]]);
    boxes_[i] = {begins_[i] - half_side, begins_[i] + half_side};
  }
  refitNodes(mesh);
}

/// Sets the boxes of the features of a leaf, from those of the vertices.
void SweptTree::refitFeatures(const MovingMesh& mesh, const FeatureLeaves::Leaf& leaf) {
  const Box none = {float4::all(kNowhere), float4::all(-kNowhere)};
  for (unsigned i = 0; i < leaf.num_vertices; i += 4) {
    const OwnedVertex* const v = &mesh.features->vertices()[4 * leaf.vertices + i];
    const auto box = [&](unsigned k) {
      return i + k < leaf.num_vertices ? boxes_[v[k].slot] : none;
    };
    vertex_boxes_[leaf.vertices + i / 4] = boxes4(box(0), box(1), box(2), box(3));
  }
  for (unsigned i = 0; i < leaf.num_edges; i += 4) {
    const OwnedEdge* const e = &mesh.features->edges()[4 * leaf.edges + i];
    const auto box = [&](unsigned k) {
      if (i + k >= leaf.num_edges) return none;
      Box both = boxes_[e[k].slots[0]];
      both.add(boxes_[e[k].slots[1]]);
      return both;
    };
    edge_boxes_[leaf.edges + i / 4] = boxes4(box(0), box(1), box(2), box(3));
  }
}

/// Copies the links of all nodes and sets their boxes, children first.
void SweptTree::refitNodes(const MovingMesh& mesh) {
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    WideNode& node = nodes_[i];
    const WideNode& links = mesh.nodes[i];
    std::copy(links.below, links.below + 4, node.below);
    node.first = links.first;
    node.count = links.count;
    node.leaf = links.leaf;
    if (node.isLeaf()) {
      refitLeaf(node, *mesh.slots, boxes_.data());
      refitFeatures(mesh, SweptTree::leaf(mesh, node));
    } else {
      refitInner(node, nodes_.data());
    }
  }
}

}  // namespace adaptive_bvh
