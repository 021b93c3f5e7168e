#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/surface_neighbourhood.h"

/// \file
/// Clearance over a whole motion: how near two moving bodies come between t = 0 and t = 1, when and
/// where; the times at which they are nearer than a distance; the same of one mesh with itself.
///
///     using adaptive_bvh::Motion;
///     const auto least = adaptive_bvh::leastDistance(Motion(hose, before, after), Motion(part,
///     ...),
///                                                   1e-5);
///     if (least.lower < 5e-3) std::cout << "at t = " << least.time;
///
/// **Motions.** Vertices of a mesh move on straight lines in the world, as in
/// continuous_collision.h. So do the points of a shape; of a plane or half-space, the normal and
/// the offset change evenly. With FramePath::Screw the frame of a body turns at a constant rate
/// about an axis, and moves along it at a constant speed: bodies that turn keep their shape.
/// Vertices may move in that frame, too, on straight lines. Motion::rigid is the motion of a shape,
/// or of a mesh that keeps its shape.
///
/// **Answers** are bounds that hold for every time from 0 to 1, not for a sample of times, despite
/// rounding (docs/bounds.md, 22). The lower and the upper bound differ by at most the tolerance.
/// Whether two parts meet is decided for the corners as rounded to double precision. Surfaces are
/// compared: a mesh inside of another one is not found; shapes are filled.
///
/// **Cost.** A walk over both trees that finds the pairs of triangles which may be nearest at some
/// time; a pair is then followed in time, along planes between its parts. Boxes are made where the
/// walk reads them. The step of `updateTwoFrames` needs no other preparation, nor do meshes that do
/// not deform; positions of the caller, and screws, are read once for bounds. If bodies are about
/// as near everywhere (a shaft that turns in its sleeve), a hundredth of the tolerance costs ten
/// times as much: two tubes of 20,000 triangles, 2 long and 0.03 apart, take 3.3 s of a processor
/// with a tolerance of 1e-4, and 0.3 s if they stand still.
///
/// **Units and frames.** Lengths and points are in the world.
///
/// **Errors.** std::invalid_argument like continuous_collision.h; if a tolerance is not above 1e-12
/// of the coordinates of the bodies, or not finite; if a distance is negative or not finite, or a
/// limit negative or NaN; if a geometry is neither a DeformableMesh nor a shape; if both are planes
/// or half-spaces.
///
/// **Threads.** Thread-safe on shared meshes. A query runs on the calling thread.
namespace adaptive_bvh {

/// The least distance of two bodies over a motion.
struct MotionClearance {
  /// The bodies are at least so far apart at all times. 0 if they meet.
  double lower = std::numeric_limits<double>::infinity();
  /// At `time` they are at most so far apart. 0 if they meet; infinite if there is no pair of
  /// parts, or none within the limit.
  double upper = std::numeric_limits<double>::infinity();
  /// When that is. If they meet, the time of the first impact: before it they are apart; at it they
  /// meet, or are nearer than 1e-10 of their coordinates (1e-7 for shapes).
  double time = 0;
  /// The triangles that are so near: of the first body and of the second; -1 for a shape. In a
  /// scene, for an octree the number of the cell.
  std::array<int, 2> elements = {-1, -1};
  /// Nearest points of these at `time`.
  std::array<fcl::Vector3d, 2> points = {
      fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()),
      fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};
  std::size_t box_tests = 0;   ///< work: pairs of nodes that were compared
  std::size_t pair_times = 0;  ///< work: distances of two parts at one time

  /// Whether the bodies meet.
  bool meet() const { return upper == 0; }
  /// Whether there is a pair of parts, within the limit.
  bool exists() const { return upper < std::numeric_limits<double>::infinity(); }
};

/// Part of a motion.
struct MotionInterval {
  double begin;  ///< from 0 to 1
  double end;    ///< not before `begin`
};

/// Returns the least distance of two bodies over their motions. If they are at least `limit` apart
/// at all times, that is all that the search finds out: `lower` is the limit, and `upper` infinite.
/// A limit saves time where a distance is known already.
MotionClearance leastDistance(const Motion& first, const Motion& second, double tolerance,
                              double limit = std::numeric_limits<double>::infinity());

/// Finds the times at which two bodies are nearer than `distance`: disjoint intervals in order.
/// Outside of them the bodies are at least `distance` apart. At every time inside they are at most
/// `distance` + `tolerance` apart. With a distance of 0 these are the times of contact, which are
/// all inside. `intervals` is overwritten.
void intervalsBelow(const Motion& first, const Motion& second, double distance, double tolerance,
                    std::vector<MotionInterval>& intervals);

/// Returns the least distance of a mesh to itself over its motion: of all pairs of triangles
/// without a common vertex that are not ignored. `ignored.neighbours` is SharedVertex.
/// `ignored.surface` mostly is needed: triangles with one triangle between them are near.
MotionClearance selfLeastDistance(const Motion& mesh, const Ignored& ignored, double tolerance);
/// Of a mesh at its present positions, in its own frame.
inline MotionClearance selfLeastDistance(const DeformableMesh& mesh, const Ignored& ignored,
                                         double tolerance) {
  return selfLeastDistance(Motion::rigid(mesh), ignored, tolerance);
}

/// Finds the times at which a mesh is nearer to itself than `distance`, as for two bodies.
void selfIntervalsBelow(const Motion& mesh, const Ignored& ignored, double distance,
                        double tolerance, std::vector<MotionInterval>& intervals);

}  // namespace adaptive_bvh
