#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

/// Data for clearance checks, made with Eigen alone: nothing here uses adaptive_bvh.
namespace harness {

using Point = Eigen::Vector3d;
using Points = std::vector<Point>;

/// Triangles in millimetres, counter-clockwise seen from outside.
struct Surface {
  Points vertices;
  std::vector<std::array<unsigned, 3>> triangles;

  /// Adds another closed surface. Surfaces may overlap.
  Surface& add(const Surface& other);
  Surface moved(const Eigen::Isometry3d& tf) const;
};

/// Closed surface through rings of equally many points. Rings are counter-clockwise seen from the
/// last one. Ends are closed by fans, or joined if `loop`.
Surface skin(const std::vector<Points>& rings, bool loop = false);

/// A smooth curve through the points (centripetal Catmull-Rom), cut into pieces of about `step`,
/// equally long along the curve.
Points smoothCurve(const Points& through, double step);

/// Directions of a curve at its points.
Points tangents(const Points& curve, bool loop = false);

/// The shortest turn from one direction to another, of unit length. (Eigen's FromTwoVectors brings
/// a singular value decomposition, which takes ten seconds to compile.)
Eigen::Quaterniond shortestTurn(const Point& from, const Point& to);

/// A normal at each point of a curve, turned as little as possible from one to the next.
Points transportedNormals(const Points& directions, const Point& first);

}  // namespace harness
