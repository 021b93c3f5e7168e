#include "query/regions/crossings.h"

#include <algorithm>
#include <tuple>

#include "base/shortcut.h"

namespace adaptive_bvh {
namespace {

auto edgeOf(const CrossingNode& node) { return std::make_tuple(node.body, node.low, node.high); }
/// The sort key. An edge crosses one face twice only if both crossings are one node.
auto orderOf(const CrossingNode& node) {
  return std::make_tuple(node.body, node.low, node.high, node.t, node.face);
}

/// Whether three points are on one side of a face, or the face has no area.
bool areOnOneSide(const std::array<FaceSide, 3>& sides) {
  return sides[0].sign == sides[1].sign && sides[1].sign == sides[2].sign;
}

/// Whether the relative error of `value`, the rounded orientation of a face and x, is at most
/// 2^-33. The product of lengths, `size`, underflows whenever the orientation may.
bool isPrecise(double value, const TrianglePoints& face, const fcl::Vector3d& x) {
  constexpr double kLeast = 0x1p-900;
  double size = 1;
  for (const fcl::Vector3d& corner : face) size *= (corner - x).lpNorm<Eigen::Infinity>();
  return value == 0 || (size > kLeast && std::fabs(value) > 0x1p-14 * size);
}

/// Returns where the line between two points on different sides of a face's plane crosses the
/// plane, from 0 (at p) to 1 (at q). `at_p`, `at_q`: rounded orientations. For needles and nearly
/// parallel faces these have hardly a correct digit; then exact ones replace them.
double crossingParameter(const TrianglePoints& face, const fcl::Vector3d& p, const fcl::Vector3d& q,
                         double at_p, double at_q) {
  if (isTaken(Shortcut::RoundedPredicates) && isPrecise(at_p, face, p) &&
      isPrecise(at_q, face, q)) {
    const double a = 0.25 * std::fabs(at_p), b = 0.25 * std::fabs(at_q);  // their sum is finite
    return a / (a + b);
  }
  countExact(ExactDecision::CrossingParameter);
  ExactSum above, whole;
  addOrientation(above, face[0], face[1], face[2], p);
  addOrientation(whole, face[0], face[1], face[2], p);
  addOrientation(whole, face[1], face[0], face[2], q);  // minus that of q
  return above.value() / whole.value();
}

/// Returns the point at t on the segment from a (t = 0) to b (t = 1), computed from the nearer end.
fcl::Vector3d between(const fcl::Vector3d& a, const fcl::Vector3d& b, double t) {
  if (t > 0.5) return b + (1 - t) * (a - b);
  return a + t * (b - a);
}

}  // namespace

bool areNear(const TrianglePoints& points, const TrianglePoints& face, double limit) {
  const fcl::Vector3d normal = (face[1] - face[0]).cross(face[2] - face[0]);
  const double least = limit * normal.norm();
  return std::all_of(points.begin(), points.end(), [&](const fcl::Vector3d& x) {
    return std::fabs(normal.dot(x - face[0])) < least;
  });
}

void SurfaceCrossings::build(const ClosedSurfaces& bodies, std::vector<TrianglePair>& pairs,
                             double rounding) {
  const auto key = [](const TrianglePair& p) { return std::make_pair(p.first, p.second); };
  std::sort(pairs.begin(), pairs.end(),
            [&](const TrianglePair& a, const TrianglePair& b) { return key(a) < key(b); });
  rounding_ = rounding;
  ends_.clear();
  segments_.clear();
  coplanar_.clear();
  for (const TrianglePair& pair : pairs) testPair(bodies, pair);
  collectNodes();
  collectEdges();
}

/// Adds the segment and nodes of two triangles, if they cross; also records coplanar pairs.
void SurfaceCrossings::testPair(const ClosedSurfaces& bodies, const TrianglePair& pair) {
  const TrianglePoints p = bodies[0].triangle(pair.first), q = bodies[1].triangle(pair.second);
  std::array<FaceSide, 3> sides1, sides2;
  for (std::size_t k = 0; k < 3; ++k) sides1[k] = sideOfFace(q, p[k], WhichBody::First);
  keepIfCoplanar(pair, p, q, sides1);
  // All signs are 0 for a face without area, but its edges may cross the other face.
  if (areOnOneSide(sides1) && sides1[0].sign != 0) return;
  for (std::size_t k = 0; k < 3; ++k) sides2[k] = sideOfFace(p, q[k], WhichBody::Second);
  if (areOnOneSide(sides2) && sides2[0].sign != 0) return;
  const std::size_t first_end = ends_.size();
  testEdges(bodies[0], WhichBody::First, pair, p, q, sides1);
  testEdges(bodies[1], WhichBody::Second, pair, q, p, sides2);
  keepIfWhole(first_end, pair);
}

/// Records two triangles if they are in one plane: the corners of each near that of the other.
void SurfaceCrossings::keepIfCoplanar(const TrianglePair& pair, const TrianglePoints& p,
                                      const TrianglePoints& q,
                                      const std::array<FaceSide, 3>& sides) {
  // An orientation is a height times twice the area of the face, which `most` bounds from above.
  // Nearly all pairs return here.
  const double most = (q[1] - q[0]).lpNorm<1>() * (q[2] - q[0]).lpNorm<1>();
  if (!(std::fabs(sides[0].value) <= rounding_ * most)) return;
  if (areNear(p, q, rounding_) && areNear(q, p, rounding_))
    coplanar_.push_back({pair.first, pair.second, sides});
}

/// Adds a node for each edge of one triangle that crosses the face of the other. `sides`: on which
/// sides of `face` the corners of `edges` lie.
void SurfaceCrossings::testEdges(const ClosedSurface& surface, WhichBody body,
                                 const TrianglePair& pair, const TrianglePoints& edges,
                                 const TrianglePoints& face, const std::array<FaceSide, 3>& sides) {
  const bool is_first = body == WhichBody::First;
  const VertexIndices v = surface.corners(is_first ? pair.first : pair.second);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if (sides[k].sign * sides[next].sign >= 0) continue;
    if (!passesWithin(edges[k], edges[next], face, body)) continue;
    const std::size_t low = v[k] < v[next] ? k : next, high = v[k] < v[next] ? next : k;
    const double t =
        crossingParameter(face, edges[low], edges[high], sides[low].value, sides[high].value);
    const CrossingNode node{body,
                            v[low],
                            v[high],
                            is_first ? pair.second : pair.first,
                            sides[high].sign,
                            t,
                            between(edges[low], edges[high], t)};
    // The part of the first body inside the second is to the segment's left. So where an edge of
    // the first enters the second, in the triangle's direction, the segment ends; where it leaves,
    // it starts. For edges of the second it is the other way round.
    const bool leaves = sides[k].sign > 0;
    ends_.push_back({node, 2 * static_cast<unsigned>(segments_.size()) + (leaves != is_first)});
  }
}

