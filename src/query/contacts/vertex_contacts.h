#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "adaptive_bvh/penetration.h"
#include "base/leased.h"
#include "boxes/wide_search.h"
#include "query/placed_mesh.h"
#include "query/points/point_search.h"

namespace adaptive_bvh {

/// A vertex that may be a contact.
struct VertexCandidate {
  unsigned vertex;
  bool is_inside;  ///< known to be inside, and farther than the margin from the surface
};

/// The contact of a vertex, in the other body's frame.
struct VertexContact {
  double distance;  ///< signed
  fcl::Vector3d nearest, normal, barycentric;
  int triangle;  ///< -1 for a shape
};

/// Holds candidates, tests them, and writes the contacts in the order of their vertices.
class ContactWriter {
 public:
  ContactWriter(const PlacedMesh& mesh, const fcl::Transform3d& tf2) : mesh_(mesh), other_tf_(tf2) {
    memory_->candidates.clear();
  }

  /// The candidates, to be filled.
  std::vector<VertexCandidate>& candidates() { return memory_->candidates; }
  /// Adds every vertex that a triangle uses.
  void addAll() {
    const WideTree& tree = mesh_.tree();
    for (unsigned leaf_index = 0; leaf_index < unsigned(mesh_.mesh.numTriangles()); ++leaf_index)
      for (unsigned k = 0; k < 3; ++k)
        if (mesh_.mesh.topology->owners[leaf_index].ownsVertex(k))
          candidates().push_back({static_cast<unsigned>(tree.corners(leaf_index)[int(k)]), false});
  }

  /// Overwrites the result with the contacts. makeTest() returns a thread's own function
  /// test(candidate, contact), which sets the contact and returns whether there is one.
  template <typename MakeTest>
  void write(int threads, const MakeTest& makeTest, VertexContacts& result) const {
    std::vector<VertexCandidate>& candidates = memory_->candidates;
    std::vector<VertexContact>& contacts = memory_->contacts;
    std::vector<std::uint8_t>& is_contact = memory_->is_contact;
    std::vector<std::uint64_t>& order = memory_->order;
    const std::size_t count = candidates.size();
    contacts.resize(count);
    is_contact.resize(count);
    forEachBatch(threads, count, [&](std::size_t begin, std::size_t end) {
      auto test = makeTest();
      for (std::size_t i = begin; i < end; ++i) is_contact[i] = test(candidates[i], contacts[i]);
    });
    order.clear();
    for (std::size_t i = 0; i < count; ++i)
      if (is_contact[i]) order.push_back(std::uint64_t(candidates[i].vertex) << 32 | i);
    std::sort(order.begin(), order.end());
    resize(result, order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto candidate = static_cast<std::uint32_t>(order[i]);
      set(result, i, candidates[candidate].vertex, contacts[candidate]);
    }
  }

 private:
  struct Memory {
    std::vector<VertexCandidate> candidates;
    std::vector<VertexContact> contacts;
    std::vector<std::uint8_t> is_contact;  ///< by candidate, like `contacts`
    std::vector<std::uint64_t> order;      ///< vertex (high bits) and number of the candidate
  };

  static void resize(VertexContacts& result, std::size_t count) {
    result.vertices.resize(count);
    result.distances.resize(count);
    result.positions.resize(count);
    result.nearest_points.resize(count);
    result.normals.resize(count);
    result.triangles.resize(count);
    result.barycentric.resize(count);
    result.areas.resize(count);
  }
  /// Writes contact i in world coordinates.
  void set(VertexContacts& result, std::size_t i, unsigned vertex,
           const VertexContact& contact) const {
    const auto rotation = other_tf_.linear();
    result.vertices[i] = vertex;
    result.distances[i] = contact.distance;
    result.positions[i] = mesh_.tf * mesh_.mesh.vertices[vertex];
    result.nearest_points[i] = (rotation * contact.nearest + other_tf_.translation());
    result.normals[i] = (rotation * contact.normal).normalized();
    result.triangles[i] = contact.triangle;
    result.barycentric[i] = contact.barycentric;
    result.areas[i] = areaOf(vertex);
  }
  /// A third of the area of the vertex's triangles.
  double areaOf(unsigned vertex) const {
    double sum = 0;
    for (const unsigned t : mesh_.mesh.topology->vertex_triangles[vertex]) {
      const TrianglePoints p = mesh_.pointsOf(t);
      sum += (p[1] - p[0]).cross(p[2] - p[0]).stableNorm();
    }
    return sum / 6;
  }

