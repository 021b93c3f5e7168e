// Neighbours of the triangles of a mesh along its surface.
#include "adaptive_bvh/surface_neighbourhood.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

#include "query/neighbour_ranges.h"

namespace adaptive_bvh {
namespace {

using LeafRange = NeighbourRanges::Range;

/// Appends a range, or extends the last one.
void appendRange(std::vector<LeafRange>& list, const LeafRange& range) {
  if (!list.empty() && list.back().end == range.begin)
    list.back().end = range.end;
  else
    list.push_back(range);
}

/// A set of numbers, one bit for each. Emptying it costs what was added, not the largest number.
class NumberSet {
 public:
  explicit NumberSet(std::size_t count) : words_((count + 63) / 64, 0) {}
  void add(unsigned i) {
    std::uint64_t& word = words_[i / 64];
    if (word == 0) used_.push_back(i / 64);
    word |= std::uint64_t(1) << (i % 64);
  }
  /// Returns the set as ranges, and empties it.
  std::vector<LeafRange> takeRanges() {
    std::vector<LeafRange> list;
    std::sort(used_.begin(), used_.end());
    for (const unsigned w : used_)
      for (std::uint64_t bits = std::exchange(words_[w], 0); bits; bits &= bits - 1) {
        const unsigned i = 64 * w + unsigned(__builtin_ctzll(bits));
        appendRange(list, {i, i + 1});
      }
    used_.clear();
    return list;
  }

 private:
  std::vector<std::uint64_t> words_;
  std::vector<unsigned> used_;  ///< the words with a bit
};

std::vector<LeafRange> commonRanges(const std::vector<LeafRange>& a,
                                    const std::vector<LeafRange>& b) {
  std::vector<LeafRange> list;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const LeafRange both = {std::max(a[i].begin, b[j].begin), std::min(a[i].end, b[j].end)};
    if (both.begin < both.end) list.push_back(both);
    ++(a[i].end < b[j].end ? i : j);
  }
  return list;
}

std::vector<LeafRange> listOf(const NeighbourRanges& ranges, unsigned list) {
  const auto first = ranges.ranges.begin();
  return {first + std::ptrdiff_t(ranges.begins[list]),
          first + std::ptrdiff_t(ranges.begins[list + 1])};
}

/// The list of ranges that all of several lists have in common.
unsigned commonList(NeighbourRanges& ranges, const std::vector<unsigned>& lists) {
  if (std::all_of(lists.begin(), lists.end(), [&](unsigned list) { return list == lists[0]; }))
    return lists[0];
  std::vector<LeafRange> all = listOf(ranges, lists[0]);
  for (std::size_t i = 1; i < lists.size(); ++i) all = commonRanges(all, listOf(ranges, lists[i]));
  return ranges.add(all);
}

/// Sets the ranges and lists of nodes, children first.
void addNodes(const MeshState& mesh, NeighbourRanges& ranges) {
  const WideNode* const nodes = mesh.tree.nodes();
  const auto count = static_cast<std::size_t>(mesh.tree.size());
  ranges.of_node.resize(count);
  ranges.triangles.resize(count);
  std::vector<unsigned> lists;
  for (std::size_t n = count; n-- > 0;) {
    const WideNode& node = nodes[n];
    lists.clear();
    LeafRange all = {std::numeric_limits<unsigned>::max(), 0};
    for (int i = 0; i < int(node.count); ++i) {
      const auto below = static_cast<std::size_t>(node.isLeaf() ? node.first + i : node.below[i]);
      lists.push_back(node.isLeaf() ? ranges.of_triangle[below] : ranges.of_node[below]);
      const LeafRange under =
          node.isLeaf() ? LeafRange{unsigned(below), unsigned(below) + 1} : ranges.triangles[below];
      all = {std::min(all.begin, under.begin), std::max(all.end, under.end)};
    }
    ranges.triangles[n] = all;
    ranges.of_node[n] = commonList(ranges, lists);
  }
}

std::shared_ptr<NeighbourRanges> emptyRanges(const MeshState& mesh) {
  auto ranges = std::make_shared<NeighbourRanges>();
  ranges->topology = mesh.topology;
  ranges->begins.push_back(0);
  const std::vector<Int4>& corners = mesh.topology->leaves.corners;
  ranges->leaf_index.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i)
    ranges->leaf_index[std::size_t(corners[i][3])] = static_cast<unsigned>(i);
  return ranges;
}

