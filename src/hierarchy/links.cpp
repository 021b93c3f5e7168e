#include "hierarchy/links.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace adaptive_bvh {

Scratch<Link> combined(unsigned groups, const Scratch<Link>& links) {
  Buckets<Link> by_first(groups, links, [](const Link& link) { return link.first; });
  Scratch<Link> result;
  result.reserve(links.size());
  // By second group: the index in `result` of the last link to it, or 0. This link has the present
  // first group if the index is at least `begin`.
  Scratch<std::size_t> last_link(groups);
  for (unsigned g = 0; g < groups; ++g) {
    const std::size_t begin = result.size();
    for (const Link* i = by_first.begin(g); i != by_first.end(g); ++i) {
      const Link& link = *i;
      if (link.second == g) continue;
      std::size_t& index = last_link[link.second];
      if (index >= begin && index < result.size() && result[index].second == link.second) {
        result[index].weight += link.weight;
      } else {
        index = result.size();
        result.push_back(link);
      }
    }
  }
  return result;
}

GroupGraph::GroupGraph(unsigned groups, const Scratch<Link>& links)
    : start_(groups + 1, 0), neighbours_(2 * links.size() + 1) {
  for (const Link& link : links) {
    ++start_[link.first];
    ++start_[link.second];
  }
  unsigned sum = 0;
  for (unsigned& start : start_) start = sum += start;  // end of the group's neighbours
  for (const Link& link : links) {
    neighbours_[--start_[link.first]] = {link.second, link.weight};
    neighbours_[--start_[link.second]] = {link.first, link.weight};
  }
  for (unsigned g = 0; g < groups; ++g)
    std::sort(neighbours_.begin() + start_[g], neighbours_.begin() + start_[g + 1],
              [](const Neighbour& a, const Neighbour& b) {
                return a.weight != b.weight ? a.weight > b.weight : a.group < b.group;
              });
}

namespace {

/// An edge of a triangle; from < to.
struct Side {
  unsigned from, to, triangle;
};

/// Rounds to 16 significant bits. On regular meshes, edges have equal lengths up to rounding.
/// Otherwise rounding errors would decide which neighbour is better, and break rows of squares into
/// a patchwork. Sums of rounded lengths are exact, so links of groups of equal shape tie.
double rounded(double length) {
  int exponent;
  const double mantissa = std::frexp(length, &exponent);
  return std::ldexp(std::round(std::ldexp(mantissa, 16)), exponent - 16);
}

/// Collects links between triangles that share an edge.
class EdgeLinks {
 public:
  /// `vertices` bounds the vertex indices, `sides` the number of sides.
  EdgeLinks(const MeshView<double>& mesh, unsigned vertices, std::size_t sides)
      : mesh_(mesh), vertices_(vertices) {
    links_.reserve(sides / 2);
  }

  /// Links triangles with equal sides. Returns the sides without an equal one.
  Scratch<Side> link(const Scratch<Side>& sides) {
    Buckets<Side> by_from(vertices_, sides, [](const Side& side) { return side.from; });
    Scratch<Side> alone;
    alone.reserve(sides.size());
    for (unsigned v = 0; v < vertices_; ++v) {
      Side *begin = by_from.begin(v), *const end = by_from.end(v);
      sortBucket(begin, end);
      for (Side* next; begin != end; begin = next) {
        for (next = begin + 1; next != end && next->to == begin->to;) ++next;
        if (next == begin + 1)
          alone.push_back(*begin);
        else
          linkAll(begin, static_cast<std::size_t>(next - begin));
      }
    }
    return alone;
  }

  Scratch<Link> take() { return std::move(links_); }

 private:
  /// Sorts sides from one vertex, so that equal sides are adjacent.
  static void sortBucket(Side* begin, Side* end) {
    if (end - begin < 2) return;
    std::sort(begin, end, [](const Side& a, const Side& b) {
      return a.to != b.to ? a.to < b.to : a.triangle < b.triangle;
    });
  }

  /// Links the triangles of equal sides; each only with the next 16 if there are more than 32.
  void linkAll(const Side* sides, std::size_t count) {
    const double length =
        rounded((mesh_.vertices[sides[0].from] - mesh_.vertices[sides[0].to]).norm());
    const std::size_t window = count <= 32 ? count : 16;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i + 1; j < std::min(count, i + 1 + window); ++j)
        if (sides[i].triangle != sides[j].triangle)  // a degenerate triangle may have a side twice
          links_.push_back({sides[i].triangle, sides[j].triangle, length});
  }

  const MeshView<double>& mesh_;
  unsigned vertices_;
  Scratch<Link> links_;
};

