#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"

/// \file
/// Continuous collision: does anything come together between two frames, what, and when?
///
/// Every vertex moves on a straight line in the world, at constant speed, from its position at the
/// start (t = 0) to that at the end (t = 1). Edges and faces are those between their vertices at
/// each time. So a transform that changes moves each vertex on a straight line, too: a body that
/// turns shrinks a little in between.
///
/// Two features, a vertex and a face or two edges, *come together* when their distance is the
/// minimal separation or less. Without one (0) that is contact. Surfaces that do not intersect at
/// the start can only do so later after two features have come together. (Whether they intersect at
/// the start `collide` and `selfCollide` tell; a vertex that is inside a closed body already is not
/// found.) Within one mesh pairs of features that share a vertex are left out. Vertices without a
/// triangle have no part.
///
/// Answers are safe: no pair that comes together is missing, and no time is later than the exact
/// one, whatever is rounded (docs/bounds.md, 15). They may be early, and name a pair that passes at
/// next to nothing: by the time in which features come nearer by about 1e-14 of the size of the
/// pair, and by up to 1e-9 of it where edges are nearly parallel or a face is nearly a segment.
///
/// All functions are thread-safe on shared meshes, and run on several threads themselves where
/// DeformableMesh::setQueryThreads says so; the results and their order do not depend on that.
/// They search boxes of their own. All memory is kept by the thread and by the results: in a steady
/// step nothing is allocated on one thread.
///
/// Throws std::invalid_argument
/// - when a separation is negative, infinite or not a number;
/// - where positions before are asked for and the mesh has none (Motion);
/// - when a number of positions is not that of the vertices;
/// - when a transform is not a rigid motion;
/// - when a position in the world is not finite, or much larger than a mesh may have them;
/// - when a pair names a feature that is not there.
namespace adaptive_bvh {

/// How a mesh moves between two frames. Refers to the mesh and to the positions.
template <typename S>
struct Motion {
  using Mesh = DeformableMesh<S>;        ///< what moves
  using Point = fcl::Vector3<S>;         ///< x, y, z in the mesh's frame
  using Transform = fcl::Transform3<S>;  ///< places the mesh in the world

  /// From mesh.previousVertices() to mesh.vertices(), as updateTwoFrames leaves them; from one
  /// transform to another.
  explicit Motion(const Mesh& moving, const Transform& from_tf = Transform::Identity(),
                  const Transform& to_tf = Transform::Identity());
  /// From and to positions of your own, one per vertex in order; the mesh's may be among them.
  Motion(const Mesh& moving, const Point* from, const Point* to, std::size_t count,
         const Transform& from_tf = Transform::Identity(),
         const Transform& to_tf = Transform::Identity());
  /// From vectors.
  Motion(const Mesh& moving, const std::vector<Point>& from, const std::vector<Point>& to,
         const Transform& from_tf = Transform::Identity(),
         const Transform& to_tf = Transform::Identity());
  /// Vectors that end with the statement are refused.
  Motion(const Mesh&, std::vector<Point>&&, const std::vector<Point>&,
         const Transform& = Transform::Identity(),
         const Transform& = Transform::Identity()) = delete;
  Motion(const Mesh&, const std::vector<Point>&, std::vector<Point>&&,
         const Transform& = Transform::Identity(),
         const Transform& = Transform::Identity()) = delete;

  const Mesh* mesh;    ///< its triangles say what the features are
  const Point* start;  ///< positions at t = 0, in the mesh's frame
  const Point* end;    ///< at t = 1
  Transform start_tf;  ///< of the mesh at t = 0
  Transform end_tf;    ///< at t = 1
};

/// Two features that come together.
struct Impact {
  /// The time of what does not happen.
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double time = kNever;  ///< from 0 to 1, or kNever: then the rest means nothing
  FeatureKind kind = FeatureKind::VertexFace;  ///< of the pair
  FeaturePair pair = {0, 0};                   ///< numbers as in FeaturePairs

