#pragma once

#include <vector>

#include "base/vectors.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// The generalised winding number of any triangles, by a four-wide tree (Barill, Dickson, Schmidt,
/// Levin, Jacobson 2018, "Fast winding numbers for soups and clouds"): triangles far away count by
/// the moments of their areas up to the second order, seen from their centroid; near ones exactly.
///
/// The error is bounded, not estimated: 1 / |y - x| has the n-th derivatives n! / |y - x|^(n+1) at
/// most. So triangles within r of a centroid at the distance R, q = r / R < 1, whose points are h
/// away from it, are off by at most 1 / (4 pi R^2) (sum over n >= 3 of (n + 1) integral of (h /
/// R)^n). With h^n <= h^2 r^(n-2), and B the integral of h^2, that is B / (4 pi R^4) q (4 - 3 q) /
/// (1 - q)^2 or less.
class WindingTree {
 public:
  /// Computes the moments of a mesh in its present state: 30 ns a triangle.
  void refit(const MeshState& mesh);

  /// The winding number at a point, up to `tolerance` and the rounding of windingNumbers.
  double of(const MeshState& mesh, const fcl::Vector3d& x, double tolerance) const;

 private:
  /// Moments of the triangles below a box, divided by 4 pi, in the tree's coordinates.
  struct Moments {
    double area = 0, radius = 0;
    double square = 0;                             ///< the integral of h^2, h from the centre
    fcl::Vector3d center = fcl::Vector3d::Zero();  ///< of the area
    fcl::Vector3d first = fcl::Vector3d::Zero();   ///< the integral of the normal n
    /// The integral of n h, made symmetric; h from the centre: xx, xy, xz, yy, yz, zz.
    double second[6] = {};
    /// That of n h h: xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz.
    double third[10] = {};
  };
  /// Those of the four boxes of a node, as they are evaluated.
  struct Node {
    Float4 area, square, radius, center[3], first[3], second[6], trace, third[10], traces[3];
  };
  struct Sum {
    double number = 0, error = 0;
  };

  static Moments ofTriangle(const fcl::Vector3d (&corners)[3]);
  static void add(const Moments& part, Moments& sum);
  static Moments combined(const Moments* parts, const WideNode& node);
  static void write(const Moments& moments, int lane, Node& to);
  /// Evaluates four boxes, and sums those whose error is at most `limit`. Returns a bit for each.
  static unsigned evaluate(const Node& node, const Vector4x3& x, float limit, Sum& sum);
  Sum walk(const MeshState& mesh, const fcl::Vector3d& x, const fcl::Vector3d& in_tree,
           float limit) const;

  std::vector<Node> nodes_;
  std::vector<Moments> moments_;  ///< by node, while they are made
};

}  // namespace adaptive_bvh
