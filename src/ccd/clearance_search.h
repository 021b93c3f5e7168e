#pragma once

#include <array>
#include <vector>

#include "ccd/motion_walk.h"

namespace adaptive_bvh {

/// Two bodies that move, or a mesh with itself.
struct ClearanceQuery {
  BoxedBody &first, &second;  ///< the same for a mesh with itself; a plane is the second
  double tolerance;
  const NeighbourRanges* surface = nullptr;  ///< for a mesh with itself: neighbours to leave out
  const IgnoredPairs* ignored = nullptr;     ///< pairs of triangles, or null
  bool is_swapped = false;                   ///< whether answers have the second body first
};

/// The query of two bodies in any order: meshes come first, planes and half-spaces last.
ClearanceQuery queryOf(BoxedBody& first, BoxedBody& second, double tolerance);

/// Throws std::invalid_argument if a tolerance is not above `least`, or not finite.
void requireTolerable(double tolerance, double least);
/// Throws std::invalid_argument if the tolerance is too small for the bodies, or both are planes.
void requireTolerable(const ClearanceQuery& query);

/// Reverses the order of the bodies.
void swapBodies(MotionClearance& clearance);

/// Lowers `best` to the least distance, if that is less than best.upper - tolerance, and to 0 with
/// the time of the first impact if the bodies meet. Sets best.lower. Returns whether best.upper has
/// changed. If not, the bodies are at least best.upper - tolerance apart.
bool lowerClearance(const ClearanceQuery& query, MotionClearance& best);

/// Lowers `best` to the distance of two triangles, given by their indices, at the start or the end,
/// unless that is at most the tolerance: bodies may then meet before.
void lowerToTriangles(const ClearanceQuery& query, const std::array<int, 2>& triangles,
                      MotionClearance& best);

/// Finds the first time, not after `latest`, at which the bodies are at most `separation` apart; by
/// docs/bounds.md, 22, never late, and early where they are nearer than that and 2^-34 of their
/// extent. Sets found.time and found.elements. Returns whether there is one.
bool findFirstImpact(const ClearanceQuery& query, double separation, double latest,
                     MotionClearance& found);

/// Finds the times at which the bodies are nearer than a clearance.
void findIntervalsBelow(const ClearanceQuery& query, double clearance,
                        std::vector<MotionInterval>& intervals);

}  // namespace adaptive_bvh
