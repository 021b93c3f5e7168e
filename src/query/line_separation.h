#pragma once

#include <algorithm>
#include <cmath>

#include "query/placed_mesh.h"
#include "volume/volume.h"

namespace adaptive_bvh {

/// How far apart two nodes are along the line between the nearest points so far, at least. Of
/// either node counts its box or its volume, whichever reaches less far: volumes of a body that
/// turns by its vertices may be inflated where boxes are tight, and boxes loose where parts lie
/// askew.
template <typename BV>
class LineSeparation {
 public:
  using S = typename BV::S;

  /// `error`: how far the boxes, and the volumes' numbers, may be off together.
  LineSeparation(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                 const fcl::Matrix3<S>& R, const fcl::Vector3<S>& T, double error)
      : sides_{Side(first), Side(second)},
        R_(R.template cast<double>()),
        T_(T.template cast<double>()),
        error_(error) {}

  /// `direction`: in the first model's coordinates, of length 1 up to rounding, or zero.
  void lookAlong(const fcl::Vector3<S>& direction) {
    const fcl::Vector3d& n = direction.template cast<double>();
    sides_[0].lookAlong(n);
    sides_[1].lookAlong(-(R_.transpose() * n));
    apart_ = n.dot(T_) - error_;
  }
  /// `has_volumes`: the nodes' volumes may be read.
  double operator()(int node1, int node2, bool has_volumes) const {
    return apart_ - sides_[0].farthest(node1, has_volumes) - sides_[1].farthest(node2, has_volumes);
  }

 private:
  class Side {
   public:
    explicit Side(const PlacedMesh<BV>& mesh)
        : model_(*mesh.model), frame_(mesh.tree->boxes->frame), nodes_(mesh.tree->boxes->nodes()) {}

    void lookAlong(const fcl::Vector3d& n) {
      n_ = n;
      in_frame_ = static_cast<double>(frame_.unit()) * (frame_.axes().transpose() * n);
      origin_ = n.dot(frame_.origin().template cast<double>());
    }
    /// The largest coordinate of a node along the direction, at most.
    double farthest(int node, bool has_volumes) const {
      const Box box = nodes_.box(node);
      double most = origin_;
      for (int k = 0; k < 3; ++k)
        most += std::max(in_frame_[k] * double(box.low[k]), in_frame_[k] * double(box.high[k]));
      return has_volumes ? std::min(most, farthestOfVolume(node)) : most;
    }

   private:
    double farthestOfVolume(int node) const {
      const auto volume = Volume<BV>::parallelogram(model_.getBV(node).bv);
      const auto along = [&](const fcl::Vector3<S>& v) {
        return n_.dot(v.template cast<double>());
      };
      return along(volume.middle) + std::abs(along(volume.half[0])) +
             std::abs(along(volume.half[1])) + static_cast<double>(volume.radius);
    }

    const fcl::BVHModel<BV>& model_;
    const BodyFrame<S>& frame_;
    const BoxNodes<const BoxNode> nodes_;
    fcl::Vector3d n_ = fcl::Vector3d::Zero(), in_frame_ = n_;  ///< along the frame's axes
    double origin_ = 0;
  };

  Side sides_[2];
  const Eigen::Matrix3d R_;
  const fcl::Vector3d T_;
  const double error_;
  double apart_ = 0;
};

}  // namespace adaptive_bvh
