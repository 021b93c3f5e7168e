#pragma once

#include <algorithm>

#include "query/placed_mesh.h"
#include "query/relative_frame.h"

namespace adaptive_bvh {

/// The trees of two placed meshes of one query. Their coordinates differ in general, and boxes grow
/// when they are turned from one to the other. Where so much is to be searched that it pays, the
/// smaller tree is made anew in the other's coordinates, in memory of the thread; it has the same
/// nodes. Only one pair of a thread can be aligned at a time.
template <typename S>
class TreePair {
 public:
  TreePair(const PlacedMesh<S>& first, const PlacedMesh<S>& second)
      : placed1_(first),
        placed2_(second),
        to_first_(first.tf, second.tf),
        first_(&first.tree()),
        second_(&second.tree()),
        frame_(*first_, *second_, to_first_) {}

  const WideTree& first() const { return *first_; }
  const WideTree& second() const { return *second_; }
  /// Takes the second tree to the first.
  const RelativeFrame& frame() const { return frame_; }
  const RelativePlacement& toFirst() const { return to_first_; }

  /// So many tests of boxes take as long as to align the trees; none where that is of no use.
  long costOfAlignment() const {
    return static_cast<long>(std::min(placed1_.mesh.numTriangles(), placed2_.mesh.numTriangles())) /
           2;
  }
  /// Gives both the same coordinates. Nothing where they have, and where one has no room for the
  /// other's: it is much smaller, or far away.
  void align() {
    if (frame_.isSame()) return;
    const bool is_first_smaller = placed1_.mesh.numTriangles() < placed2_.mesh.numTriangles();
    const PlacedMesh<S>&smaller = is_first_smaller ? placed1_ : placed2_,
          &larger = is_first_smaller ? placed2_ : placed1_;
    const RelativePlacement to_larger(larger.tf, smaller.tf);
    const BodyCoordinates& common = larger.tree().coordinates();
    if (!holds(common, to_larger, smaller)) return;
    // The larger's coordinates as the smaller sees them.
    const fcl::Matrix3d axes = orthonormal(to_larger.R.transpose() * common.axes());
    const BodyCoordinates of_smaller(axes, to_larger.R.transpose() * (common.origin - to_larger.T),
                                     common.scale);
    static thread_local WideTree anew;
    anew.adoptLinks(smaller.tree());
    anew.refit(smaller.mesh.vertices.data(), of_smaller, TaskPool(smaller.mesh.query_threads));
    (is_first_smaller ? first_ : second_) = &anew;
    frame_ = RelativeFrame(*first_, *second_, to_first_);
  }

 private:
  /// Whether a mesh has room in another's coordinates: they are below 2.
  static bool holds(const BodyCoordinates& common, const RelativePlacement& to_common,
                    const PlacedMesh<S>& mesh) {
    constexpr double kLargest = 2 - 1. / (1 << 10);
    constexpr double kSlack = 1 + 1. / (1 << 16);  // for what the radius is rounded by
    const fcl::Vector3d middle = common(to_common(mesh.geometry->aabb_center));
    const double radius = static_cast<double>(mesh.geometry->aabb_radius) * kSlack;
    return middle.cwiseAbs().maxCoeff() + common.scale * radius < kLargest;
  }

  const PlacedMesh<S>&placed1_, &placed2_;
  const RelativePlacement to_first_;
  const WideTree *first_, *second_;
  RelativeFrame frame_;
};

}  // namespace adaptive_bvh