  /// Whether anything comes together.
  bool happens() const { return time <= 1; }
};

/// A time for each of some pairs: from 0 to 1, or Impact::kNever.
struct ImpactTimes {
  std::vector<double> vertex_face;  ///< of FeaturePairs::vertex_face, in their order
  std::vector<double> face_vertex;  ///< of FeaturePairs::face_vertex
  std::vector<double> edge_edge;    ///< of FeaturePairs::edge_edge
};

/// All pairs of features whose swept boxes (along the axes of the world, around both positions of
/// their vertices) come as near as `separation`, each once; others can not come together. What was
/// in `pairs` is replaced. Boxes are compared in single precision, rounded outward by 1e-6 of the
/// size of the whole motion.
template <typename S>
void candidates(const Motion<S>& first, const Motion<S>& second, double separation,
                FeaturePairs& pairs);
/// Of one mesh with itself.
template <typename S>
void candidates(const Motion<S>& mesh, double separation, FeaturePairs& pairs);

/// When two features come together, or somewhat earlier; Impact::kNever when they do not. 0 when
/// they are together at the start. Reads all positions: of many pairs use timesOfImpact.
template <typename S>
double timeOfImpact(const Motion<S>& first, const Motion<S>& second, FeatureKind kind,
                    const FeaturePair& pair, double separation = 0);
/// Of two features of one mesh, and not FeatureKind::FaceVertex.
template <typename S>
double timeOfImpact(const Motion<S>& mesh, FeatureKind kind, const FeaturePair& pair,
                    double separation = 0);

/// For all of some pairs, in their order. What was in `times` is replaced.
template <typename S>
void timesOfImpact(const Motion<S>& first, const Motion<S>& second, const FeaturePairs& pairs,
                   double separation, ImpactTimes& times);
/// Within one mesh.
template <typename S>
void timesOfImpact(const Motion<S>& mesh, const FeaturePairs& pairs, double separation,
                   ImpactTimes& times);

/// The first two features that come together, and when. Of several at the same time the smallest
/// kind and numbers. Needs no list of candidates, and is faster than to make one.
template <typename S>
Impact earliestImpact(const Motion<S>& first, const Motion<S>& second, double separation = 0);
/// Within one mesh.
template <typename S>
Impact earliestImpact(const Motion<S>& mesh, double separation = 0);

/// With all candidates, as `candidates` lists them: faster than both calls.
template <typename S>
Impact earliestImpact(const Motion<S>& first, const Motion<S>& second, double separation,
                      FeaturePairs& pairs);
/// Within one mesh.
template <typename S>
Impact earliestImpact(const Motion<S>& mesh, double separation, FeaturePairs& pairs);

/// The time up to which nothing comes together: at every earlier time all features are farther
/// apart than `separation`. 1 when that holds for the whole motion. Take somewhat less to keep a
/// distance.
template <typename S>
double largestSafeStep(const Motion<S>& first, const Motion<S>& second, double separation = 0) {
  const double time = earliestImpact(first, second, separation).time;
  return time < 1 ? time : 1;
}
/// Within one mesh.
template <typename S>
double largestSafeStep(const Motion<S>& mesh, double separation = 0) {
  const double time = earliestImpact(mesh, separation).time;
  return time < 1 ? time : 1;
}

/// How far each vertex may move from its start, in any direction and whatever the others do within
/// theirs, so that no features come together: a length in the unit of the world for every vertex,
/// at most that of its own motion (which says how far it wants to go). 0 where features are
/// together at the start. What a solver needs that moves vertices one after the other.
template <typename S>
void safeDisplacements(const Motion<S>& first, const Motion<S>& second, double separation,
                       std::vector<double>& of_first, std::vector<double>& of_second);
/// Within one mesh.
template <typename S>
void safeDisplacements(const Motion<S>& mesh, double separation, std::vector<double>& of_vertices);

}  // namespace adaptive_bvh
