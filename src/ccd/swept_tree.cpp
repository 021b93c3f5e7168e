#include "ccd/swept_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

/// Bound of the coordinates that a frame holds, in the world.
double largestCoordinate(const SweptFrame& frame) {
  return frame.origin.lpNorm<Eigen::Infinity>() + 2 / frame.scale;
}

/// Bound of the error of a position, and of its rounding in double precision.
double errorInFrame(const MovingMesh& mesh, const SweptFrame& frame) {
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  return mesh.error + kRounding * largestCoordinate(frame);
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
  *this = SweptFrame(low, high);
}

SweptFrame::SweptFrame(const fcl::Vector3d& low, const fcl::Vector3d& high) {
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

/// Sets the positions of a slot, and the box of all points within `radius` of these.
ADAPTIVE_BVH_INLINE void SweptTree::setSlot(std::size_t slot, const Float4& begin,
                                            const Float4& end, float radius) {
  const Float4 margin = margin_ + float4::all(radius);
  begins_[slot] = begin;
  ends_[slot] = end;
  boxes_[slot] = {float4::lower(begin, end) - margin, float4::upper(begin, end) + margin};
}

/// Computes all boxes. set(slot, vertex) sets those of vertices. Their margin covers
/// `error`, that of positions, their rounding in single precision, and the padding.
template <typename Set>
void SweptTree::refit(const MovingMesh& mesh, const SweptFrame& frame, double padding, double error,
                      const Set& set) {
  resize(mesh);
  position_error_ = kPositionError + frame.lengthUp(std::max(error, errorInFrame(mesh, frame)));
  margin_ = float4::all(4 * position_error_ + frame.lengthUp(padding));
  const std::vector<unsigned>& vertices = mesh.slots->vertices();
  for (std::size_t i = 0; i < vertices.size(); ++i) set(i, vertices[i]);
  refitNodes(mesh);
}

void SweptTree::refit(const MovingMesh& mesh, const SweptFrame& frame, const TimeInterval& interval,
                      double padding) {
  const double begin = interval.begin, end = interval.end;
  refit(mesh, frame, padding, 0, [&](std::size_t i, unsigned v) {
    const fcl::Vector3d &from = mesh.start[v], &to = mesh.end[v];
    setSlot(i, frame(begin == 0 ? from : fcl::Vector3d((1 - begin) * from + begin * to)),
            frame(end == 1 ? to : fcl::Vector3d((1 - end) * from + end * to)));
  });
}

void SweptTree::refitOverShares(const MovingMesh& mesh, const SweptFrame& frame, double padding,
                                const std::vector<double>& shares, double most) {
  const double between =
      mesh.between_error + 8 * rounding::epsilon<double>() * largestCoordinate(frame);
  refit(mesh, frame, padding, between, [&](std::size_t i, unsigned v) {
    const fcl::Vector3d& start = mesh.start[v];
    const fcl::Vector3d motion = mesh.end[v] - start;
    const double length = motion.norm(), share = shares[v];
    const double part = share * length > most ? most / length : share;
    setSlot(i, frame(start), frame(start + part * motion));
  });
}

void SweptTree::refitAroundStarts(const MovingMesh& mesh, const SweptFrame& frame, double padding,
                                  const std::vector<double>& radii, double most) {
  refit(mesh, frame, padding, 0, [&](std::size_t i, unsigned v) {
    const Float4 start = frame(mesh.start[v]);
    setSlot(i, start, start, frame.lengthUp(std::min(radii[v], most)));
  });
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