/// The side of a triangle between two vertices.
Side side(unsigned a, unsigned b, unsigned triangle) {
  return {std::min(a, b), std::max(a, b), triangle};
}

/// Represents vertices at the same position by one of them, by an open-addressing hash table.
class Representatives {
 public:
  Representatives(const MeshView<double>& mesh, unsigned vertices)
      : mesh_(mesh), representatives_(vertices, kEmpty) {
    std::size_t slots = 16;
    while (slots < 2 * std::size_t(vertices)) slots *= 2;
    slots_.assign(slots, kEmpty);
  }

  /// The representative of a vertex: the first one at its position that was passed.
  unsigned of(unsigned vertex) {
    unsigned& representative = representatives_[vertex];
    if (representative == kEmpty) representative = find(vertex);
    return representative;
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

  static std::size_t hash(const fcl::Vector3d& p) {
    std::uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
      const double x = p[k] + 0.;  // -0, which equals 0, becomes 0
      std::uint64_t bits = 0;
      std::memcpy(&bits, &x, sizeof(x));
      h = (h ^ bits) * 0x9E3779B97F4A7C15u;
      h ^= h >> 32;
    }
    return static_cast<std::size_t>(h);
  }

  const MeshView<double>& mesh_;
  Scratch<unsigned> representatives_;  // by vertex, or kEmpty
  Scratch<unsigned> slots_;            // the hash table: vertices, or kEmpty
};

/// Replaces the ends of sides by the representatives of their positions, and drops sides of zero
/// length. Returns whether an end was replaced.
bool mergeEqualPositions(const MeshView<double>& mesh, unsigned vertices, Scratch<Side>& sides) {
  Representatives representative(mesh, vertices);
  std::size_t kept = 0;
  bool has_replaced = false;
  for (const Side& s : sides) {
    const Side merged = side(representative.of(s.from), representative.of(s.to), s.triangle);
    has_replaced |= merged.from != s.from || merged.to != s.to;
    if (merged.from != merged.to) sides[kept++] = merged;
  }
  sides.resize(kept);
  return has_replaced;
}

}  // namespace

Scratch<Link> sharedEdges(const MeshView<double>& mesh, unsigned count) {
  Scratch<Side> sides;
  sides.reserve(3 * static_cast<std::size_t>(count));
  unsigned vertices = 0;  // exceeds all vertex indices
  for (unsigned t = 0; t < count; ++t) {
    const VertexIndices corners = mesh.verticesOf(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const unsigned a = corners[k], b = corners[(k + 1) % 3];
      vertices = std::max(vertices, a + 1);
      if (a != b) sides.push_back(side(a, b, t));
    }
  }
  EdgeLinks links(mesh, vertices, sides.size());
  Scratch<Side> border = links.link(sides);
  if (mergeEqualPositions(mesh, vertices, border)) links.link(border);
  return combined(count, links.take());
}

namespace {

/// Inserts two zeros after each of the low 21 bits of x.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

}  // namespace

Scratch<unsigned> mortonOrder(const Scratch<AlignedBox>& boxes) {
  AlignedBox all;
  for (const AlignedBox& box : boxes) all.extend(box.center());
  const double extent = boxes.empty() ? 0 : all.sizes().maxCoeff();
  const double scale = extent > 1e-290 ? 0x1fffff / extent : 0;

  Scratch<std::pair<std::uint64_t, unsigned>> keyed;
  keyed.reserve(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Eigen::Vector3d cell = (boxes[i].center() - all.min()) * scale;
    std::uint64_t code = 0;
    for (int k = 0; k < 3; ++k) code |= spread(static_cast<std::uint64_t>(cell[k])) << k;
    keyed.emplace_back(code, static_cast<unsigned>(i));
  }
  std::sort(keyed.begin(), keyed.end());
  Scratch<unsigned> order;
  order.reserve(keyed.size());
  for (const auto& entry : keyed) order.push_back(entry.second);
  return order;
}

Scratch<Link> proximityLinks(const Scratch<AlignedBox>& boxes_in_order) {
  constexpr std::size_t kWindow = 4;
  Scratch<Link> links;
  links.reserve(kWindow * boxes_in_order.size());
  for (std::size_t i = 0; i < boxes_in_order.size(); ++i)
    for (std::size_t j = i + 1; j < std::min(boxes_in_order.size(), i + 1 + kWindow); ++j) {
      const AlignedBox around = boxes_in_order[i].merged(boxes_in_order[j]);
      links.push_back(
          {static_cast<unsigned>(i), static_cast<unsigned>(j), -around.diagonal().squaredNorm()});
    }
  return links;
}

}  // namespace adaptive_bvh
