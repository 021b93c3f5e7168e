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
             "Eigen::Matrix<double, 3, Eigen::Dynamic> or an Eigen::Matrix<double, Eigen::Dynamic, "
             "3>"
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

void requireThreads(int threads) {
  if (threads < 1)
    throw std::invalid_argument("DeformableMesh::setThreads: " + std::to_string(threads) +
                                " threads; at least 1 is needed");
}

void requireCount(std::size_t count, std::size_t vertices) {
  if (count != vertices)
    throw std::invalid_argument("DeformableMesh: " + std::to_string(count) +
                                " positions given for " + std::to_string(vertices) + " vertices");
}

detail::StridedPoints sideBySide(const fcl::Vector3d* points, std::size_t count) {
  static_assert(sizeof(fcl::Vector3d) == 3 * sizeof(double), "points lie side by side");
  return {reinterpret_cast<const double*>(points), static_cast<Eigen::Index>(count), 3, 1};
}

}  // namespace

DeformableMesh::DeformableMesh(std::unique_ptr<MeshState> state) : state_(std::move(state)) {}

DeformableMesh::DeformableMesh(std::vector<Point> vertices, std::vector<fcl::Triangle> triangles)
    : state_(std::make_unique<MeshState>()) {
  build(std::move(vertices), std::move(triangles), *state_, *this);
}

DeformableMesh::DeformableMesh(TriangleMesh mesh)
    : DeformableMesh(std::move(mesh.vertices), std::move(mesh.triangles)) {}

DeformableMesh::DeformableMesh(const DeformableMesh& other)
    : fcl::CollisionGeometryd(other), state_(std::make_unique<MeshState>(*other.state_)) {
  state_->is_copy = true;
}

DeformableMesh& DeformableMesh::operator=(const DeformableMesh& other) {
  if (this == &other) return *this;
  if (state_) {
    state_->reserve(*other.state_);
    *state_ = *other.state_;
  } else {
    state_ = std::make_unique<MeshState>(*other.state_);
  }
  state_->is_copy = true;
  fcl::CollisionGeometryd::operator=(other);
  return *this;
}

DeformableMesh::DeformableMesh(DeformableMesh&& other) noexcept = default;
DeformableMesh& DeformableMesh::operator=(DeformableMesh&& other) noexcept = default;
DeformableMesh::~DeformableMesh() = default;

auto DeformableMesh::vertices() const -> const std::vector<Point>& { return state_->vertices; }

auto DeformableMesh::previousVertices() const -> const std::vector<Point>& {
  return state_->previous;
}

const std::vector<fcl::Triangle>& DeformableMesh::triangles() const {
  return state_->topology->triangles;
}

const MeshUpdate& DeformableMesh::update(const Point* positions, std::size_t count) {
  return updateStrided(sideBySide(positions, count), false);
}

const MeshUpdate& DeformableMesh::updateStrided(const detail::StridedPoints& positions,
                                                bool two_frames) {
  requireCount(static_cast<std::size_t>(positions.count), state_->vertices.size());
  StepMemory memory(*state_, two_frames ? UpdateKind::TwoFrames : UpdateKind::All);
  takeStep(*state_, *this, {positions.data, positions.point, positions.component}, two_frames,
           memory);
  return state_->report;
}

const MeshUpdate& DeformableMesh::update(const unsigned* indices, const Point* positions,
                                         std::size_t count) {
  takeStep(*state_, *this, indices, positions, count, {*state_, UpdateKind::Some});
  return state_->report;
}

const MeshUpdate& DeformableMesh::updateTwoFrames(const Point* positions, std::size_t count) {
  return updateStrided(sideBySide(positions, count), true);
}

void DeformableMesh::setPrevious(std::vector<Point> positions) {
  MeshState& state = *state_;
  state.previous = std::move(positions);
  VertexSummary<double> step;
  step.add(state.vertices.data(), state.previous.data(), state.previous.size());
  state.report.largest_displacement = step.largestDisplacement();
}

const MeshUpdate& DeformableMesh::lastUpdate() const { return state_->report; }

bool DeformableMesh::validate(std::string* reason) const { return checkMesh(*state_, reason); }

void DeformableMesh::setThreads(int threads) {
  requireThreads(threads);
  state_->threads = threads;
}

std::size_t DeformableMesh::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(*this) + sizeof(*state_) + state_->topology->bytes() + size(state_->vertices) +
         size(state_->previous) + state_->tree.bytes() + state_->moved.bytes();
}

void DeformableMesh::refuseMatrix(const char* what, Eigen::Index rows, Eigen::Index columns) {
  throw std::invalid_argument(std::string("DeformableMesh: the ") + what + " are a " +
                              std::to_string(rows) + " x " + std::to_string(columns) +
                              " matrix; N x 3 is needed");
}

void DeformableMesh::refuseLengths(std::size_t indices, std::size_t positions) {
  throw std::invalid_argument("DeformableMesh: " + std::to_string(positions) +
                              " positions given for " + std::to_string(indices) + " indices");
}

}  // namespace adaptive_bvh
