#pragma once

#include "query/proximity_arguments.h"
#include "query/tree_pair.h"
#include "query/within_tests.h"

namespace adaptive_bvh {

/// A triangle of each of two meshes, by their indices.
struct TrianglePair {
  unsigned first, second;
};

/// Two meshes, placed.
template <typename S>
struct PairOfMeshes {
  PairOfMeshes(const DeformableMesh<S>& mesh1, const fcl::Transform3<S>& tf1,
               const DeformableMesh<S>& mesh2, const fcl::Transform3<S>& tf2)
      : PairOfMeshes(PlacedMesh<S>(mesh1, tf1), PlacedMesh<S>(mesh2, tf2)) {}
  PairOfMeshes(const PlacedMesh<S>& mesh1, const PlacedMesh<S>& mesh2)
      : first(mesh1), second(mesh2), to_first(mesh1.tf, mesh2.tf) {}

  /// Of two triangles; of triangle 0 where there are no such.
  TriangleGap gap(const TrianglePair& triangles) const {
    TrianglePoints<double> q = corners(second, triangles.second);
    for (fcl::Vector3d& x : q) x = to_first(x);
    return gapOf(corners(first, triangles.first), q);
  }

  const PlacedMesh<S> first, second;
  const RelativePlacement to_first;

 private:
  static TrianglePoints<double> corners(const PlacedMesh<S>& mesh, unsigned triangle) {
    return mesh.pointsOf(triangle < unsigned(mesh.mesh.numTriangles()) ? triangle : 0u);
  }
};

/// Aligns the trees where so many pairs of boxes are at most so far apart that it is worth it.
template <typename S>
void alignIfNear(TreePair<S>& trees, double distance) {
  constexpr int kMany = 64;
  if (!trees.frame().isPrecise()) return;
  const BoxFrame frame(trees.frame().change(), distance * trees.first().scale());
  const int depth = trees.first().depth() + trees.second().depth();
  if (WideSearch({trees.first().nodes(), trees.second().nodes(), depth, frame}).hasMorePairs(kMany))
    trees.align();
}

/// Calls search(frame) with how the second tree lies in the first: SameFrame or RelativeFrame; or
/// testAll() where single precision cannot express it.
template <typename S, typename Search, typename TestAll>
void searchInFrame(const TreePair<S>& trees, const Search& search, const TestAll& testAll) {
  if (!trees.frame().isPrecise())
    testAll();
  else if (trees.frame().isSame())
    search(trees.frame().same());
  else
    search(trees.frame());
}

/// Whether balls around two meshes are farther apart.
template <typename S>
bool areBallsFarther(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                     const RelativePlacement& to_first, double distance) {
  constexpr double kSlack = 1 + 1e-6;
  const auto &a = *first.geometry, &b = *second.geometry;
  const fcl::Vector3d middle = a.aabb_center.template cast<double>();
  const double apart = (to_first(b.aabb_center) - middle).norm();
  const double radii = double(a.aabb_radius) + double(b.aabb_radius);
  return apart > (distance + radii) * kSlack + 1e-12 * to_first.T.norm();
}

/// Every pair, where single precision cannot express how the meshes lie.
template <typename S, typename Sink>
void testAllPairs(const WithinInput<S>& input, Sink& sink) {
  const SameFrame frame;  // of no use here
  const WithinTests<S, SameFrame, Sink> tests(input, frame, sink);
  sink.clear();
  if (areBallsFarther(input.first, input.second, input.to_first, input.distance)) return;
  const auto size1 = static_cast<unsigned>(input.first.mesh.numTriangles()),
             size2 = static_cast<unsigned>(input.second.mesh.numTriangles());
  for (unsigned i = 0; i < size1; ++i)
    for (unsigned j = 0; j < size2 && !sink.isDone(); ++j) {
      const TriangleGap gap = tests.gap({i, j});
      if (tests.isNear(gap)) sink.add({i, j}, &gap);
    }
}

}  // namespace adaptive_bvh
