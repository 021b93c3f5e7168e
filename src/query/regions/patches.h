#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "query/regions/crossings.h"

// The parts of two closed surfaces that lie inside the other body, grouped into contact regions.
namespace adaptive_bvh {

/// The part of a triangle inside the other body that belongs to one region. Its area is multiplied
/// by the other body's winding number.
struct SurfacePart {
  WhichBody body;
  unsigned triangle;
  unsigned region;  ///< while building, an element (SurfacePatches); then the region's number
  bool is_cut;      ///< whether the triangle crosses the other surface
  double area;
  double size;           ///< sum of the absolute values of the terms of `area`; bounds its rounding
  fcl::Vector3d normal;  ///< of the triangle, of length 1; zero where it has no area
  fcl::Vector3d origin;  ///< a point of the part
  fcl::Vector3d moment;  ///< integral of the position relative to `origin` over the area

  /// Adds another part of the same triangle.
  void add(const SurfacePart& part) {
    moment += part.moment + (part.origin - origin) * part.area;
    area += part.area;
    size += part.size;
  }
  /// The centroid, or `origin` if the area may be mere rounding.
  fcl::Vector3d centroid() const {
    if (!(std::fabs(area) > 1e-6 * size)) return origin;
    return origin + moment / area;
  }
};

/// A closed polyline of consecutive segments.
struct CrossingCurve {
  std::size_t begin, end;  ///< range of SurfacePatches::curveSegments()
  unsigned region;  ///< while building, an element (SurfacePatches); then the region's number
};

/// The parts of both surfaces that lie inside the other body, the curves around them, and the
/// regions that they form. The elements of a region are the labels of its vertices (SurfaceWinding)
/// and its crossing nodes. Connected elements are in one tree of a forest (union-find), so that
/// each region has one root.
///
/// A part's area follows from its boundary (Green's theorem): the segments on its triangle, and the
/// pieces of the triangle's edges inside the other body, all directed so that the part is to their
/// left. No part is triangulated.
class SurfacePatches {
 public:
  /// The arguments must outlive the queries of this object.
  void build(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
             const std::array<SurfaceWinding, 2>& windings);

  /// Removes everything, for bodies that are apart.
  void clear() {
    parts_.clear();
    curves_.clear();
    num_regions_ = 0;
  }

  /// Parts of the first body, then of the second, each by increasing triangle.
  const std::vector<SurfacePart>& parts() const { return parts_; }
  const std::vector<CrossingCurve>& curves() const { return curves_; }
  /// Indices of SurfaceCrossings::segments(), curve by curve.
  const std::vector<unsigned>& curveSegments() const { return curve_segments_; }
  std::size_t numRegions() const { return num_regions_; }
  /// The region of a vertex inside the other body; kNoRegion for other vertices.
  unsigned regionOf(WhichBody body, unsigned vertex) const;
  /// The region of a point of a triangle inside the other body; kNoRegion for other points.
  unsigned regionAt(WhichBody body, unsigned triangle, const fcl::Vector3d& x);
  static constexpr unsigned kNoRegion = ~0u;

 private:
  /// A piece of a part's boundary, directed so that the part is to its left.
  struct Piece {
    unsigned element;
    int count;  ///< the other body's winding number on an edge; 1 for a segment
    fcl::Vector3d from, to;
  };
  /// The pieces of a triangle that crosses the other surface: a range of pieces_.
  struct CutTriangle {
    WhichBody body;
    unsigned triangle;
    std::size_t begin, end;
  };
  /// A curve that lies in one triangle and goes around a hole of a part of it.
  struct Hole {
    std::size_t curve;  ///< index in curves_
    WhichBody body;
    unsigned triangle;
    double area;  ///< negative
  };
  /// The volume that the parts of one root enclose, and their area, to find cavities.
  struct Enclosed {
    unsigned root;
    double volume, area;
    fcl::Vector3d origin;  ///< a point of a part; volumes are summed relative to it
    // The vertex of a part that is farthest along x, and its body; infinite if there is none.
    fcl::Vector3d farthest = fcl::Vector3d::Constant(-std::numeric_limits<double>::infinity());
    WhichBody body = WhichBody::First;
  };
  /// How often a root's surface winds around a point, or a part of the number.
  struct Winding {
    unsigned root;
    int number;
  };
  /// A line from a point, and two directions across it.
  struct Line {
    fcl::Vector3d from, u, v;
  };

  // Elements: the labels of the first body, those of the second, then the nodes.
  unsigned nodeElement(unsigned node) const { return num_labels_ + node; }
  unsigned labelElement(WhichBody body, unsigned label) const {
    return body == WhichBody::First ? label : first_labels_ + label;
  }
  unsigned rootOf(unsigned element) const;
  void connect(unsigned a, unsigned b);

  void cutTriangles(WhichBody body);
  void addEdges(WhichBody body, unsigned triangle);
  Piece pieceOf(WhichBody body, const CrossingSegment& segment) const;
  void traceCurves();
  void connectHoles();
  void addIfHole(std::size_t curve, WhichBody body, unsigned triangle);
  void connectHole(const Hole& hole);
  static Line lineAcross(const TrianglePoints& triangle, const fcl::Vector3d& x);
  double signedArea(const CrossingCurve& curve, WhichBody body, const fcl::Vector3d& normal) const;
  const CutTriangle* cutTriangle(WhichBody body, unsigned triangle) const;
  void collectParts(WhichBody body);
  void addWhole(WhichBody body, unsigned triangle);
  void addCut(const CutTriangle& cut);
  SurfacePart& partOf(std::size_t first_part, const Piece& piece, const CutTriangle& cut,
                      const fcl::Vector3d& normal);
  void connectCavities();
  void measureRoots();
  double findFarthestVertices();
  void connectCavity(const Enclosed& cavity, double reach);
  bool addWindings(const Enclosed& cavity, WhichBody body, const fcl::Vector3d& along,
                   double reach);
  void addWindings(const Line& line, const CutTriangle& cut);
  void addWinding(const Line& line, const Piece& piece, int times);
  unsigned rootAround(unsigned own);
  void mergeParts();
  void numberRegions();

  const ClosedSurfaces* bodies_ = nullptr;
  const SurfaceCrossings* crossings_ = nullptr;
  const std::array<SurfaceWinding, 2>* windings_ = nullptr;
  unsigned first_labels_ = 0, num_labels_ = 0;
  std::size_t num_regions_ = 0;
  mutable std::vector<unsigned> parents_;  ///< by element: the forest; reading shortens its paths
  std::vector<Piece> pieces_;
  std::vector<CutTriangle> cuts_;  ///< of the first body by triangle, then of the second
  std::vector<unsigned> order_;    ///< segments, sorted by triangle or by start
  std::vector<unsigned> next_;     ///< by node: index in order_ of its first untraced segment
  std::vector<char> is_traced_;    ///< by segment
  std::vector<CrossingCurve> curves_;
  std::vector<unsigned> curve_segments_;
  std::vector<SurfacePart> parts_;
  std::vector<Hole> holes_;
  std::vector<Enclosed> enclosed_;
  std::vector<Winding> around_;       ///< of surfaces around a point
  std::vector<unsigned> candidates_;  ///< triangles that a line may meet
  /// By root: an index of enclosed_ in connectCavities; then of keys_, at last the region's number.
  std::vector<unsigned> numbers_;
  std::vector<std::size_t> last_part_;  ///< by root or region: its last part
  /// Sort key of a region: its smallest triangles, its first curve, and its root.
  struct RegionKey {
    unsigned first, second, curve, root;
  };
  std::vector<RegionKey> keys_;
};

}  // namespace adaptive_bvh