/// Keeps the nodes that were added for two triangles, from `first_end` on, if they are the start
/// and the end of one segment; else removes them.
void SurfaceCrossings::keepIfWhole(std::size_t first_end, const TrianglePair& pair) {
  if (ends_.size() == first_end) return;
  const bool is_whole = ends_.size() == first_end + 2 &&
                        (ends_[first_end].end_number ^ ends_[first_end + 1].end_number) == 1;
  if (is_whole)
    segments_.push_back({pair.first, pair.second, 0, 0});
  else
    ends_.resize(first_end);
}

/// Merges equal ends to nodes, and connects segments with them.
void SurfaceCrossings::collectNodes() {
  std::sort(ends_.begin(), ends_.end(), [](const SegmentEnd& a, const SegmentEnd& b) {
    return orderOf(a.node) < orderOf(b.node);
  });
  nodes_.clear();
  for (const SegmentEnd& end : ends_) {
    if (nodes_.empty() || orderOf(nodes_.back()) != orderOf(end.node)) nodes_.push_back(end.node);
    CrossingSegment& segment = segments_[end.end_number / 2];
    (end.end_number % 2 ? segment.end : segment.start) = static_cast<unsigned>(nodes_.size() - 1);
  }
}

/// Finds the range of nodes of each edge.
void SurfaceCrossings::collectEdges() {
  edges_.clear();
  for (unsigned i = 0; i < nodes_.size(); ++i) {
    if (i == 0 || edgeOf(nodes_[i]) != edgeOf(nodes_[i - 1])) edges_.push_back({i, i});
    edges_.back().end = i + 1;
  }
}