/// Finds the vertices within a length of a triangle along the edges (Dijkstra 1959). Memory of one
/// search serves the next.
class SurfaceSearch {
 public:
  /// length(a, b): that of an edge.
  using Length = std::function<double(std::size_t, std::size_t)>;

  SurfaceSearch(const MeshState& mesh, Length length)
      : topology_(*mesh.topology),
        length_(std::move(length)),
        distances_(mesh.vertices.size(), kFar) {}

  /// Adds the leaf indices of the triangles with a vertex within `most`.
  void run(unsigned leaf, double most, const std::vector<unsigned>& leaf_index, NumberSet& found) {
    const Int4& corners = topology_.leaves.corners[leaf];
    for (int k = 0; k < 3; ++k) reach(std::size_t(corners[k]), 0, most);
    while (!open_.empty()) {
      const auto [distance, vertex] = open_.top();
      open_.pop();
      if (distance > distances_[vertex]) continue;
      for (const unsigned t : topology_.vertex_triangles[vertex]) {
        found.add(leaf_index[t]);
        for (int k = 0; k < 3; ++k) {
          const std::size_t to = topology_.triangles[t][k];
          if (to != vertex) reach(to, distance + length_(vertex, to), most);
        }
      }
    }
    for (const std::size_t vertex : touched_) distances_[vertex] = kFar;
    touched_.clear();
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  void reach(std::size_t vertex, double distance, double most) {
    if (!(distance <= most && distance < distances_[vertex])) return;
    distances_[vertex] = distance;
    touched_.push_back(vertex);
    open_.emplace(distance, vertex);
  }

  using Open = std::pair<double, std::size_t>;

  const MeshTopology& topology_;
  const Length length_;
  std::vector<double> distances_;  ///< by vertex
  std::vector<std::size_t> touched_;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open_;
};

std::shared_ptr<const NeighbourRanges> within(const MeshState& mesh, double most,
                                              const SurfaceSearch::Length& length) {
  const auto ranges = emptyRanges(mesh);
  SurfaceSearch search(mesh, length);
  const std::size_t count = mesh.topology->triangles.size();
  NumberSet found(count);
  for (unsigned i = 0; i < count; ++i) {
    search.run(i, most, ranges->leaf_index, found);
    ranges->of_triangle.push_back(ranges->add(found.takeRanges()));
  }
  addNodes(mesh, *ranges);
  return ranges;
}

double oneStep(std::size_t, std::size_t) { return 1; }

/// The ranges between those of a list.
std::vector<LeafRange> others(const std::vector<LeafRange>& list, unsigned count) {
  std::vector<LeafRange> between;
  unsigned from = 0;
  for (const LeafRange& range : list) {
    if (from < range.begin) between.push_back({from, range.begin});
    from = range.end;
  }
  if (from < count) between.push_back({from, count});
  return between;
}

std::shared_ptr<const NeighbourRanges> byLabelsOf(const MeshState& mesh,
                                                  const std::vector<unsigned>& labels,
                                                  LabelRule rule) {
  const std::size_t count = mesh.topology->triangles.size();
  if (labels.size() != count)
    throw std::invalid_argument("adaptive_bvh: " + std::to_string(labels.size()) + " labels for " +
                                std::to_string(count) + " triangles");
  const auto ranges = emptyRanges(mesh);
  const std::vector<Int4>& corners = mesh.topology->leaves.corners;
  std::map<unsigned, std::vector<LeafRange>> lists;
  for (unsigned i = 0; i < count; ++i)
    appendRange(lists[labels[std::size_t(corners[i][3])]], {i, i + 1});
  std::map<unsigned, unsigned> numbers;
  for (const auto& [label, list] : lists)
    numbers[label] = ranges->add(rule == LabelRule::Between ? list : others(list, unsigned(count)));
  for (unsigned i = 0; i < count; ++i)
    ranges->of_triangle.push_back(numbers[labels[std::size_t(corners[i][3])]]);
  addNodes(mesh, *ranges);
  return ranges;
}

}  // namespace

