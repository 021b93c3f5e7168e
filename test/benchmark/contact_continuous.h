#pragma once

#include <array>
#include <vector>

#include "contact_judge.h"
#include "triangles/time_of_impact.h"

namespace adaptive_bvh_bench {

using adaptive_bvh::FeatureKind;
using adaptive_bvh::MovingFeatures;

/// A mesh at the start and at the end of a step.
struct MovingPose {
  const Mesh& mesh;  ///< its vertices are not read
  const Positions &start, &end;
};

/// The four corners of a pair of features: a vertex and a face, or two edges.
using FeatureCorners = std::array<std::size_t, 4>;

inline MovingFeatures moving(const MovingPose& pose, FeatureKind kind, const FeatureCorners& c) {
  const Positions &x = pose.start, &y = pose.end;
  return {kind, {x[c[0]], x[c[1]], x[c[2]], x[c[3]]}, {y[c[0]], y[c[1]], y[c[2]], y[c[3]]}};
}

/// The first time at which two features of the mesh that share no vertex touch, or infinity: of all
/// pairs whose swept boxes overlap, no tree is involved.
double earliestImpactOfAll(const MovingPose& pose);

}  // namespace adaptive_bvh_bench
