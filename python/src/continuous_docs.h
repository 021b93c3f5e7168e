#pragma once

// Docstrings of continuous collision. `separation` is a length, the distance below which features
// have come together.
namespace adaptive_bvh::python::docs {

inline constexpr const char* kMotion =
    R"(How a mesh moves between two frames: every vertex on a straight line in the world, from its
position at the start (t = 0) to that at the end (t = 1). Keeps copies of both, and the mesh alive.)";

inline constexpr const char* kMotionInit =
    R"(mesh: its triangles say what moves.
start, end: (num_vertices, 3), in the mesh's frame. Without `start`, the positions before the last
    update, which must be update_two_frames (else ValueError); without `end`, the present positions.
start_tf, end_tf: poses that place the mesh in the world at both times.)";

inline constexpr const char* kCandidates =
    R"(All pairs of features that may come as near as `separation`, a length: others cannot.

first, second: Motions. Returns FeaturePairs. ValueError when the separation is negative, infinite or
NaN; likewise of all that take one.)";

inline constexpr const char* kWithinOne = "As above, of one Motion with itself.";

inline constexpr const char* kTimeOfImpact =
    R"(When two features come together: 0 to 1, never too late, or infinity when they do not.

kind: 'vertex-face', 'face-vertex' or 'edge-edge', the first mesh's feature first.
pair: their two numbers, as in FeaturePairs.
separation: a length; so near they have come together.)";

inline constexpr const char* kTimesOfImpact =
    R"(When the features of each of `pairs`, FeaturePairs, come together. Returns ImpactTimes.

separation: a length; so near they have come together.)";

inline constexpr const char* kEarliestImpact =
    R"(The first two features that come together, and when: an Impact. Needs no candidates.

first, second: Motions.
separation: a length; so near they have come together.)";

inline constexpr const char* kLargestSafeStep =
    R"(The time up to which nothing comes together, 0 to 1: at every earlier time all features are
farther apart than `separation`, a length.

first, second: Motions.)";

inline constexpr const char* kSafeDisplacements =
    R"(How far each vertex may move from its start, in any direction and whatever the others do within
theirs, so that no features come as near as `separation`, a length.

first, second: Motions. Returns two arrays of lengths, (num_vertices,) float64 of each.)";

inline constexpr const char* kSafeDisplacementsOne =
    "As above, of one Motion with itself. Returns one array.";

}  // namespace adaptive_bvh::python::docs
