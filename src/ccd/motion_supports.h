#pragma once

#include <vector>

#include "ccd/moving_boxes.h"

namespace adaptive_bvh {

/// How far the nodes of two bodies extend towards each other along a direction, at both ends of a
/// part of the motion, in double precision: tells apart what boxes in single precision cannot, such
/// as flat parts at a constant distance. docs/bounds.md, 22.
class MotionSupports {
 public:
  /// The extents of a node's four boxes at the begin and at the end.
  struct Extents {
    double at[2][4];
  };

  /// Computes the extents along `n`, of length 1, from the first body to the second. It takes about
  /// as long as cost() tests of boxes.
  void assign(const MovingBody& first, const MovingBody& second, const fcl::Vector3d& n,
              double begin, double end);
  void clear() { is_set_ = false; }
  bool isSet() const { return is_set_; }
  static std::size_t cost(const MovingBody& first, const MovingBody& second);

  /// The pairs of boxes of two nodes that are at least `distance` apart along the direction, from
  /// `from` to `to`, shares of the part of the motion: bit 4 j + i for box i of the first node.
  unsigned apart(int first, int second, double from, double to, double distance) const;

 private:
  static void assignBody(const MovingBody& body, const fcl::Vector3d& n,
                         const MovingBody::At (&ends)[2], const fcl::Vector3d (&origins)[2],
                         std::vector<double> (&heights)[2], std::vector<Extents>& extents);

  bool is_set_ = false;
  std::vector<Extents> first_, second_;  ///< by node
  std::vector<double> heights_[2];       ///< by vertex
  double room_[2] = {0, 0};  ///< between the origins of both, along the direction, less errors
};

}  // namespace adaptive_bvh
