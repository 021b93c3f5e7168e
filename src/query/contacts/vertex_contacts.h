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
  bool is_inside;  ///< whether it is known to be inside and far from the surface
};

/// The contact of a vertex, in the other body's frame.
struct VertexContact {
  double distance;  ///< signed
  fcl::Vector3d nearest, normal, barycentric;
  int triangle;  ///< -1 for a shape
};

/// Tests candidates and writes the contacts into a result by increasing vertex.
class ContactWriter {
 public:
  ContactWriter(const PlacedMesh& mesh, const fcl::Transform3d& other_tf)
      : mesh_(mesh), other_tf_(other_tf) {
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

  /// Writes the contacts and returns their number. makeTest() returns a function test(candidate,
  /// contact), which returns whether the candidate is a contact; each thread has its own.
  template <typename MakeTest>
  void write(int threads, const MakeTest& makeTest, VertexContacts<double>& result) const {
    Memory& m = *memory_;
    const std::size_t count = m.candidates.size();
    m.contacts.resize(count);
    m.is_contact.resize(count);
    forEachBatch(threads, count, [&](std::size_t begin, std::size_t end) {
      auto test = makeTest();
      for (std::size_t i = begin; i < end; ++i)
        m.is_contact[i] = test(m.candidates[i], m.contacts[i]);
    });
    m.order.clear();
    for (std::size_t i = 0; i < count; ++i)
      if (m.is_contact[i]) m.order.push_back(std::uint64_t(m.candidates[i].vertex) << 32 | i);
    std::sort(m.order.begin(), m.order.end());
    resize(result, m.order.size());
    for (std::size_t i = 0; i < m.order.size(); ++i) {
      const auto from = static_cast<std::uint32_t>(m.order[i]);
      set(result, i, m.candidates[from].vertex, m.contacts[from]);
    }
  }

 private:
  struct Memory {
    std::vector<VertexCandidate> candidates;
    std::vector<VertexContact> contacts;
    std::vector<std::uint8_t> is_contact;
    std::vector<std::uint64_t> order;  ///< vertex (high bits) and number of the candidate
  };

  static void resize(VertexContacts<double>& result, std::size_t count) {
    result.vertices.resize(count);
    result.distances.resize(count);
    result.positions.resize(count);
    result.nearest_points.resize(count);
    result.normals.resize(count);
    result.triangles.resize(count);
    result.barycentric.resize(count);
    result.areas.resize(count);
  }
  void set(VertexContacts<double>& result, std::size_t i, unsigned vertex,
           const VertexContact& contact) const {
    const auto turn = other_tf_.linear();
    result.vertices[i] = vertex;
    result.distances[i] = contact.distance;
    result.positions[i] = mesh_.tf * mesh_.mesh.vertices[vertex];
    result.nearest_points[i] = (turn * contact.nearest + other_tf_.translation());
    result.normals[i] = (turn * contact.normal).normalized();
    result.triangles[i] = contact.triangle;
    result.barycentric[i] = contact.barycentric;
    result.areas[i] = areaOf(vertex);
  }
  double areaOf(unsigned vertex) const {
    double sum = 0;
    for (const unsigned t : mesh_.mesh.topology->vertex_triangles[vertex]) {
      const TrianglePoints<double> p = mesh_.pointsOf(t);
      sum += (p[1] - p[0]).cross(p[2] - p[0]).stableNorm();
    }
    return sum / 6;
  }

  const PlacedMesh& mesh_;
  const fcl::Transform3d& other_tf_;
  const Leased<Memory> memory_;
};

/// Overwrites the result with the vertices of a mesh that are at most `margin` from another one,
/// which is closed, or inside of it.
void findVertexContacts(const PlacedMesh& mesh, const PlacedMesh& other, double margin,
                        VertexContacts<double>& result);

/// Finds the vertices of one mesh that may be near another's surface or inside it. Descends the
/// tree of the first with a list of the other tree's nodes whose boxes overlap, one level of both
/// trees at a time. A box with an empty list is clear of the other's surface. So all vertices in
/// that box are on one side, and a test of one of them decides for all. Each vertex is visited
/// once, with the triangle that owns it.
template <typename IsInside>
class VertexSearch {
 public:
  /// `tree`: of `mesh`, perhaps in other coordinates. `frame`: maps boxes of `other` to these
  /// coordinates and enlarges them by the margin. `is_inside(v)`: whether vertex v of `mesh` is
  /// inside.
  VertexSearch(const MeshState& mesh, const WideTree& tree, const WideTree& other,
               const BoxFrame& frame, IsInside is_inside, std::vector<VertexCandidate>& candidates)
      : mesh_(mesh),
        tree_(tree),
        other_(other),
        frame_(frame),
        is_inside_(is_inside),
        candidates_(candidates) {}

  void run() {
    open_.clear();
    open_.push_back({0, 0});
    visit(tree_.nodes()[0], 0);
    open_.clear();
  }

 private:
  /// A node of the other tree, and which of its boxes overlap boxes of the visited node.
  struct Other {
    int node;
    unsigned overlaps;
  };

  /// `first`: where the list of the node begins in `open_`.
  void visit(const WideNode& node, std::size_t first) {
    unsigned any = 0;
    const std::size_t last = open_.size();
    for (std::size_t i = first; i < last; ++i) {
      open_[i].overlaps = overlaps(node.boxes, frame_(other_.nodes()[open_[i].node].boxes));
      any |= open_[i].overlaps;
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
      for (std::size_t k = first; k < last; ++k) openBelow(open_[k], i);
      visit(tree_.nodes()[below], last);
      open_.resize(last);
    }
  }
  /// Adds the children of `other` that overlap box i; a leaf adds itself.
  void openBelow(const Other other, unsigned i) {
    const WideNode& node = other_.nodes()[other.node];
    const unsigned lanes = other.overlaps >> i & 0x1111;
    if (node.isLeaf() && lanes) open_.push_back({other.node, 0});
    for (unsigned j = 0; !node.isLeaf() && j < node.count; ++j)
      if (lanes >> 4 * j & 1) open_.push_back({node.below[j], 0});
  }

  void addLeaf(const WideNode& leaf) {
    const auto first = static_cast<std::size_t>(leaf.first);
    addOwned(first, first + leaf.count, false);
  }
  void addClear(int node) {
    const std::size_t first = firstLeafIndex(node), last = lastLeafIndex(node) + 1;
    const bool is_inside =
        is_inside_(static_cast<unsigned>(tree_.corners(static_cast<unsigned>(first))[0]));
    if (is_inside) addOwned(first, last, true);
  }
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
  const Leased<std::vector<Other>> leased_;
  std::vector<Other>& open_ = *leased_;  ///< the lists, one after the other
};

}  // namespace adaptive_bvh
