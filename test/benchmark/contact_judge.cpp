#include "contact_judge.h"

#include <algorithm>
#include <numeric>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>  // BVH_model.h calls fit() without declaring it
#include <fcl/narrowphase/detail/traversal/collision/intersect.h>

#include "contact_continuous.h"
#include "contact_pairs.h"

namespace adaptive_bvh_bench {
namespace {

/// The boxes of a mesh's triangles, and an order in which their lower x ascends.
class SortedBoxes {
 public:
  explicit SortedBoxes(const Mesh& mesh) : SortedBoxes(mesh, mesh.vertices, mesh.vertices) {}
  /// Around two positions of every vertex.
  SortedBoxes(const Mesh& mesh, const Positions& start, const Positions& end)
      : order_(mesh.triangles.size()) {
    for (const fcl::Triangle& t : mesh.triangles) {
      boxes_.emplace_back(start[t[0]]);
      boxes_.back().extend(start[t[1]]).extend(start[t[2]]);
      for (int k = 0; k < 3; ++k) boxes_.back().extend(end[t[k]]);
    }
    std::iota(order_.begin(), order_.end(), 0u);
    std::sort(order_.begin(), order_.end(), [this](unsigned a, unsigned b) { return x(a) < x(b); });
  }

  /// Calls what(i, j) for each box i of ours and box j of `other` that overlap and where j does not
  /// begin before i along x; with `strictly` not at the same x either.
  template <typename What>
  void forOverlaps(const SortedBoxes& other, bool strictly, const What& what) const {
    const auto beginsAfter = [&](unsigned i, unsigned j) {
      return strictly ? other.x(j) > x(i) : other.x(j) >= x(i);
    };
    std::size_t start = 0;
    for (unsigned i : order_) {
      while (start < other.order_.size() && !beginsAfter(i, other.order_[start])) ++start;
      for (std::size_t k = start; k < other.order_.size(); ++k) {
        const unsigned j = other.order_[k];
        if (other.x(j) > boxes_[i].max()[0]) break;
        if (boxes_[i].intersects(other.boxes_[j])) what(i, j);
      }
    }
  }

 private:
  double x(unsigned i) const { return boxes_[i].min()[0]; }

  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<unsigned> order_;
};

/// The earliest impact so far of some pairs of features. Nothing is tested whose boxes up to then
/// do not overlap.
class FirstImpact {
 public:
  explicit FirstImpact(const MovingPose& pose) : pose_(pose), now_(pose.end) {}

  double time() const { return time_; }

  /// All features of two triangles.
  void test(const fcl::Triangle& a, const fcl::Triangle& b) {
    for (int k = 0; k < 3; ++k) {
      test(FeatureKind::VertexFace, {a[k], b[0], b[1], b[2]});
      test(FeatureKind::VertexFace, {b[k], a[0], a[1], a[2]});
      for (int l = 0; l < 3; ++l)
        test(FeatureKind::EdgeEdge, {a[k], a[(k + 1) % 3], b[l], b[(l + 1) % 3]});
    }
  }

 private:
  void test(FeatureKind kind, const FeatureCorners& c) {
    const std::size_t firsts = kind == FeatureKind::EdgeEdge ? 2 : 1;
    Eigen::AlignedBox3d boxes[2];
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = std::max(i, firsts); i < firsts && j < 4; ++j)
        if (c[i] == c[j]) return;
      boxes[i >= firsts].extend(pose_.start[c[i]]).extend(now_[c[i]]);
    }
    if (!boxes[0].intersects(boxes[1])) return;
    const double time = moving(pose_, kind, c).timeOfImpact(0, std::min(time_, 1.));
    if (!(time < time_)) return;
    time_ = time;
    for (std::size_t v = 0; v < now_.size(); ++v)
      now_[v] = pose_.start[v] + time * (pose_.end[v] - pose_.start[v]);
  }

  const MovingPose& pose_;
  Positions now_;  // at that time
  double time_ = MovingFeatures::kNever;
};

}  // namespace

double earliestImpactOfAll(const MovingPose& pose) {
  const SortedBoxes boxes(pose.mesh, pose.start, pose.end);
  FirstImpact first(pose);
  boxes.forOverlaps(boxes, false, [&](unsigned a, unsigned b) {
    if (a != b) first.test(pose.mesh.triangles[a], pose.mesh.triangles[b]);
  });
  return first.time();
}

bool touchByFcl(const Mesh& first, unsigned a, const Mesh& second, unsigned b) {
  const auto corner = [](const Mesh& mesh, unsigned t, int k) -> const Point& {
    return mesh.vertices[mesh.triangles[t][k]];
  };
  return fcl::detail::Intersect<double>::intersect_Triangle(
      corner(first, a, 0), corner(first, a, 1), corner(first, a, 2), corner(second, b, 0),
      corner(second, b, 1), corner(second, b, 2));
}

namespace {

/// Takes pairs into the list that fits.
class Judge {
 public:
  Judge(const Mesh& first, const Mesh& second) : first_(first), second_(second) {}

  void test(unsigned i, unsigned j) {
    const Touch touch = touchOf(first_, i, second_, j);
    if (touch == Touch::Yes) found_.surely.emplace_back(i, j);
    if (touch != Touch::No) found_.possibly.emplace_back(i, j);
  }
  TouchingPairs sortedPairs(bool is_self) {
    return {sorted(std::move(found_.surely), is_self), sorted(std::move(found_.possibly), is_self)};
  }

 private:
  const Mesh &first_, &second_;
  TouchingPairs found_;
};

}  // namespace

TouchingPairs touchingPairs(const Mesh& first, const Mesh& second) {
  const SortedBoxes boxes(first), others(second);
  Judge judge(first, second);
  boxes.forOverlaps(others, false, [&](unsigned i, unsigned j) { judge.test(i, j); });
  others.forOverlaps(boxes, true, [&](unsigned j, unsigned i) { judge.test(i, j); });
  return judge.sortedPairs(false);
}

TouchingPairs touchingPairs(const Mesh& mesh) {
  const SortedBoxes boxes(mesh);
  Judge judge(mesh, mesh);
  boxes.forOverlaps(boxes, false, [&](unsigned a, unsigned b) {
    if (a != b && !areNeighbours(mesh.triangles[a], mesh.triangles[b])) judge.test(a, b);
  });
  return judge.sortedPairs(true);
}

}  // namespace adaptive_bvh_bench
