#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// The four-wide trees of two models.
template <typename S>
struct WideTrees {
  const WideTree<S>&first, &second;
};

/// A ball that holds a model, in the coordinates of another.
struct Reach {
  fcl::Vector3d middle;
  double radius;

  /// Whether the other model's tree may have the ball in its coordinates: they are below 2.
  bool fits(const BodyCoordinates& coordinates) const {
    constexpr double kLargest = 2 - 1. / (1 << 10);
    return coordinates(middle).cwiseAbs().maxCoeff() + coordinates.scale * radius < kLargest;
  }
};

/// Coordinates of a model that are those of another, where it is placed beside it.
template <typename BV>
class SharedCoordinates {
 public:
  using S = typename BV::S;

  SharedCoordinates(const PlacedMesh<BV>& mesh, const PlacedMesh<BV>& other)
      : mesh_(mesh),
        turn_(other.tf.linear().template cast<double>().transpose() *
              mesh.tf.linear().template cast<double>()),
        moved_(other.tf.linear().template cast<double>().transpose() *
               (mesh.tf.translation() - other.tf.translation()).template cast<double>()) {}

  /// In the other model's coordinates.
  Reach reach() const {
    const fcl::BVHModel<BV>& model = *mesh_.model;
    if (!mesh_.hasBoxes()) return at(model.aabb_center, static_cast<double>(model.aabb_radius));
    const BoxTree<S>& boxes = *mesh_.tree->boxes;
    const Float4 half = boxes.root().halfSides();
    const double squared =
        double(half[0]) * half[0] + double(half[1]) * half[1] + double(half[2]) * half[2];
    constexpr double kSlack = 1 + 1. / (1 << 16);  // for what boxes are off
    return at(boxes.middle(),
              std::sqrt(squared) * static_cast<double>(boxes.frame.unit()) * kSlack);
  }
  /// Where the model does not fit into them: others along the same axes.
  BodyCoordinates operator()(const BodyCoordinates& of_other) const {
    const fcl::Matrix3d axes = orthonormal(turn_.transpose() * of_other.axes());
    if (reach().fits(of_other))
      return {axes, turn_.transpose() * (of_other.origin - moved_), of_other.scale};
    BodyCoordinates own = WideTreeOnDemand<S>::ownCoordinates(*mesh_.model, *mesh_.tree);
    // Along other axes, coordinates are up to the root of three larger.
    return {axes, own.origin, own.scale / 2};
  }

 private:
  Reach at(const fcl::Vector3<S>& middle, double radius) const {
    return {turn_ * middle.template cast<double>() + moved_, radius};
  }

  const PlacedMesh<BV>& mesh_;
  const fcl::Matrix3d turn_;
  const fcl::Vector3d moved_;
};

/// The four-wide trees of two models, up to date. Those that are renewed now get the same
/// coordinates where that is possible: then no boxes grow by being turned from one to the other.
template <typename BV>
WideTrees<typename BV::S> wideTreesOf(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  using S = typename BV::S;
  if (first.model == second.model) return {wideTreeOf(first), wideTreeOf(first)};
  const auto beside = [](const PlacedMesh<BV>& mesh, const PlacedMesh<BV>& other,
                         const WideTree<S>& tree) -> const WideTree<S>& {
    return mesh.tree->wide.current(*mesh.model, *mesh.tree, [&] {
      return SharedCoordinates<BV>(mesh, other)(tree.coordinates());
    });
  };
  if (second.tree->wide.isCurrent(*second.tree)) {
    const WideTree<S>& tree2 = wideTreeOf(second);
    return {beside(first, second, tree2), tree2};
  }
  // Those of the first one, with a scale that leaves room for the second beside it.
  constexpr double kSmallest = 1. / 4;
  const WideTree<S>& tree1 = first.tree->wide.current(*first.model, *first.tree, [&] {
    const BodyCoordinates own = WideTreeOnDemand<S>::ownCoordinates(*first.model, *first.tree);
    const Reach reach = SharedCoordinates<BV>(second, first).reach();
    for (double share = 1; share >= kSmallest; share /= 2) {
      const BodyCoordinates common(own.axes(), own.origin, share * own.scale);
      if (reach.fits(common)) return common;
    }
    return own;
  });
  return {tree1, beside(second, first, tree1)};
}

}  // namespace adaptive_bvh
