#include "mesh/mesh_check.h"

#include <vector>

namespace adaptive_bvh {
namespace {

/// The places below each node: children behind their parent, and leaves side by side.
struct Places {
  std::vector<int> first, count;
};
bool findPlaces(const WideTree& tree, int triangles, Places& places, std::string& reason) {
  const auto size = static_cast<std::size_t>(tree.size());
  places = {std::vector<int>(size, 0), std::vector<int>(size, 0)};
  for (int n = tree.size(); n-- > 0;) {
    const WideNode& node = tree.nodes()[n];
    const auto at = static_cast<std::size_t>(n);
    reason = "node " + std::to_string(n) + " has wrong links";
    if (node.count < 1 || node.count > 4) return false;
    if (node.isLeaf()) {
      places.first[at] = node.first;
      places.count[at] = int(node.count);
      continue;
    }
    for (int i = 0; i < int(node.count); ++i) {
      if (node.below[i] <= n || node.below[i] >= tree.size()) return false;
      const auto below = static_cast<std::size_t>(node.below[i]);
      if (i == 0) places.first[at] = places.first[below];
      if (places.first[below] != places.first[at] + places.count[at]) return false;
      places.count[at] += places.count[below];
    }
  }
  reason = "the leaves do not hold every triangle once";
  if (places.first[0] != 0 || places.count[0] != triangles) return false;
  std::vector<bool> is_taken(static_cast<std::size_t>(triangles), false);
  for (int place = 0; place < triangles; ++place) {
    const int triangle = tree.triangle(static_cast<unsigned>(place));
    if (triangle < 0 || triangle >= triangles || is_taken[std::size_t(triangle)]) return false;
    is_taken[std::size_t(triangle)] = true;
  }
  return true;
}

}  // namespace

template <typename S>
bool checkMesh(const MeshState<S>& state, std::string* reason) {
  using Vector3l = Eigen::Matrix<long double, 3, 1>;
  const WideTree& tree = state.tree;
  Places places;
  std::string what;
  const auto fail = [&] {
    if (reason) *reason = what;
    return false;
  };
  if (!findPlaces(tree, state.numTriangles(), places, what)) return fail();
  const Eigen::Matrix<long double, 3, 3> to_body = tree.toBody().cast<long double>();
  const auto holds = [&](const Boxes4& boxes, int lane, int place) {
    const Int4& corners = tree.corners(static_cast<unsigned>(place));
    for (int c = 0; c < 3; ++c) {
      const Vector3l x = state.vertices[std::size_t(corners[c])].template cast<long double>();
      const Vector3l y = to_body * (x - tree.origin().cast<long double>());
      for (int k = 0; k < 3; ++k)
        if (!(boxes.low[k][lane] <= y[k] && y[k] <= boxes.high[k][lane])) return false;
    }
    return true;
  };
  for (int n = 0; n < tree.size(); ++n) {
    const WideNode& node = tree.nodes()[n];
    for (int i = 0; i < int(node.count); ++i) {
      const auto below = static_cast<std::size_t>(node.isLeaf() ? n : node.below[i]);
      const int first = node.isLeaf() ? node.first + i : places.first[below],
                last = first + (node.isLeaf() ? 1 : places.count[below]);
      for (int place = first; place < last; ++place)
        if (!holds(node.boxes, i, place)) {
          what = "box " + std::to_string(i) + " of node " + std::to_string(n) +
                 " does not contain triangle " +
                 std::to_string(tree.triangle(static_cast<unsigned>(place)));
          return fail();
        }
    }
  }
  return true;
}

template bool checkMesh(const MeshState<float>&, std::string*);
template bool checkMesh(const MeshState<double>&, std::string*);

}  // namespace adaptive_bvh
