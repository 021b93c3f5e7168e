#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"

/// \file
/// Continuous collision: which features come together between two frames, and when.
///
/// Every vertex moves on a straight line in the world, at constant speed, from its position at the
/// start (t = 0) to that at the end (t = 1). Edges and faces are those between their vertices at
/// each time. A changing transform moves each vertex on a straight line, too, so a rotating body
/// shrinks a little in between.
///
/// Two features, a vertex and a face or two edges, *come together* when their distance is the
/// minimal distance or less. With a distance of 0 that is contact. Surfaces that do not
/// intersect at the start can only intersect after two features have come together. (Use `collide`
/// and `selfCollide` to test the start; a vertex that is already inside a closed body is not
/// found.) Within one mesh, pairs of features that share a vertex are left out. Vertices without a
/// triangle are ignored.
///
/// Answers are conservative: no pair that comes together is missing, and no time is later than the
/// exact one, despite rounding (docs/bounds.md, 15). Times may be early, and a pair that passes at
/// a tiny distance may be reported: early by the time in which the features approach by about 1e-14
/// of the size of the pair, or up to 1e-9 of it if edges are nearly parallel or a face is nearly a
/// segment. Lengths below 1e-150 count as none: so smaller bodies come together early.
///
/// All functions are thread-safe on shared meshes, and run on several threads if
/// DeformableMesh::setThreads allows it; the results and their order do not depend on that.
/// They search swept boxes, which are made for the call. The thread and the results keep all
/// memory, so a steady step allocates nothing on one thread.
///
/// Throws std::invalid_argument
/// - if a motion is that of a shape, or its path is a screw (motion_clearance.h takes these);
/// - if a distance is negative, infinite or not a number;
/// - if previous positions are needed and the mesh has none (Motion);
/// - if the number of positions is not that of the vertices;
/// - if a transform is not a rigid motion;
/// - if a position in the world is not finite, or much larger than a mesh allows;
/// - if a pair names a feature that does not exist.
namespace adaptive_bvh {

/// How the frame of a body goes from one transform to another.
enum class FramePath {
  Straight,  ///< each point on a straight line in the world: a body that turns shrinks in between
  /// Turning about an axis by at most half a turn, and moving along the axis. The rotation is the
  /// one nearest to the rotation between both transforms; rounding decides the direction of half a
  /// turn.
  Screw,
};

/// Motion of a mesh or a shape from t = 0 to 1. Refers to the body, and to positions that are given
/// as vectors or pointers; these must outlive it. The functions of this file take meshes on
/// straight paths; those of motion_clearance.h take all motions.
struct Motion {
  using Mesh = DeformableMesh;                          ///< a mesh that moves
  using Geometry = fcl::CollisionGeometryd;             ///< a mesh, or a shape of FCL's
  using Point = fcl::Vector3d;                          ///< x, y, z in the mesh's frame
  using Transform = fcl::Transform3d;                   ///< places the body in the world
  using Positions = std::array<std::vector<Point>, 2>;  ///< at the start and at the end

