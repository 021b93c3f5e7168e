#pragma once

#include <utility>
#include <vector>

#include "deformable/mesh_state.h"
#include "query/tree_pair.h"
#include "triangles/shifted_orientation.h"

namespace adaptive_bvh {

/// A closed mesh, its vertices in the frame of the first of a pair.
struct ClosedSurface {
  const MeshTopology* topology = nullptr;
  std::vector<fcl::Vector3d> points;

  unsigned numTriangles() const { return static_cast<unsigned>(topology->triangles.size()); }
  VertexIndices corners(unsigned triangle) const {
    MeshView<double> view;
    view.triangles = topology->triangles.data();
    return view.verticesOf(triangle);
  }
  TrianglePoints<double> triangle(unsigned triangle) const {
    const VertexIndices v = corners(triangle);
    return {points[v[0]], points[v[1]], points[v[2]]};
  }
};

/// Both bodies of a query, by Operand.
using ClosedSurfaces = std::array<ClosedSurface, 2>;
constexpr std::size_t indexOf(Operand body) { return static_cast<std::size_t>(body); }
constexpr Operand otherOf(Operand body) {
  return body == Operand::First ? Operand::Second : Operand::First;
}

/// Where an edge of one body crosses a triangle of the other.
struct CrossingNode {
  Operand body;        ///< the edge's
  unsigned low, high;  ///< the edge's vertices, the smaller index first
  unsigned face;       ///< the other's triangle
  int sign;            ///< 1 where the way from `low` to `high` enters the other body, -1 leaves it
  double t;            ///< the point is low + t (high - low)
  fcl::Vector3d position;
};

/// Where two triangles cross, from one node to another: seen from outside of the first, its part
/// inside the second is to the left.
struct CrossingSegment {
  unsigned first, second;  ///< triangles
  unsigned start, end;     ///< nodes
};

/// All crossings of two surfaces. As many segments start at a node as end there.
class SurfaceCrossings {
 public:
  /// Some nodes that follow each other.
  struct Range {
    unsigned begin, end;

    bool isEmpty() const { return begin == end; }
  };

  /// `pairs`: of triangles that may cross; sorted here.
  void build(const ClosedSurfaces& bodies, std::vector<TrianglePair>& pairs);

  /// By edge, then along it from `low` to `high`.
  const std::vector<CrossingNode>& nodes() const { return nodes_; }
  /// By triangle of the first, then of the second.
  const std::vector<CrossingSegment>& segments() const { return segments_; }
  /// The nodes of each edge that has some.
  const std::vector<Range>& edges() const { return edges_; }
  /// The nodes of an edge.
  Range along(Operand body, unsigned from, unsigned to) const;

 private:
  /// A node, as the end of a segment.
  struct SegmentEnd {
    CrossingNode node;
    unsigned place;  ///< twice the segment's number, and 1 more at its end
  };

  void testPair(const ClosedSurfaces& bodies, const TrianglePair& pair);
  void testEdges(const ClosedSurface& surface, Operand body, const TrianglePair& pair,
                 const TrianglePoints<double>& edges, const TrianglePoints<double>& face,
                 const std::array<FaceSide, 3>& sides);
  void keepIfWhole(std::size_t first_end, const TrianglePair& pair);
  void collectNodes();
  void collectEdges();

  std::vector<SegmentEnd> ends_;
  std::vector<CrossingNode> nodes_;
  std::vector<CrossingSegment> segments_;
  std::vector<Range> edges_;
};

}  // namespace adaptive_bvh
