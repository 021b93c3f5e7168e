#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "deformable/mesh_state.h"
#include "query/points/ray_search.h"
#include "query/tree_pair.h"
#include "triangles/orientation.h"
#include "triangles/triangle_contact.h"

// Exact crossings of two closed surfaces, and winding numbers of their vertices.
namespace adaptive_bvh {

/// One of two bodies, as the owner of a point, an edge or a face.
enum class WhichBody : unsigned { First = 0, Second = 1 };

namespace orientations {

/// The sign of component k of (b - a) x (d - c), without any error.
inline int crossSign(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                     const fcl::Vector3d& d, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const double bi = b[i] - a[i], bj = b[j] - a[j], di = d[i] - c[i], dj = d[j] - c[j];
  if ((bi == 0 || dj == 0) && (bj == 0 || di == 0)) return 0;  // frequent for edges along axes
  const double left = bi * dj, right = bj * di;
  const double value = left - right, size = std::fabs(left) + std::fabs(right);
  if (size > 0x1p-900 && size < 0x1p1000 && std::fabs(value) > 0x1p-50 * size)
    return value > 0 ? 1 : -1;
  ExactSum sum;
  for (const auto& p : {std::make_pair(&b, false), std::make_pair(&a, true)})
    for (const auto& q : {std::make_pair(&d, false), std::make_pair(&c, true)}) {
      const bool is_negative = p.second != q.second;
      is_negative ? sum.subtract((*p.first)[i], (*q.first)[j], 1)
                  : sum.add((*p.first)[i], (*q.first)[j], 1);
      is_negative ? sum.add((*p.first)[j], (*q.first)[i], 1)
                  : sum.subtract((*p.first)[j], (*q.first)[i], 1);
    }
  return sum.sign();
}

}  // namespace orientations

/// Returns the sign of an orientation. A zero orientation gets the sign that it has after an
/// infinitely small motion of the first body along x or, if that changes nothing, along y, or z.
/// This one rule breaks all ties. As a real motion would have the same effect, the decisions never
/// contradict each other. (Simulation of simplicity: Edelsbrunner and Muecke 1990, here by a common
/// shift.) The caller passes the derivative of the orientation by the motion: (b - a) x (d - c), or
/// its opposite if `is_opposite`.
inline int brokenTie(double orientation, const fcl::Vector3d& a, const fcl::Vector3d& b,
                     const fcl::Vector3d& c, const fcl::Vector3d& d, bool is_opposite) {
  if (orientation != 0) return orientation > 0 ? 1 : -1;
  for (int k = 0; k < 3; ++k)
    if (const int sign = orientations::crossSign(a, b, c, d, k)) return is_opposite ? -sign : sign;
  return 0;
}

/// Where a point of one body lies relative to a face of the other.
struct FaceSide {
  double value;  ///< its orientation, which may be 0
  int sign;      ///< 1 behind the face, -1 in front of it; 0 only for a face without area
};
/// Returns the side of a point. `body`: to which the point belongs; the face is the other's.
inline FaceSide sideOfFace(const TrianglePoints& face, const fcl::Vector3d& point, WhichBody body) {
  const double value = orientation(face[0], face[1], face[2], point);
  return {value, brokenTie(value, face[0], face[1], face[0], face[2], body == WhichBody::First)};
}

/// Returns the side, 1 or -1, on which the edge pq passes the line through the other body's edge
/// ab; 0 only if they are parallel. `body`: to which pq belongs.
inline int passingSide(const fcl::Vector3d& p, const fcl::Vector3d& q, const fcl::Vector3d& a,
                       const fcl::Vector3d& b, WhichBody body) {
  // A shift of p and q changes the determinant by the shift times (q - p) x (a - b).
  return brokenTie(orientation(p, q, a, b), p, q, b, a, body == WhichBody::Second);
}

/// Whether an edge that crosses the plane of the other body's face crosses the face: it passes all
/// its sides on the same side. `body`: to which the edge belongs.
inline bool passesWithin(const fcl::Vector3d& p, const fcl::Vector3d& q, const TrianglePoints& face,
                         WhichBody body) {
  const int side = passingSide(p, q, face[0], face[1], body);
  return side == passingSide(p, q, face[1], face[2], body) &&
         side == passingSide(p, q, face[2], face[0], body);
}

/// Returns 1 if an edge leaves the other body through one of its faces, -1 if it enters it, 0 if it
/// does not cross the face. `body`: to which the edge belongs.
inline int passageThrough(const TrianglePoints& face, const fcl::Vector3d& p,
                          const fcl::Vector3d& q, WhichBody body) {
  const int at_p = sideOfFace(face, p, body).sign, at_q = sideOfFace(face, q, body).sign;
  return at_p * at_q < 0 && passesWithin(p, q, face, body) ? at_p : 0;
}

/// Whether points are nearer than `limit` to a face's plane; false for a face without area.
bool areNear(const TrianglePoints& points, const TrianglePoints& face, double limit);

/// Finds the triangles of a mesh that a ray may meet, by its tree.
class MeshRays {
 public:
  /// `to_first`: maps points of the mesh to the first body's frame. Rays are in that frame,
  /// multiplied by `scale`. `rounding`: error of points in that frame, before the multiplication.
  MeshRays(const MeshState& mesh, const RelativePlacement& to_first, double scale, double rounding)
      : to_first_(to_first),
        to_mesh_(to_first.R.inverse()),
        scale_(scale),
        rounding_(rounding),
        rays_(mesh) {}

