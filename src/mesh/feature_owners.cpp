#include "mesh/feature_owners.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

/// An edge of one triangle, kept with the smaller of its vertices.
struct HalfEdge {
  unsigned other;   ///< the larger vertex
  unsigned number;  ///< 3 t + k

  friend bool operator<(const HalfEdge& a, const HalfEdge& b) {
    return a.other != b.other ? a.other < b.other : a.number < b.number;
  }
};

/// Calls visit(smaller, larger, number) for each edge of each triangle.
template <typename S, typename Visit>
void forEachHalfEdge(const MeshView<S>& mesh, unsigned triangles, Visit&& visit) {
  for (unsigned t = 0; t < triangles; ++t) {
    const VertexIndices v = mesh.verticesOf(t);
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned a = v[k], b = v[(k + 1) % 3];
      if (a != b) visit(std::min(a, b), std::max(a, b), 3 * t + k);
    }
  }
}

/// Returns whether each edge is run through as often in one direction as in the other.
template <typename S>
bool ownEdges(const MeshView<S>& mesh, unsigned triangles, std::size_t vertices,
              Scratch<std::uint8_t>& bits) {
  Scratch<unsigned> begin(vertices + 2, 0);  // of those at a vertex; shifted by one while filled
  forEachHalfEdge(mesh, triangles, [&](unsigned a, unsigned, unsigned) { ++begin[a + 2]; });
  for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
  Scratch<HalfEdge> edges(begin.back());
  forEachHalfEdge(mesh, triangles, [&](unsigned a, unsigned b, unsigned number) {
    edges[begin[a + 1]++] = {b, number};
  });
  const auto direction = [&](unsigned v, unsigned number) {
    return mesh.verticesOf(number / 3)[number % 3] == v ? 1 : -1;
  };
  bool is_closed = true;
  int sum = 0;  // of the directions of one edge
  for (unsigned v = 0; v < vertices; ++v) {
    std::sort(edges.begin() + begin[v], edges.begin() + begin[v + 1]);
    for (unsigned i = begin[v]; i < begin[v + 1]; ++i) {
      if (i == begin[v] || edges[i].other != edges[i - 1].other) {
        bits[edges[i].number / 3] |= static_cast<std::uint8_t>(8 << edges[i].number % 3);
        is_closed = is_closed && sum == 0;
        sum = 0;
      }
      sum += direction(v, edges[i].number);
    }
  }
  return is_closed && sum == 0;
}

template <typename S>
void ownVertices(const MeshView<S>& mesh, unsigned triangles, std::size_t vertices,
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

template <typename S>
void FeatureOwners::adopt(const MeshView<S>& mesh, std::size_t num_vertices,
                          const Scratch<unsigned>& primitives) {
  const auto triangles = static_cast<unsigned>(primitives.size());
  Scratch<std::uint8_t> bits(triangles, 0);
  ownVertices(mesh, triangles, num_vertices, bits);
  is_closed_ = ownEdges(mesh, triangles, num_vertices, bits);
  owners_.resize(triangles);
  for (std::size_t place = 0; place < triangles; ++place)
    owners_[place] = {primitives[place], bits[primitives[place]]};
}

template void FeatureOwners::adopt(const MeshView<float>&, std::size_t, const Scratch<unsigned>&);
template void FeatureOwners::adopt(const MeshView<double>&, std::size_t, const Scratch<unsigned>&);

}  // namespace adaptive_bvh