SurfaceCrossings::Range SurfaceCrossings::nodesOfEdge(WhichBody body, unsigned from,
                                                      unsigned to) const {
  const auto edge = std::make_tuple(body, std::min(from, to), std::max(from, to));
  const auto found = std::lower_bound(
      edges_.begin(), edges_.end(), edge,
      [&](const Range& range, const auto& key) { return edgeOf(nodes_[range.begin]) < key; });
  if (found == edges_.end() || edgeOf(nodes_[found->begin]) != edge) return {0, 0};
  return *found;
}

void SurfaceWinding::build(const ClosedSurfaces& bodies, WhichBody body,
                           const SurfaceCrossings& crossings) {
  labelVertices(bodies[indexOf(body)], body, crossings);
  connectLabels(body, crossings);
  setNumbers(bodies, body);
}

/// Labels the vertices, and records which ones have an edge with crossings.
void SurfaceWinding::labelVertices(const ClosedSurface& surface, WhichBody body,
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

/// Gives a new label to `from` and all vertices connected with it by edges without crossings.
void SurfaceWinding::flood(unsigned from, const ClosedSurface& surface, WhichBody body,
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
        if (may_cross && !crossings.nodesOfEdge(body, v, next).isEmpty()) continue;
        labels_[next] = label;
        stack_.push_back(next);
      }
  }
}

/// Returns the root of a label. Compresses the path: the root becomes the parent of all on it.
unsigned SurfaceWinding::rootOf(unsigned label) {
  unsigned root = label;
  int offset = 0;
  for (; parents_[root] != root; root = parents_[root]) offset += offsets_[root];
  while (parents_[label] != root && label != root) {
    const unsigned next = parents_[label];
    const int next_offset = offset - offsets_[label];
    parents_[label] = root;
    offsets_[label] = offset;
    offset = next_offset;
    label = next;
  }
  return root;
}

/// Connects the labels at both ends of each edge with crossings. Sets the offset of one root from
/// the other by the sum of the edge's signs.
void SurfaceWinding::connectLabels(WhichBody body, const SurfaceCrossings& crossings) {
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

/// Sets the number of each label. A vertex outside of the other body's box has the number 0. If a
/// root is connected with no such vertex, its number is counted along a ray.
void SurfaceWinding::setNumbers(const ClosedSurfaces& bodies, WhichBody body) {
  const ClosedSurface &surface = bodies[indexOf(body)], &other = bodies[indexOf(otherOf(body))];
  fcl::AABBd box;
  for (const fcl::Vector3d& p : other.points) box += p;
  numbers_.assign(first_vertices_.size(), 0);
  is_known_.assign(first_vertices_.size(), 0);
  for (unsigned v = 0; v < labels_.size(); ++v) {
    if (labels_[v] == kNoLabel) continue;
    const fcl::Vector3d& p = surface.points[v];
    if (box.contain(p)) continue;
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

/// Returns the winding number of another body at a point: sums the signs of its crossings with a
/// ray along x, treated as an edge of the point's body that ends beyond the box.
int SurfaceWinding::countAround(const fcl::Vector3d& point, WhichBody body,
                                const ClosedSurface& other, const fcl::AABBd& box) {
  const double size = std::max(box.min_.cwiseAbs().maxCoeff(), box.max_.cwiseAbs().maxCoeff());
  fcl::Vector3d far = point;
  far[0] = box.max_[0] + std::max(size, 1.);
  candidates_.clear();
  other.rays->find(point, fcl::Vector3d::UnitX(), candidates_);
  int number = 0;
  for (const unsigned t : candidates_)
    number += passageThrough(other.triangle(t), point, far, body);
  return number;
}

}  // namespace adaptive_bvh