  /// Appends their indices to `triangles`.
  void find(const fcl::Vector3d& origin, const fcl::Vector3d& direction,
            std::vector<unsigned>& triangles) {
    rays_.forEachNear(to_mesh_ * (origin * (1 / scale_) - to_first_.T), to_mesh_ * direction,
                      rounding_, [&](int t) { triangles.push_back(static_cast<unsigned>(t)); });
  }

 private:
  const RelativePlacement to_first_;
  const fcl::Matrix3d to_mesh_;  ///< rotation
  const double scale_, rounding_;
  RayWalk rays_;
};

/// A closed mesh, with its vertices in the frame of the first body, multiplied by a power of two
/// where products of coordinates would underflow.
struct ClosedSurface {
  const MeshTopology* topology = nullptr;
  MeshRays* rays = nullptr;           ///< of this mesh
  std::vector<fcl::Vector3d> points;  ///< by vertex
  bool faces_inward = false;          ///< whether the mesh's triangles do; those below never do

  unsigned numTriangles() const { return static_cast<unsigned>(topology->triangles.size()); }
  VertexIndices corners(unsigned triangle) const {
    MeshView<double> view;
    view.triangles = topology->triangles.data();
    const VertexIndices v = view.verticesOf(triangle);
    return faces_inward ? VertexIndices{v[0], v[2], v[1]} : v;
  }
  TrianglePoints triangle(unsigned triangle) const {
    const VertexIndices v = corners(triangle);
    return {points[v[0]], points[v[1]], points[v[2]]};
  }
};

/// Both bodies of a query, by WhichBody.
using ClosedSurfaces = std::array<ClosedSurface, 2>;
constexpr std::size_t indexOf(WhichBody body) { return static_cast<std::size_t>(body); }
constexpr WhichBody otherOf(WhichBody body) {
  return body == WhichBody::First ? WhichBody::Second : WhichBody::First;
}

/// Where an edge of one body crosses a triangle of the other.
struct CrossingNode {
  WhichBody body;      ///< to which the edge belongs
  unsigned low, high;  ///< the edge's vertices, the smaller index first
  unsigned face;       ///< triangle of the other body
  int sign;  ///< 1 if the edge from `low` to `high` enters the other body here, -1 if it leaves it
  double t;  ///< the point is low + t (high - low)
  fcl::Vector3d position;
};

/// The segment in which two triangles cross, from one node to another. Seen from outside of the
/// first body, the part of its surface inside the second body is to the left.
struct CrossingSegment {
  unsigned first, second;  ///< triangle of each body
  unsigned start, end;     ///< indices of nodes
};

/// Two triangles in one plane, up to rounding.
struct CoplanarPair {
  unsigned first, second;  ///< triangle of each body
  /// On which sides of the second the corners of the first lie: sideOfFace.
  std::array<FaceSide, 3> sides;
};

/// All crossings of two surfaces. As many segments start at a node as end there.
class SurfaceCrossings {
 public:
  /// A range of consecutive nodes.
  struct Range {
    unsigned begin, end;

