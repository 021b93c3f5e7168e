#include "hierarchy/edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace adaptive_bvh {
namespace {

/// A side of a triangle; from < to.
struct Side {
  unsigned from, to, triangle;
};

/// To 16 binary digits. On regular meshes edges are equally long but for rounding, which would
/// else decide who is whose better neighbour, and break rows of squares into a patchwork. Sums of
/// rounded lengths are exact, so groups tie where their shapes do.
double rounded(double length) {
  int exponent;
  const double mantissa = std::frexp(length, &exponent);
  return std::ldexp(std::round(std::ldexp(mantissa, 16)), exponent - 16);
}

template <typename S>
class EdgeLinks {
 public:
  EdgeLinks(const MeshView<S>& mesh, unsigned vertices) : mesh_(mesh), vertices_(vertices) {}

  /// Links the triangles of equal sides. Returns the sides that have no equal.
  std::vector<Side> link(const std::vector<Side>& sides) {
    const Buckets by_from(vertices_, sides.size(), [&](std::size_t i) { return sides[i].from; });
    std::vector<Side> alone, bucket;
    for (unsigned v = 0; v < vertices_; ++v) {
      bucket.clear();
      for (unsigned i = by_from.start[v]; i < by_from.start[v + 1]; ++i)
        bucket.push_back(sides[by_from.items[i]]);
      std::sort(bucket.begin(), bucket.end(), [](const Side& a, const Side& b) {
        return a.to != b.to ? a.to < b.to : a.triangle < b.triangle;
      });
      for (std::size_t i = 0, end; i < bucket.size(); i = end) {
        for (end = i + 1; end < bucket.size() && bucket[end].to == bucket[i].to;) ++end;
        if (end == i + 1)
          alone.push_back(bucket[i]);
        else
          linkAll(&bucket[i], end - i);
      }
    }
    return alone;
  }

  std::vector<Link> take() { return std::move(links_); }

 private:
  void linkAll(const Side* sides, std::size_t count) {
    const double length = rounded(
        static_cast<double>((mesh_.vertices[sides[0].from] - mesh_.vertices[sides[0].to]).norm()));
    const std::size_t reach = count <= 32 ? count : 16;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i + 1; j < std::min(count, i + 1 + reach); ++j)
        if (sides[i].triangle != sides[j].triangle)  // a triangle may fold back on its own side
          links_.push_back({sides[i].triangle, sides[j].triangle, length});
  }

  const MeshView<S>& mesh_;
  unsigned vertices_;
  std::vector<Link> links_;
};

Side side(unsigned a, unsigned b, unsigned triangle) {
  return {std::min(a, b), std::max(a, b), triangle};
}

/// One name for all vertices at one position: that of the first who asked. An open hash table.
template <typename S>
class PositionNames {
 public:
  PositionNames(const MeshView<S>& mesh, unsigned vertices)
      : mesh_(mesh), names_(vertices, kEmpty) {
    std::size_t slots = 16;
    while (slots < 2 * std::size_t(vertices)) slots *= 2;
    slots_.assign(slots, kEmpty);
  }

  unsigned of(unsigned vertex) {
    unsigned& name = names_[vertex];
    if (name == kEmpty) name = find(vertex);
    return name;
  }

 private:
  static constexpr unsigned kEmpty = ~0u;

  unsigned find(unsigned vertex) {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t i = hash(mesh_.vertices[vertex]) & mask;; i = (i + 1) & mask) {
      if (slots_[i] == kEmpty) slots_[i] = vertex;
      if (mesh_.vertices[slots_[i]] == mesh_.vertices[vertex]) return slots_[i];
    }
  }

  static std::size_t hash(const fcl::Vector3<S>& p) {
    std::uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
      h = (h ^ std::hash<S>()(p[k])) * 0x9E3779B97F4A7C15u;
      h ^= h >> 32;
    }
    return static_cast<std::size_t>(h);
  }

  const MeshView<S>& mesh_;
  std::vector<unsigned> names_;  // by vertex
  std::vector<unsigned> slots_;
};

/// Renames the ends of sides by their positions and drops sides that have become points.
template <typename S>
void mergeEqualPositions(const MeshView<S>& mesh, unsigned vertices, std::vector<Side>& sides) {
  PositionNames<S> name(mesh, vertices);
  std::size_t kept = 0;
  for (const Side& s : sides) {
    const Side renamed = side(name.of(s.from), name.of(s.to), s.triangle);
    if (renamed.from != renamed.to) sides[kept++] = renamed;
  }
  sides.resize(kept);
}

}  // namespace

template <typename S>
std::vector<Link> sharedEdges(const MeshView<S>& mesh, unsigned count) {
  std::vector<Side> sides;
  sides.reserve(3 * static_cast<std::size_t>(count));
  unsigned vertices = 0;
  for (unsigned t = 0; t < count; ++t)
    for (int k = 0; k < 3; ++k) {
      const unsigned a = mesh.vertex(t, k), b = mesh.vertex(t, (k + 1) % 3);
      vertices = std::max(vertices, a + 1);
      if (a != b) sides.push_back(side(a, b, t));
    }
  EdgeLinks<S> links(mesh, vertices);
  std::vector<Side> border = links.link(sides);
  mergeEqualPositions(mesh, vertices, border);
  links.link(border);
  return combined(count, links.take());
}

template std::vector<Link> sharedEdges(const MeshView<float>&, unsigned);
template std::vector<Link> sharedEdges(const MeshView<double>&, unsigned);

}  // namespace adaptive_bvh