  const PlacedMesh& mesh_;
  const fcl::Transform3d& other_tf_;
  const Leased<Memory> memory_;
};

/// Overwrites the result with the vertices of a mesh that are at most `margin` from the surface of
/// another one, which is closed, or inside it.
void findVertexContacts(const PlacedMesh& mesh, const PlacedMesh& other, double margin,
                        VertexContacts& result);

/// Finds the vertices of one mesh that may be near another's surface or inside it. Descends the
/// tree of the first; each node has a list of the other tree's nodes whose boxes overlap it, and
/// both trees are descended by one level at a time. A box with an empty list does not meet the
/// other's surface. So all vertices in that box are on one side, and a test of one of them decides
/// for all. Each vertex is added once, with the triangle that owns it.
template <typename IsInside>
class VertexSearch {
 public:
  /// `tree`: of `mesh`, perhaps in other coordinates. `frame`: maps boxes of `other` to these
  /// coordinates, enlarged by the margin. `is_inside(v)`: whether vertex v is inside.
  VertexSearch(const MeshState& mesh, const WideTree& tree, const WideTree& other,
               const BoxFrame& frame, IsInside is_inside, std::vector<VertexCandidate>& candidates)
      : mesh_(mesh),
        tree_(tree),
        other_(other),
        frame_(frame),
        is_inside_(is_inside),
        candidates_(candidates) {}

  /// Adds the candidates.
  void run() {
    lists_.clear();
    lists_.push_back({0, 0});
    visit(tree_.nodes()[0], 0);
    lists_.clear();
  }

 private:
  /// A node of the other tree. `overlaps`: bit 4 j + i for its box j and box i of the visited node.
  struct OtherNode {
    int node;
    unsigned overlaps;
  };

  /// Visits a node of the first tree whose list begins at `first` and ends at the end of lists_.
  void visit(const WideNode& node, std::size_t first) {
    unsigned any = 0;
    const std::size_t last = lists_.size();
    for (std::size_t i = first; i < last; ++i) {
      lists_[i].overlaps = overlaps(node.boxes, frame_(other_.nodes()[lists_[i].node].boxes));
      any |= lists_[i].overlaps;
    }
    any |= any >> 8;
    any |= any >> 4;  // bit i: whether box i overlaps any
    if (node.isLeaf()) return addLeaf(node);
    for (unsigned i = 0; i < node.count; ++i) {
      const int below = node.below[i];
      if (!(any >> i & 1)) {
        addClear(below);
        continue;
      }
      for (std::size_t k = first; k < last; ++k) listBelow(lists_[k], i);
      visit(tree_.nodes()[below], last);
      lists_.resize(last);
    }
  }
  /// Appends the children of `other` that overlap box i; for a leaf, the leaf itself.
  void listBelow(const OtherNode other, unsigned i) {
    const WideNode& node = other_.nodes()[other.node];
    const unsigned lanes = other.overlaps >> i & 0x1111;
    if (node.isLeaf() && lanes) lists_.push_back({other.node, 0});
    for (unsigned j = 0; !node.isLeaf() && j < node.count; ++j)
      if (lanes >> 4 * j & 1) lists_.push_back({node.below[j], 0});
  }

  /// Adds the vertices of a leaf near the surface.
  void addLeaf(const WideNode& leaf) {
    const auto first = static_cast<std::size_t>(leaf.first);
    addOwned(first, first + leaf.count, false);
  }
  /// Adds the vertices below a node whose box does not meet the surface, if they are inside.
  void addClear(int node) {
    const std::size_t first = firstLeafIndex(node), last = lastLeafIndex(node) + 1;
    const bool is_inside =
        is_inside_(static_cast<unsigned>(tree_.corners(static_cast<unsigned>(first))[0]));
    if (is_inside) addOwned(first, last, true);
  }
  /// Adds the vertices that the triangles with leaf indices in [first, last) own.
  void addOwned(std::size_t first, std::size_t last, bool is_inside) {
    for (std::size_t leaf_index = first; leaf_index < last; ++leaf_index)
      for (unsigned k = 0; k < 3; ++k)
        if (mesh_.topology->owners[leaf_index].ownsVertex(k))
          candidates_.push_back(
              {static_cast<unsigned>(tree_.corners(static_cast<unsigned>(leaf_index))[int(k)]),
               is_inside});
  }

  /// The triangles below a node are consecutive in the order of the leaves.
  std::size_t firstLeafIndex(int node) const {
    const WideNode* at = &tree_.nodes()[node];
    while (!at->isLeaf()) at = &tree_.nodes()[at->below[0]];
    return static_cast<std::size_t>(at->first);
  }
  std::size_t lastLeafIndex(int node) const {
    const WideNode* at = &tree_.nodes()[node];
    while (!at->isLeaf()) at = &tree_.nodes()[at->below[at->count - 1]];
    return static_cast<std::size_t>(at->first) + at->count - 1;
  }

  const MeshState& mesh_;
  const WideTree &tree_, &other_;
  const BoxFrame& frame_;
  IsInside is_inside_;
  std::vector<VertexCandidate>& candidates_;
  const Leased<std::vector<OtherNode>> leased_;
  std::vector<OtherNode>& lists_ = *leased_;  ///< of the visited node and its ancestors, in a stack
};

}  // namespace adaptive_bvh