unsigned NeighbourRanges::add(const std::vector<LeafRange>& list) {
  ranges.insert(ranges.end(), list.begin(), list.end());
  begins.push_back(ranges.size());
  return static_cast<unsigned>(begins.size() - 2);
}

bool NeighbourRanges::contains(unsigned list, const LeafRange& range) const {
  const auto first = ranges.begin() + std::ptrdiff_t(begins[list]),
             last = ranges.begin() + std::ptrdiff_t(begins[list + 1]);
  const auto after = std::upper_bound(
      first, last, range.begin, [](unsigned i, const LeafRange& other) { return i < other.begin; });
  return after != first && range.end <= (after - 1)->end;
}

bool NeighbourRanges::shareVertex(unsigned first, unsigned second) const {
  const Int4 &a = topology->leaves.corners[first], &b = topology->leaves.corners[second];
  for (int i = 0; i < 3; ++i)
    if ((a[i] == b[0]) | (a[i] == b[1]) | (a[i] == b[2])) return true;
  return false;
}

std::size_t NeighbourRanges::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(*this) + size(ranges) + size(begins) + size(of_triangle) + size(of_node) +
         size(triangles) + size(leaf_index);
}

std::shared_ptr<const NeighbourRanges> neighboursByVertices(const MeshState& mesh) {
  return within(mesh, 0, oneStep);
}

const NeighbourRanges* surfaceOf(const Ignored& ignored, const MeshState& mesh) {
  if (!ignored.surface) return nullptr;
  if (ignored.surface->ranges().topology != mesh.topology)
    throw std::invalid_argument(
        "adaptive_bvh: a SurfaceNeighbourhood of another mesh; make it of this mesh, or of the "
        "mesh that this is a copy of");
  return &ignored.surface->ranges();
}

SurfaceNeighbourhood::SurfaceNeighbourhood(std::shared_ptr<const NeighbourRanges> ranges)
    : ranges_(std::move(ranges)) {}

SurfaceNeighbourhood::SurfaceNeighbourhood(const DeformableMesh& mesh)
    : SurfaceNeighbourhood(neighboursByVertices(stateOf(mesh))) {}

SurfaceNeighbourhood SurfaceNeighbourhood::byRings(const DeformableMesh& mesh, unsigned rings) {
  return SurfaceNeighbourhood(within(stateOf(mesh), std::max(1., double(rings)) - 1, oneStep));
}

SurfaceNeighbourhood SurfaceNeighbourhood::byDistance(const DeformableMesh& mesh, double distance) {
  if (!(distance >= 0))
    throw std::invalid_argument(
        "adaptive_bvh: a distance along the surface is negative or not a number");
  const MeshState& state = stateOf(mesh);
  return SurfaceNeighbourhood(
      within(state, distance, [&state](std::size_t a, std::size_t b) -> double {
        return (state.vertices[a] - state.vertices[b]).norm();
      }));
}

SurfaceNeighbourhood SurfaceNeighbourhood::byLabels(const DeformableMesh& mesh,
                                                    const std::vector<unsigned>& labels,
                                                    LabelRule rule) {
  return SurfaceNeighbourhood(byLabelsOf(stateOf(mesh), labels, rule));
}

bool SurfaceNeighbourhood::contains(unsigned first, unsigned second) const {
  const std::vector<unsigned>& leaf_index = ranges_->leaf_index;
  if (first >= leaf_index.size() || second >= leaf_index.size())
    throw std::invalid_argument("adaptive_bvh: a triangle that is not there");
  return ranges_->areNeighbours(leaf_index[first], leaf_index[second]);
}

std::size_t SurfaceNeighbourhood::bytes() const { return ranges_->bytes(); }

}  // namespace adaptive_bvh
