#include "distance_judge.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>

#include "support/quad_geometry.h"

namespace adaptive_bvh_bench {
namespace {

using adaptive_bvh_test::quad::Real;
namespace quad = adaptive_bvh_test::quad;

quad::Triangle triangleOf(const scenarios::Mesh& mesh, std::size_t triangle) {
  const fcl::Triangle& t = mesh.triangles[triangle];
  return {quad::of(mesh.vertices[t[0]]), quad::of(mesh.vertices[t[1]]),
          quad::of(mesh.vertices[t[2]])};
}

using Corners = std::array<Eigen::Vector3d, 3>;

Corners cornersOf(const scenarios::Mesh& mesh, std::size_t triangle) {
  const fcl::Triangle& t = mesh.triangles[triangle];
  return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

/// Boxes around the triangles of a mesh, halved along their longest side.
class BoxTree {
 public:
  explicit BoxTree(const scenarios::Mesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    for (const fcl::Triangle& t : mesh.triangles) {
      boxes_.emplace_back(mesh.vertices[t[0]]);
      boxes_.back().extend(mesh.vertices[t[1]]).extend(mesh.vertices[t[2]]);
    }
    std::iota(order_.begin(), order_.end(), std::size_t(0));
    build(0, order_.size());
  }

  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t first, count;  ///< in the order of the tree
    std::size_t right;         ///< its other child; the first one follows it
    bool isLeaf() const { return count <= 4; }
  };
  const Node& node(std::size_t i) const { return nodes_[i]; }
  const Eigen::AlignedBox3d& box(std::size_t place) const { return boxes_[order_[place]]; }
  quad::Triangle triangle(std::size_t place) const { return triangleOf(mesh_, order_[place]); }
  Corners corners(std::size_t place) const { return cornersOf(mesh_, order_[place]); }

 private:
  void build(std::size_t first, std::size_t count) {
    const std::size_t number = nodes_.size();
    nodes_.push_back({Eigen::AlignedBox3d(), first, count, 0});
    for (std::size_t i = first; i < first + count; ++i)
      nodes_[number].box.extend(boxes_[order_[i]]);
    if (nodes_[number].isLeaf()) return;
    int axis;
    nodes_[number].box.sizes().maxCoeff(&axis);
    const auto begin = order_.begin() + std::ptrdiff_t(first);
    std::nth_element(begin, begin + std::ptrdiff_t(count / 2), begin + std::ptrdiff_t(count),
                     [&](std::size_t a, std::size_t b) {
                       return boxes_[a].center()[axis] < boxes_[b].center()[axis];
                     });
    build(first, count / 2);
    nodes_[number].right = nodes_.size();
    build(first + count / 2, count - count / 2);
  }

  const scenarios::Mesh& mesh_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

class NearestPair {
 public:
  NearestPair(const BoxTree& first, const BoxTree& second) : first_(first), second_(second) {}

  double find() {
    visit(0, 0);
    return static_cast<double>(least_);
  }

 private:
  void visit(std::size_t i, std::size_t j) {
    const BoxTree::Node &a = first_.node(i), &b = second_.node(j);
    if (isFarther(a.box, b.box)) return;
    if (a.isLeaf() && b.isLeaf()) return test(a, b);
    const bool split_first = b.isLeaf() || (!a.isLeaf() && a.box.volume() > b.box.volume());
    std::array<std::size_t, 2> below = split_first ? std::array<std::size_t, 2>{i + 1, a.right}
                                                   : std::array<std::size_t, 2>{j + 1, b.right};
    const auto gap = [&](std::size_t child) {
      return split_first ? first_.node(child).box.squaredExteriorDistance(b.box)
                         : second_.node(child).box.squaredExteriorDistance(a.box);
    };
    if (gap(below[1]) < gap(below[0])) std::swap(below[0], below[1]);
    for (const std::size_t child : below) split_first ? visit(child, j) : visit(i, child);
  }
  void test(const BoxTree::Node& a, const BoxTree::Node& b) {
    for (std::size_t i = a.first; i < a.first + a.count; ++i)
      for (std::size_t j = b.first; j < b.first + b.count; ++j)
        if (!isFarther(first_.box(i), second_.box(j)) &&
            gapOf(first_.corners(i), second_.corners(j)) < enough())
          least_ = std::min(least_, quad::distance(first_.triangle(i), second_.triangle(j)));
  }
  /// What is hardly nearer is of no interest: on parallel surfaces all pairs are as near.
  double enough() const { return static_cast<double>(least_) * (1 - 1e-12); }
  bool isFarther(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) const {
    return least_ > 0 ? a.exteriorDistance(b) > enough() : true;
  }
  /// A lower bound of the distance: along either's normal and the line between the middles.
  static double gapOf(const Corners& p, const Corners& q) {
    const Eigen::Vector3d axes[3] = {(p[1] - p[0]).cross(p[2] - p[0]),
                                     (q[1] - q[0]).cross(q[2] - q[0]),
                                     q[0] + q[1] + q[2] - p[0] - p[1] - p[2]};
    double gap = 0;
    for (const Eigen::Vector3d& axis : axes) {
      const double length = axis.norm();
      if (!(length > 0)) continue;
      double p_ends[2] = {1e300, -1e300}, q_ends[2] = {1e300, -1e300}, size = 0;
      for (const auto& [corners, ends] : {std::pair(&p, p_ends), std::pair(&q, q_ends)})
        for (const Eigen::Vector3d& x : *corners) {
          const double along = axis.dot(x - p[0]) / length;
          ends[0] = std::min(ends[0], along);
          ends[1] = std::max(ends[1], along);
          size = std::max(size, (x - p[0]).norm());
        }
      gap = std::max(
          {gap, q_ends[0] - p_ends[1] - 1e-14 * size, p_ends[0] - q_ends[1] - 1e-14 * size});
    }
    return gap;
  }

  const BoxTree &first_, &second_;
  Real least_ = 1e300;
};

}  // namespace

double exactDistance(const scenarios::Mesh& first, const scenarios::Mesh& second) {
  const BoxTree of_first(first), of_second(second);
  return NearestPair(of_first, of_second).find();
}

namespace {

/// Whether all corners are clearly on one side of a plane: of most pairs, and quickly.
bool areBeside(const Corners& corners, const Corners& plane) {
  const Eigen::Vector3d u = plane[1] - plane[0], v = plane[2] - plane[0];
  double sides[3], unsure = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d w = corners[k] - plane[0];
    sides[k] = u.cross(v).dot(w);
    unsure = std::max(unsure, 1e-11 * u.norm() * v.norm() * w.norm());
  }
  return std::min({sides[0], sides[1], sides[2]}) > unsure ||
         std::max({sides[0], sides[1], sides[2]}) < -unsure;
}

quad::Triangle shrunk(const Corners& corners, double share) {
  const quad::Point x[3] = {quad::of(corners[0]), quad::of(corners[1]), quad::of(corners[2])};
  const quad::Point middle = Real(1) / 3 * (x[0] + x[1] + x[2]);
  quad::Triangle smaller;
  for (std::size_t k = 0; k < 3; ++k) smaller[k] = x[k] + Real(share) * (middle - x[k]);
  return smaller;
}

}  // namespace

Touch touchOf(const scenarios::Mesh& first, unsigned a, const scenarios::Mesh& second, unsigned b) {
  constexpr double kBarely = 1e-12;
  const Corners p = cornersOf(first, a), q = cornersOf(second, b);
  if (areBeside(p, q) || areBeside(q, p)) return Touch::No;
  const double size = (p[1] - p[0]).norm() + (p[2] - p[0]).norm() + (q[1] - q[0]).norm() +
                      (q[2] - q[0]).norm() + (q[0] - p[0]).norm();
  if (quad::distance(shrunk(p, 0), shrunk(q, 0)) > Real(kBarely * size)) return Touch::No;
  return quad::distance(shrunk(p, kBarely), shrunk(q, kBarely)) > 0 ? Touch::Barely : Touch::Yes;
}

double exactDistance(const scenarios::Mesh& first, unsigned a, const scenarios::Mesh& second,
                     unsigned b) {
  return static_cast<double>(quad::distance(triangleOf(first, a), triangleOf(second, b)));
}

}  // namespace adaptive_bvh_bench
