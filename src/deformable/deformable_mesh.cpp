#include <stdexcept>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "deformable/mesh_state.h"
#include "deformable/mesh_step.h"
#include "mesh/vertex_summary.h"

// The calls of DeformableMesh except save and load. Builds and updates are in mesh_step.cpp.
namespace adaptive_bvh {

void detail::refusePointMatrix(Eigen::Index rows, Eigen::Index columns) {
  throw std::invalid_argument(
      "adaptive_bvh: points are a " + std::to_string(rows) + " x " + std::to_string(columns) +
      " matrix; " +
      (rows == 3 && columns == 3
           ? "only its type can state whether its rows or its columns are the points: pass an "
             "Eigen::Matrix<S, 3, Eigen::Dynamic> or an Eigen::Matrix<S, Eigen::Dynamic, 3>"
           : "3 x N or N x 3 is needed"));
}

std::size_t detail::commonSize(std::size_t first, std::size_t second) {
  if (first != second)
    throw std::invalid_argument("adaptive_bvh: " + std::to_string(first) + " points and " +
                                std::to_string(second) + " directions");
  return first;
}

namespace {

/// The range of triangles below each node, as indices in the order of the leaves.
struct LeafRanges {
  std::vector<int> first, count;
};
/// Finds the ranges. Returns false, and sets the reason, unless children follow their parent, the
/// leaves are contiguous, and they contain each triangle once.
bool findLeafRanges(const WideTree& tree, int triangles, LeafRanges& ranges, std::string& reason) {
  const auto size = static_cast<std::size_t>(tree.size());
  ranges = {std::vector<int>(size, 0), std::vector<int>(size, 0)};
  for (int n = tree.size(); n-- > 0;) {
    const WideNode& node = tree.nodes()[n];
    int &first = ranges.first[std::size_t(n)], &count = ranges.count[std::size_t(n)];
    reason = "node " + std::to_string(n) + " has wrong links";
    if (node.count < 1 || node.count > 4) return false;
    if (node.isLeaf()) {
      first = node.first;
      count = int(node.count);
      continue;
    }
    for (int i = 0; i < int(node.count); ++i) {
      if (node.below[i] <= n || node.below[i] >= tree.size()) return false;
      const auto below = static_cast<std::size_t>(node.below[i]);
      if (i == 0) first = ranges.first[below];
      if (ranges.first[below] != first + count) return false;
      count += ranges.count[below];
    }
  }
  reason = "the leaves do not hold every triangle once";
  if (ranges.first[0] != 0 || ranges.count[0] != triangles) return false;
  std::vector<bool> is_taken(static_cast<std::size_t>(triangles), false);
  for (int i = 0; i < triangles; ++i) {
    const int triangle = tree.triangle(static_cast<unsigned>(i));
    if (triangle < 0 || triangle >= triangles || is_taken[std::size_t(triangle)]) return false;
    is_taken[std::size_t(triangle)] = true;
  }
  return true;
}

/// Implements DeformableMesh::validate: the tree has the right links, and each box contains all
/// triangles below it, computed in long double.
bool checkMesh(const MeshState& state, std::string* reason) {
  using Vector3l = Eigen::Matrix<long double, 3, 1>;
  const WideTree& tree = state.tree;
  LeafRanges ranges;
  std::string defect;
  const auto fail = [&] {
    if (reason) *reason = defect;
    return false;
  };
  if (!findLeafRanges(tree, state.numTriangles(), ranges, defect)) return fail();
  const Eigen::Matrix<long double, 3, 3> to_body = tree.toBody().cast<long double>();
  const auto contains = [&](const Boxes4& boxes, int lane, int leaf_index) {
    const Int4& corners = tree.corners(static_cast<unsigned>(leaf_index));
    for (int c = 0; c < 3; ++c) {
      const Vector3l x = state.vertices[std::size_t(corners[c])].cast<long double>();
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
      const int first = node.isLeaf() ? node.first + i : ranges.first[below],
                last = first + (node.isLeaf() ? 1 : ranges.count[below]);
      for (int leaf_index = first; leaf_index < last; ++leaf_index)
        if (!contains(node.boxes, i, leaf_index)) {
          defect = "box " + std::to_string(i) + " of node " + std::to_string(n) +
                   " does not contain triangle " +
                   std::to_string(tree.triangle(static_cast<unsigned>(leaf_index)));
          return fail();
        }
    }
  }
  return true;
}

void requireThreads(const char* call, int threads) {
  if (threads < 1)
    throw std::invalid_argument(std::string("DeformableMesh::") + call + ": " +
                                std::to_string(threads) + " threads; at least 1 is needed");
}

void requireCount(std::size_t count, std::size_t vertices) {
  if (count != vertices)
    throw std::invalid_argument("DeformableMesh: " + std::to_string(count) +
                                " positions given for " + std::to_string(vertices) + " vertices");
}

template <typename S>
detail::StridedPoints<S> sideBySide(const fcl::Vector3<S>* points, std::size_t count) {
  static_assert(sizeof(fcl::Vector3<S>) == 3 * sizeof(S), "points lie side by side");
  return {reinterpret_cast<const S*>(points), static_cast<Eigen::Index>(count), 3, 1};
}

// The positions in single precision that a single-precision mesh keeps for the user (HeldMesh).
void setUserPrevious(const HeldMesh<double>&, const std::vector<fcl::Vector3d>&) {}
void setUserPrevious(HeldMesh<float>& mesh, std::vector<fcl::Vector3f> positions) {
  mesh.own_previous = std::move(positions);
}

std::size_t userBytes(const HeldMesh<double>&) { return 0; }
std::size_t userBytes(const HeldMesh<float>& mesh) {
  return (mesh.own_vertices.capacity() + mesh.own_previous.capacity()) * sizeof(fcl::Vector3f);
}

}  // namespace

template <typename S>
DeformableMesh<S>::DeformableMesh(std::unique_ptr<HeldMesh<S>> held) : held_(std::move(held)) {}

template <typename S>
DeformableMesh<S>::DeformableMesh(std::vector<Point> vertices, std::vector<fcl::Triangle> triangles)
    : held_(std::make_unique<HeldMesh<S>>()) {
  build(std::move(vertices), std::move(triangles), *held_, *this);
}

template <typename S>
DeformableMesh<S>::DeformableMesh(TriangleMesh<S> mesh)
    : DeformableMesh(std::move(mesh.vertices), std::move(mesh.triangles)) {}

template <typename S>
DeformableMesh<S>::DeformableMesh(const DeformableMesh& other)
    : fcl::CollisionGeometry<S>(other), held_(std::make_unique<HeldMesh<S>>(*other.held_)) {
  held_->state().is_copy = true;
}

template <typename S>
DeformableMesh<S>& DeformableMesh<S>::operator=(const DeformableMesh& other) {
  if (this == &other) return *this;
  if (held_) {
    held_->reserve(*other.held_);
    *held_ = *other.held_;
  } else {
    held_ = std::make_unique<HeldMesh<S>>(*other.held_);
  }
  held_->state().is_copy = true;
  fcl::CollisionGeometry<S>::operator=(other);
  return *this;
}

template <typename S>
DeformableMesh<S>::DeformableMesh(DeformableMesh&& other) noexcept = default;
template <typename S>
DeformableMesh<S>& DeformableMesh<S>::operator=(DeformableMesh&& other) noexcept = default;
template <typename S>
DeformableMesh<S>::~DeformableMesh() = default;

template <typename S>
auto DeformableMesh<S>::vertices() const -> const std::vector<Point>& {
  return held_->vertices();
}

template <typename S>
auto DeformableMesh<S>::previousVertices() const -> const std::vector<Point>& {
  return held_->previous();
}

template <typename S>
const std::vector<fcl::Triangle>& DeformableMesh<S>::triangles() const {
  return held_->state().topology->triangles;
}

template <typename S>
const MeshUpdate& DeformableMesh<S>::update(const Point* positions, std::size_t count) {
  return updateStrided(sideBySide(positions, count), false);
}

template <typename S>
const MeshUpdate& DeformableMesh<S>::updateStrided(const detail::StridedPoints<S>& positions,
                                                   bool two_frames) {
  requireCount(static_cast<std::size_t>(positions.count), held_->state().vertices.size());
  StepMemory memory(*held_, two_frames ? UpdateKind::TwoFrames : UpdateKind::All);
  takeStep<S>(*held_, *this, {positions.data, positions.point, positions.component}, two_frames,
              memory);
  return held_->state().report;
}

template <typename S>
const MeshUpdate& DeformableMesh<S>::update(const unsigned* indices, const Point* positions,
                                            std::size_t count) {
  takeStep<S>(*held_, *this, indices, positions, count, {*held_, UpdateKind::Some});
  return held_->state().report;
}

template <typename S>
const MeshUpdate& DeformableMesh<S>::updateTwoFrames(const Point* positions, std::size_t count) {
  return updateStrided(sideBySide(positions, count), true);
}

template <typename S>
void DeformableMesh<S>::setPrevious(std::vector<Point> positions) {
  MeshState& state = held_->state();
  state.previous = inDouble(positions);
  VertexSummary<double> step;
  step.add(state.vertices.data(), state.previous.data(), state.previous.size());
  state.report.largest_displacement = step.largestDisplacement();
  setUserPrevious(*held_, std::move(positions));
}

template <typename S>
const MeshUpdate& DeformableMesh<S>::lastUpdate() const {
  return held_->state().report;
}

template <typename S>
bool DeformableMesh<S>::validate(std::string* reason) const {
  return checkMesh(held_->state(), reason);
}

template <typename S>
void DeformableMesh<S>::setUpdateThreads(int threads) {
  requireThreads("setUpdateThreads", threads);
  held_->state().update_threads = threads;
}

template <typename S>
void DeformableMesh<S>::setQueryThreads(int threads) {
  requireThreads("setQueryThreads", threads);
  held_->state().query_threads = threads;
}

template <typename S>
std::size_t DeformableMesh<S>::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(*this) + sizeof(*held_) + held_->state().topology->bytes() +
         size(held_->state().vertices) + size(held_->state().previous) +
         held_->state().tree.bytes() + held_->state().moved.bytes() + userBytes(*held_);
}

template <typename S>
void DeformableMesh<S>::refuseMatrix(const char* what, Eigen::Index rows, Eigen::Index columns) {
  throw std::invalid_argument(std::string("DeformableMesh: the ") + what + " are a " +
                              std::to_string(rows) + " x " + std::to_string(columns) +
                              " matrix; N x 3 is needed");
}

template <typename S>
void DeformableMesh<S>::refuseLengths(std::size_t indices, std::size_t positions) {
  throw std::invalid_argument("DeformableMesh: " + std::to_string(positions) +
                              " positions given for " + std::to_string(indices) + " indices");
}

template class DeformableMesh<float>;
template class DeformableMesh<double>;

}  // namespace adaptive_bvh
