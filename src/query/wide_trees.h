#pragma once

#include <optional>

#include "query/placed_mesh.h"
#include "query/relative_frame.h"

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
    constexpr double kSlack = 1 + 1. / (1 << 16);  // for what the radius is rounded by
    return {turn_ * model.aabb_center.template cast<double>() + moved_,
            static_cast<double>(model.aabb_radius) * kSlack};
  }
  /// Where the model does not fit into them: others along the same axes.
  BodyCoordinates operator()(const BodyCoordinates& of_other) const {
    const fcl::Matrix3d axes = orthonormal(turn_.transpose() * of_other.axes());
    if (reach().fits(of_other))
      return {axes, turn_.transpose() * (of_other.origin - moved_), of_other.scale};
    const BodyCoordinates own = WideTreeOnDemand<S>::ownCoordinates(*mesh_.model, *mesh_.tree);
    return {axes, own.origin, own.scale};
  }

 private:
  const PlacedMesh<BV>& mesh_;
  const fcl::Matrix3d turn_;
  const fcl::Vector3d moved_;
};

/// Coordinates of the first model with room for the second beside it. None where it is much larger.
template <typename BV>
std::optional<BodyCoordinates> coordinatesForBoth(const PlacedMesh<BV>& first,
                                                  const PlacedMesh<BV>& second) {
  constexpr double kSmallest = 1. / 16;
  const BodyCoordinates own =
      WideTreeOnDemand<typename BV::S>::ownCoordinates(*first.model, *first.tree);
  const Reach reach = SharedCoordinates<BV>(second, first).reach();
  for (double share = 1; share >= kSmallest; share /= 2) {
    const BodyCoordinates common(own.axes(), own.origin, share * own.scale);
    if (reach.fits(common)) return common;
  }
  return std::nullopt;
}

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
  const WideTree<S>& tree1 = first.tree->wide.current(*first.model, *first.tree, [&] {
    const std::optional<BodyCoordinates> both = coordinatesForBoth(first, second);
    return both ? *both : WideTreeOnDemand<S>::ownCoordinates(*first.model, *first.tree);
  });
  return {tree1, beside(second, first, tree1)};
}

/// Whether these will have the same coordinates. `R`, `T`: see RelativeFrame.
template <typename BV>
bool canShareCoordinates(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                         const fcl::Matrix3<typename BV::S>& R,
                         const fcl::Vector3<typename BV::S>& T) {
  const bool first_is = first.tree->wide.isCurrent(*first.tree),
             second_is = second.tree->wide.isCurrent(*second.tree);
  const auto fits = [](const PlacedMesh<BV>& mesh, const PlacedMesh<BV>& other) {
    return SharedCoordinates<BV>(mesh, other).reach().fits(wideTreeOf(other).coordinates());
  };
  if (first_is && second_is)
    return RelativeFrame<typename BV::S>(wideTreeOf(first), wideTreeOf(second), R, T).isSame();
  if (second_is) return fits(first, second);
  if (first_is) return fits(second, first);
  return coordinatesForBoth(first, second).has_value();
}

}  // namespace adaptive_bvh
