#include "mesh/feature_owners.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

/// An edge of one triangle, stored at its vertex with the smaller index.
struct HalfEdge {
  unsigned other;   ///< the other vertex, with the larger index
  unsigned number;  ///< 3 t + k for the edge of triangle t from corner k to the next

  friend bool operator<(const HalfEdge& a, const HalfEdge& b) {
    return a.other != b.other ? a.other < b.other : a.number < b.number;
  }
};

/// Calls visit(smaller, larger, number) for each edge of each triangle.
template <typename Visit>
void forEachHalfEdge(const MeshView<double>& mesh, unsigned triangles, Visit&& visit) {
  for (unsigned t = 0; t < triangles; ++t) {
    const VertexIndices v = mesh.verticesOf(t);
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned a = v[k], b = v[(k + 1) % 3];
      if (a != b) visit(std::min(a, b), std::max(a, b), 3 * t + k);
    }
  }
}

/// Sets the bits of owned edges, by triangle, and finds the boundary edges. Groups the half-edges
/// by their smaller vertex, and sorts each group by the larger one.
void ownEdges(const MeshView<double>& mesh, unsigned triangles, std::size_t vertices,
              Scratch<std::uint8_t>& bits, std::vector<BoundaryEdge>& boundary) {
  // The first half-edge of each vertex's group, in the end. Counted at a + 2 and filled at a + 1.
  Scratch<unsigned> begin(vertices + 2, 0);
  forEachHalfEdge(mesh, triangles, [&](unsigned a, unsigned, unsigned) { ++begin[a + 2]; });
  for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
  Scratch<HalfEdge> edges(begin.back());
  forEachHalfEdge(mesh, triangles, [&](unsigned a, unsigned b, unsigned number) {
    edges[begin[a + 1]++] = {b, number};
  });
  // 1 if the half-edge begins at v, its smaller vertex, else -1.
  const auto direction = [&](unsigned v, unsigned number) {
    return mesh.verticesOf(number / 3)[number % 3] == v ? 1 : -1;
  };
  for (unsigned v = 0; v < vertices; ++v) {
    std::sort(edges.begin() + begin[v], edges.begin() + begin[v + 1]);
    for (unsigned i = begin[v]; i < begin[v + 1];) {
      const unsigned other = edges[i].other;
      bits[edges[i].number / 3] |= static_cast<std::uint8_t>(8 << edges[i].number % 3);
      int sum = 0;  // of the directions of all half-edges between v and `other`
      for (; i < begin[v + 1] && edges[i].other == other; ++i) sum += direction(v, edges[i].number);
      if (sum > 0) boundary.push_back({v, other, sum});
      if (sum < 0) boundary.push_back({other, v, -sum});
    }
  }
}

/// Sets the bits of owned vertices, by triangle.
void ownVertices(const MeshView<double>& mesh, unsigned triangles, std::size_t vertices,
                 Scratch<std::uint8_t>& bits) {
  Scratch<std::uint8_t> has_owner(vertices, 0);
  for (unsigned t = 0; t < triangles; ++t) {
    const VertexIndices v = mesh.verticesOf(t);
    for (unsigned k = 0; k < 3; ++k) {
      if (!has_owner[v[k]]) bits[t] |= static_cast<std::uint8_t>(1 << k);
      has_owner[v[k]] = 1;
    }
  }
}

}  // namespace

void FeatureOwners::assign(const MeshView<double>& mesh, std::size_t num_vertices,
                           const Scratch<unsigned>& primitives,
                           std::vector<BoundaryEdge>& boundary) {
  const auto triangles = static_cast<unsigned>(primitives.size());
  Scratch<std::uint8_t> bits(triangles, 0);
  ownVertices(mesh, triangles, num_vertices, bits);
  boundary.clear();
  ownEdges(mesh, triangles, num_vertices, bits, boundary);
  is_closed_ = boundary.empty();
  owners_.resize(triangles);
  for (std::size_t i = 0; i < triangles; ++i) owners_[i] = {primitives[i], bits[primitives[i]]};
}

}  // namespace adaptive_bvh