    bool isEmpty() const { return begin == end; }
  };

  /// `pairs`: triangles that may cross; sorted here. `rounding`: largest distance from a plane at
  /// which a point counts as lying in it, for coplanar().
  void build(const ClosedSurfaces& bodies, std::vector<TrianglePair>& pairs, double rounding);

  /// Sorted by edge, then along it from `low` to `high`.
  const std::vector<CrossingNode>& nodes() const { return nodes_; }
  /// Sorted by triangle of the first body, then of the second.
  const std::vector<CrossingSegment>& segments() const { return segments_; }
  /// The nodes of each edge that has some.
  const std::vector<Range>& edges() const { return edges_; }
  /// Pairs of triangles in one plane, whether they cross or not.
  const std::vector<CoplanarPair>& coplanar() const { return coplanar_; }
  double rounding() const { return rounding_; }
  /// The nodes of an edge, in the order of nodes() even if `from` exceeds `to`; may be empty.
  Range nodesOfEdge(WhichBody body, unsigned from, unsigned to) const;

 private:
  /// A node, as the end of a segment.
  struct SegmentEnd {
    CrossingNode node;
    unsigned end_number;  ///< twice the segment's number, plus 1 for its end
  };

  void testPair(const ClosedSurfaces& bodies, const TrianglePair& pair);
  void keepIfCoplanar(const TrianglePair& pair, const TrianglePoints& p, const TrianglePoints& q,
                      const std::array<FaceSide, 3>& sides);
  void testEdges(const ClosedSurface& surface, WhichBody body, const TrianglePair& pair,
                 const TrianglePoints& edges, const TrianglePoints& face,
                 const std::array<FaceSide, 3>& sides);
  void keepIfWhole(std::size_t first_end, const TrianglePair& pair);
  void collectNodes();
  void collectEdges();

  double rounding_ = 0;
  std::vector<SegmentEnd> ends_;  ///< of all segments; a node occurs once for each of its segments
  std::vector<CrossingNode> nodes_;
  std::vector<CrossingSegment> segments_;
  std::vector<Range> edges_;
  std::vector<CoplanarPair> coplanar_;
};

/// The winding number of one body's surface at each vertex of the other body. Vertices connected by
/// edges without crossings have the same label and number. Along an edge with crossings, the number
/// changes by the signs of its nodes. So one ray for each connected set of labels is enough.
class SurfaceWinding {
 public:
  static constexpr unsigned kNoLabel = ~0u;  ///< for vertices without triangles

  /// Labels the vertices of `body` and computes the other body's winding number for each label.
  void build(const ClosedSurfaces& bodies, WhichBody body, const SurfaceCrossings& crossings);

  unsigned numLabels() const { return static_cast<unsigned>(numbers_.size()); }
  unsigned label(unsigned vertex) const { return labels_[vertex]; }
  /// The winding number of all vertices with a label.
  int numberOf(unsigned label) const { return numbers_[label]; }

 private:
  void labelVertices(const ClosedSurface& surface, WhichBody body,
                     const SurfaceCrossings& crossings);
  void flood(unsigned from, const ClosedSurface& surface, WhichBody body,
             const SurfaceCrossings& crossings);
  void connectLabels(WhichBody body, const SurfaceCrossings& crossings);
  void setNumbers(const ClosedSurfaces& bodies, WhichBody body);
  int countAround(const fcl::Vector3d& point, WhichBody body, const ClosedSurface& other,
                  const fcl::AABBd& box);
  unsigned rootOf(unsigned label);

  std::vector<unsigned> labels_;          ///< by vertex
  std::vector<std::uint8_t> has_cuts_;    ///< by vertex: whether an edge of it has crossings
  std::vector<unsigned> stack_;           ///< vertices still to visit
  std::vector<unsigned> first_vertices_;  ///< by label
  std::vector<unsigned> parents_;         ///< by label: a forest of connected labels
  std::vector<int> offsets_;              ///< by label: its number less that of its parent
  std::vector<int> numbers_;              ///< by label
  std::vector<std::uint8_t> is_known_;    ///< by label, for roots: whether its number is set
  std::vector<unsigned> candidates_;      ///< triangles that a ray may meet
};

}  // namespace adaptive_bvh