  /// From mesh.previousVertices() to mesh.vertices(), as updateTwoFrames leaves them; from one
  /// transform to another.
  explicit Motion(const Mesh& moving, const Transform& from_tf = Transform::Identity(),
                  const Transform& to_tf = Transform::Identity(),
                  FramePath frame_path = FramePath::Straight);
  /// Between positions of the caller, one per vertex in order; they may be the mesh's own arrays.
  Motion(const Mesh& moving, const Point* from, const Point* to, std::size_t count,
         const Transform& from_tf = Transform::Identity(),
         const Transform& to_tf = Transform::Identity(),
         FramePath frame_path = FramePath::Straight);
  /// From vectors.
  Motion(const Mesh& moving, const std::vector<Point>& from, const std::vector<Point>& to,
         const Transform& from_tf = Transform::Identity(),
         const Transform& to_tf = Transform::Identity(),
         FramePath frame_path = FramePath::Straight);
  /// From matrices with a vertex a row or a column (PointArray): copies them.
  template <typename From, typename To>
  Motion(const Mesh& moving, const Eigen::MatrixBase<From>& from, const Eigen::MatrixBase<To>& to,
         const Transform& from_tf = Transform::Identity(),
         const Transform& to_tf = Transform::Identity(), FramePath frame_path = FramePath::Straight)
      : Motion(moving,
               std::make_shared<const Positions>(
                   Positions{detail::pointsOf(from), detail::pointsOf(to)}),
               from_tf, to_tf, frame_path) {}
  /// Between positions at the start and at the end that this motion and its copies keep.
  Motion(const Mesh& moving, std::shared_ptr<const Positions> from_and_to,
         const Transform& from_tf = Transform::Identity(),
         const Transform& to_tf = Transform::Identity(),
         FramePath frame_path = FramePath::Straight);
  /// Deleted: temporary vectors would be destroyed before the query.
  Motion(const Mesh&, std::vector<Point>&&, const std::vector<Point>&,
         const Transform& = Transform::Identity(), const Transform& = Transform::Identity(),
         FramePath = FramePath::Straight) = delete;
  Motion(const Mesh&, const std::vector<Point>&, std::vector<Point>&&,
         const Transform& = Transform::Identity(), const Transform& = Transform::Identity(),
         FramePath = FramePath::Straight) = delete;
  /// A body that keeps its shape: a shape, or a mesh with the positions that it has when a query
  /// reads them.
  static Motion rigid(const Geometry& body, const Transform& from_tf = Transform::Identity(),
                      const Transform& to_tf = Transform::Identity(),
                      FramePath frame_path = FramePath::Straight);

  const Geometry* geometry;               ///< the body
  const Mesh* mesh;                       ///< the body if it is a mesh; else null
  const Point* start = nullptr;           ///< positions at t = 0; null for the mesh's present ones
  const Point* end = nullptr;             ///< positions at t = 1; null for the mesh's present ones
  Transform start_tf;                     ///< of the body at t = 0
  Transform end_tf;                       ///< of the body at t = 1
  FramePath path;                         ///< between both
  std::shared_ptr<const Positions> kept;  ///< positions that this motion owns; else null

 private:
  Motion(const Geometry& body, const Mesh* as_mesh, const Transform& from_tf,
         const Transform& to_tf, FramePath frame_path)
      : geometry(&body), mesh(as_mesh), start_tf(from_tf), end_tf(to_tf), path(frame_path) {}
};

/// Two features that come together.
struct Impact {
  /// No impact.
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double time = kNever;  ///< from 0 to 1, or kNever; then the other members have no meaning
  FeatureKind kind = FeatureKind::VertexFace;  ///< of the pair
  FeaturePair pair = {0, 0};                   ///< numbers as in FeaturePairs

