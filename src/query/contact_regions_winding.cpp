#include "query/contact_regions_winding.h"

#include <algorithm>

namespace adaptive_bvh {

void SurfaceWinding::build(const ClosedSurfaces& bodies, Operand body,
                           const SurfaceCrossings& crossings) {
  labelVertices(bodies[indexOf(body)], body, crossings);
  connectLabels(body, crossings);
  setNumbers(bodies, body);
}

void SurfaceWinding::labelVertices(const ClosedSurface& surface, Operand body,
                                   const SurfaceCrossings& crossings) {
  const std::size_t count = surface.points.size();
  labels_.assign(count, kNoLabel);
  has_cuts_.assign(count, 0);
  first_vertices_.clear();
  for (const SurfaceCrossings::Range& edge : crossings.edges()) {
    const CrossingNode& node = crossings.nodes()[edge.begin];
    if (node.body == body) has_cuts_[node.low] = has_cuts_[node.high] = 1;
  }
  for (unsigned v = 0; v < count; ++v)
    if (labels_[v] == kNoLabel && surface.topology->vertex_triangles[v].size() > 0)
      flood(v, surface, body, crossings);
}

/// Gives a new label to all vertices that edges without crossings connect with one.
void SurfaceWinding::flood(unsigned from, const ClosedSurface& surface, Operand body,
                           const SurfaceCrossings& crossings) {
  const auto label = static_cast<unsigned>(first_vertices_.size());
  first_vertices_.push_back(from);
  labels_[from] = label;
  stack_.assign(1, from);
  while (!stack_.empty()) {
    const unsigned v = stack_.back();
    stack_.pop_back();
    for (const unsigned t : surface.topology->vertex_triangles[v])
      for (const unsigned next : surface.corners(t)) {
        if (labels_[next] != kNoLabel) continue;
        const bool may_cross = has_cuts_[v] && has_cuts_[next];
        if (may_cross && !crossings.along(body, v, next).isEmpty()) continue;
        labels_[next] = label;
        stack_.push_back(next);
      }
  }
}

/// The root of a label, which becomes its parent.
unsigned SurfaceWinding::rootOf(unsigned label) {
  unsigned root = label;
  int offset = 0;
  for (; parents_[root] != root; root = parents_[root]) offset += offsets_[root];
  while (parents_[label] != root && label != root) {
    const unsigned next = parents_[label];
    const int rest = offset - offsets_[label];
    parents_[label] = root;
    offsets_[label] = offset;
    offset = rest;
    label = next;
  }
  return root;
}

void SurfaceWinding::connectLabels(Operand body, const SurfaceCrossings& crossings) {
  parents_.resize(first_vertices_.size());
  offsets_.assign(first_vertices_.size(), 0);
  for (unsigned i = 0; i < parents_.size(); ++i) parents_[i] = i;
  for (const SurfaceCrossings::Range& edge : crossings.edges()) {
    const CrossingNode& node = crossings.nodes()[edge.begin];
    if (node.body != body) continue;
    int change = 0;
    for (unsigned i = edge.begin; i < edge.end; ++i) change += crossings.nodes()[i].sign;
    const unsigned low = labels_[node.low], high = labels_[node.high];
    const unsigned low_root = rootOf(low), high_root = rootOf(high);
    if (low_root == high_root) continue;
    parents_[high_root] = low_root;
    offsets_[high_root] = offsets_[low] + change - offsets_[high];
  }
}

SurfaceWinding::Box SurfaceWinding::boxAround(const ClosedSurface& surface) {
  Box box{surface.points[0], surface.points[0]};
  for (const fcl::Vector3d& p : surface.points) {
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  }
  return box;
}

/// Sets the number of each root: 0 if a vertex is outside of the other body's box, else by a ray.
void SurfaceWinding::setNumbers(const ClosedSurfaces& bodies, Operand body) {
  const ClosedSurface &surface = bodies[indexOf(body)], &other = bodies[indexOf(otherOf(body))];
  const Box box = boxAround(other);
  numbers_.assign(first_vertices_.size(), 0);
  is_known_.assign(first_vertices_.size(), 0);
  for (unsigned v = 0; v < labels_.size(); ++v) {
    if (labels_[v] == kNoLabel) continue;
    const fcl::Vector3d& p = surface.points[v];
    if (!(p.array() < box.low.array()).any() && !(p.array() > box.high.array()).any()) continue;
    const unsigned root = rootOf(labels_[v]);
    if (is_known_[root]) continue;
    is_known_[root] = 1;
    numbers_[root] = -offsets_[labels_[v]];
  }
  for (unsigned label = 0; label < numLabels(); ++label)
    if (parents_[label] == label && !is_known_[label])
      numbers_[label] = countAround(surface.points[first_vertices_[label]], body, other, box);
  for (unsigned label = 0; label < numLabels(); ++label) {
    const unsigned root = rootOf(label);
    if (root != label) numbers_[label] = numbers_[root] + offsets_[label];
  }
}

/// How often another body winds around a point: by the crossings of a ray along x.
int SurfaceWinding::countAround(const fcl::Vector3d& point, Operand body,
                                const ClosedSurface& other, const Box& box) {
  const double size = std::max(box.low.cwiseAbs().maxCoeff(), box.high.cwiseAbs().maxCoeff());
  fcl::Vector3d far = point;
  far[0] = box.high[0] + std::max(size, 1.);
  int number = 0;
  for (unsigned t = 0; t < other.numTriangles(); ++t) {
    const TrianglePoints<double> face = other.triangle(t);
    const fcl::Vector3d low = face[0].cwiseMin(face[1]).cwiseMin(face[2]),
                        high = face[0].cwiseMax(face[1]).cwiseMax(face[2]);
    if (high[0] < point[0] || low[1] > point[1] || high[1] < point[1] || low[2] > point[2] ||
        high[2] < point[2])
      continue;
    const int from = sideOfFace(face, point, body).sign, to = sideOfFace(face, far, body).sign;
    if (from * to < 0 && passesWithin(point, far, face, body)) number += from;
  }
  return number;
}

}  // namespace adaptive_bvh