  /// Whether anything comes together.
  bool exists() const { return time <= 1; }
};

/// Times of impact of pairs of features: from 0 to 1, or Impact::kNever.
struct ImpactTimes {
  std::vector<double> vertex_face;  ///< of FeaturePairs::vertex_face, in their order
  std::vector<double> face_vertex;  ///< of FeaturePairs::face_vertex
  std::vector<double> edge_edge;    ///< of FeaturePairs::edge_edge
};

/// Finds all pairs of features whose swept boxes are at most `distance` apart, each once; no
/// other pair can come together. Swept boxes are along the axes of the world, around both positions
/// of the vertices. `pairs` is overwritten. Boxes are compared in single precision, rounded outward
/// by 1e-6 of the size of the whole motion.
void candidates(const Motion& first, const Motion& second, double distance, FeaturePairs& pairs);
/// Finds the candidates of one mesh with itself.
void selfCandidates(const Motion& mesh, double distance, FeaturePairs& pairs);

/// Returns the time at which two features come together, or a slightly earlier one; Impact::kNever
/// if they do not, 0 if they are together at the start. Reads all positions: use timesOfImpact for
/// many pairs.
double timeOfImpact(const Motion& first, const Motion& second, FeatureKind kind,
                    const FeaturePair& pair, double distance = 0);
/// Returns the time of impact of two features of one mesh. `kind` is not FeatureKind::FaceVertex.
double selfTimeOfImpact(const Motion& mesh, FeatureKind kind, const FeaturePair& pair,
                        double distance = 0);

/// Computes the times of impact of all `pairs`, in their order. `times` is overwritten.
void timesOfImpact(const Motion& first, const Motion& second, const FeaturePairs& pairs,
                   double distance, ImpactTimes& times);
/// Within one mesh.
void selfTimesOfImpact(const Motion& mesh, const FeaturePairs& pairs, double distance,
                       ImpactTimes& times);

/// Returns the first two features that come together, and the time; of several at the same time the
/// one with the smallest kind and numbers. Makes no list of candidates, which would take longer.
Impact earliestImpact(const Motion& first, const Motion& second, double distance = 0);
/// Within one mesh.
Impact selfEarliestImpact(const Motion& mesh, double distance = 0);

/// Returns the earliest impact and also finds all candidates. Faster than two calls.
Impact earliestImpact(const Motion& first, const Motion& second, double distance,
                      FeaturePairs& pairs);
/// Within one mesh.
Impact selfEarliestImpact(const Motion& mesh, double distance, FeaturePairs& pairs);

/// Returns the largest time, at most 1, such that at every earlier time all features are farther
/// apart than `distance`. Use a slightly smaller step to keep a distance.
inline double largestSafeStep(const Motion& first, const Motion& second, double distance = 0) {
  const double time = earliestImpact(first, second, distance).time;
  return time < 1 ? time : 1;
}
/// Within one mesh.
inline double selfLargestSafeStep(const Motion& mesh, double distance = 0) {
  const double time = selfEarliestImpact(mesh, distance).time;
  return time < 1 ? time : 1;
}

/// Computes for each vertex how far it may move from its start, in any direction, so that no
/// features come together while all vertices keep within their bounds. Each bound is a length in
/// the unit of the world, at most that of the vertex's motion, also if nothing is near; 0 if its
/// features are together at the start. Suitable for solvers that move vertices one after the other:
///
///     const double length = (wanted[v] - start[v]).norm();  // of the world's unit
///     if (length > bound[v]) wanted[v] = start[v] + bound[v] / length * (wanted[v] - start[v]);
///
/// A proposal that is longer than the motion that was passed needs a new call: pass the longest
/// that is of interest.
void safeDisplacements(const Motion& first, const Motion& second, double distance,
                       std::vector<double>& of_first, std::vector<double>& of_second);
/// Within one mesh.
void selfSafeDisplacements(const Motion& mesh, double distance, std::vector<double>& of_vertices);

/// Computes for each vertex the share of its way, from 0 to 1, that is proven safe: while every
/// vertex is between start and start + share * (end - start), no features come together, in
/// whatever order and at whatever speed the vertices move. A fixed plane between each two near
/// features, which no vertex of either crosses, proves it (planar truncation). Keeps much more of a
/// motion than one step for all, and than safeDisplacements: vertices that slide or move apart keep
/// their whole way. 1 for vertices that do not move or have no triangle.
///
/// Features that are at most `distance` apart at the start come no nearer (than 1 - 1e-9 of their
/// distance). Features that touch there, up to rounding, do not move at all: begin with a surface
/// that does not intersect itself. Planes do not move, so features that move together, one behind
/// the other, go no farther than there is room between them: suitable for motions of up to about an
/// edge.
///
/// A vertex may go less far than it could although nothing is near its way. Its plane is one of six
/// that separate the features where they start, not any that separates their ways; and it divides
/// the ways that both features had when their pair was found, although another pair may shorten one
/// of them later. A search among all planes keeps more (0.990 instead of 0.987 of a step of a
/// cloth, 0.31 instead of 0.12 of one whose ways are many edges long), but takes up to five times
/// as long. Call again from the positions reached to go on.
///
/// The proof includes the rounding of positions that are computed as start + share * (end - start)
/// in S, in the mesh's frame or in the world, also if the share is rounded to S
/// (docs/bounds.md, 15). The result depends on the order in which pairs are found, so the search
/// runs on one thread; equal calls return equal shares.
///
/// Source: planar truncation for penetration-free simulation (2026).
void truncateMotion(const Motion& first, const Motion& second, double distance,
                    std::vector<double>& shares_of_first, std::vector<double>& shares_of_second);
/// Within one mesh.
void selfTruncateMotion(const Motion& mesh, double distance, std::vector<double>& shares);

}  // namespace adaptive_bvh
