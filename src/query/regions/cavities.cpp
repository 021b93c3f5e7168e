// The part of SurfacePatches that decides which region has a cavity, and which part of a triangle
// has a hole: a region may have several closed boundaries, an outer one and one for each cavity.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "query/regions/patches.h"

namespace adaptive_bvh {

/// Connects each cavity, whose surface encloses a negative volume, with the region that has a
/// vertex of the cavity inside: the region whose surface winds around it. This is decided exactly,
/// but for the place on triangles that cross the other body. Cavities that extend farther along
/// x come first. So a cavity around this one is connected already with the region around it, and
/// both together wind around this one 0 times.
///
/// The farthest point of a cavity is a vertex of a body: where surfaces cross, it has a dent.
void SurfacePatches::connectCavities() {
  // Smaller volumes, relative to the area to the power of 1.5, may be negative but for rounding.
  constexpr double kFlat = 1e-9;
  measureRoots();
  const auto is_body = [&](const Enclosed& e) -> bool {
    return e.volume > kFlat * e.area * std::sqrt(e.area);
  };
  if (std::all_of(enclosed_.begin(), enclosed_.end(), is_body)) return;
  const double reach = findFarthestVertices();
  enclosed_.erase(std::remove_if(enclosed_.begin(), enclosed_.end(), is_body), enclosed_.end());
  std::sort(enclosed_.begin(), enclosed_.end(), [](const Enclosed& a, const Enclosed& b) {
    return std::make_tuple(-a.farthest[0], a.body, a.root) <
           std::make_tuple(-b.farthest[0], b.body, b.root);
  });
  for (const Enclosed& cavity : enclosed_)
    if (std::isfinite(cavity.farthest[0])) connectCavity(cavity, reach);
}

/// Computes the volume and the area of the parts of each root.
void SurfacePatches::measureRoots() {
  enclosed_.clear();
  numbers_.assign(parents_.size(), kNoRegion);
  for (const SurfacePart& part : parts_) {
    unsigned& index = numbers_[rootOf(part.region)];  // in enclosed_
    if (index == kNoRegion) {
      index = static_cast<unsigned>(enclosed_.size());
      enclosed_.push_back({rootOf(part.region), 0, 0, part.origin});
    }
    Enclosed& e = enclosed_[index];
    e.volume += (part.origin - e.origin).dot(part.normal) * part.area / 3;
    e.area += std::fabs(part.area);
  }
}

/// Finds the vertex of each root that is farthest along x; of two at one place the first body's,
/// which the rule for ties shifts along x. Returns a bound of all coordinates.
double SurfacePatches::findFarthestVertices() {
  double reach = 1;
  for (const WhichBody body : {WhichBody::Second, WhichBody::First}) {
    const std::vector<fcl::Vector3d>& points = (*bodies_)[indexOf(body)].points;
    for (unsigned v = 0; v < points.size(); ++v) {
      reach = std::max(reach, points[v].lpNorm<Eigen::Infinity>());
      const unsigned index = regionOf(body, v);  // while building, by root in enclosed_
      if (index == kNoRegion) continue;
      Enclosed& e = enclosed_[index];
      if (points[v][0] < e.farthest[0]) continue;
      e.body = body;
      e.farthest = points[v];
    }
  }
  return reach;
}

/// Connects a cavity with the region that has its farthest vertex inside, by the crossings of a
/// line from there, not along an edge of a regular grid. Of eight directions, takes one that does
/// not cross parts of a triangle at the vertex. `reach`: bound of all coordinates.
void SurfacePatches::connectCavity(const Enclosed& cavity, double reach) {
  for (unsigned octant = 0; octant < 8; ++octant) {
    const fcl::Vector3d along(octant & 1 ? -1 : 1, octant & 2 ? -0.3127 : 0.3127,
                              octant & 4 ? -0.1741 : 0.1741);
    around_.clear();
    if (!addWindings(cavity, WhichBody::First, along, reach) ||
        !addWindings(cavity, WhichBody::Second, along, reach))
      continue;
    const unsigned around = rootAround(cavity.root);
    if (around != kNoRegion) connect(cavity.root, around);
    return;
  }
}

/// Adds how often the parts of a body's surface wind around a cavity's vertex. Where the line meets
/// the vertex's own body, ties are broken as if the vertex were shifted. Returns false if it
/// crosses parts of a triangle that is as near as the rounding of positions.
bool SurfacePatches::addWindings(const Enclosed& cavity, WhichBody body, const fcl::Vector3d& along,
                                 double reach) {
  const ClosedSurface& surface = (*bodies_)[indexOf(body)];
  const SurfaceWinding& winding = (*windings_)[indexOf(body)];
  const WhichBody shifted = body == cavity.body ? WhichBody::First : cavity.body;
  Line line{cavity.farthest, along.unitOrthogonal(), {}};
  line.v = along.cross(line.u);
  const fcl::Vector3d far = line.from + 4 * reach * along;
  candidates_.clear();
  surface.rays->find(line.from, along, candidates_);
  for (const unsigned t : candidates_) {
    const TrianglePoints p = surface.triangle(t);
    const int passage = passageThrough(p, line.from, far, shifted);
    if (passage == 0) continue;
    const unsigned label = winding.label(surface.corners(t)[0]);
    if (const CutTriangle* const cut = cutTriangle(body, t)) {
      if (areNear({line.from, line.from, line.from}, p, crossings_->rounding())) return false;
      addWindings(line, *cut);
    } else {
      around_.push_back({rootOf(labelElement(body, label)), passage * winding.numberOf(label)});
    }
  }
  return true;
}

/// Keeps a curve in a triangle if it goes around a hole.
void SurfacePatches::addIfHole(std::size_t curve, WhichBody body, unsigned triangle) {
  const TrianglePoints p = (*bodies_)[indexOf(body)].triangle(triangle);
  const fcl::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).stableNormalized();
  const double area = signedArea(curves_[curve], body, normal);
  if (area < 0) holes_.push_back({curve, body, triangle, area});
}

/// Connects a curve around a hole with the part of the triangle that has a point of the curve
/// inside, leaving out the curve itself. Tries several points, as some may touch that part's
/// boundary.
void SurfacePatches::connectHole(const Hole& hole) {
  constexpr std::size_t kPoints = 8;
  const CrossingCurve& curve = curves_[hole.curve];
  const TrianglePoints p = (*bodies_)[indexOf(hole.body)].triangle(hole.triangle);
  const CutTriangle& cut = *cutTriangle(hole.body, hole.triangle);
  const auto pieceAt = [&](std::size_t i) -> Piece {
    return pieceOf(hole.body, crossings_->segments()[curve_segments_[i]]);
  };
  for (std::size_t i = curve.begin; i < curve.end; i += 1 + (curve.end - curve.begin) / kPoints) {
    const Line line = lineAcross(p, pieceAt(i).from);
    around_.clear();
    addWindings(line, cut);
    for (std::size_t k = curve.begin; k < curve.end; ++k) addWinding(line, pieceAt(k), -1);
    const unsigned around = rootAround(kNoRegion);
    if (around != kNoRegion) return connect(curve.region, around);
  }
}

/// Returns the line through a point of a triangle's plane, along the axis nearest to its normal.
auto SurfacePatches::lineAcross(const TrianglePoints& triangle, const fcl::Vector3d& x) -> Line {
  int axis;
  (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).cwiseAbs().maxCoeff(&axis);
  return {x, fcl::Vector3d::Unit((axis + 1) % 3), fcl::Vector3d::Unit((axis + 2) % 3)};
}

/// Adds how often the boundaries of a triangle's parts wind around a line.
void SurfacePatches::addWindings(const Line& line, const CutTriangle& cut) {
  for (std::size_t i = cut.begin; i < cut.end; ++i) addWinding(line, pieces_[i], 1);
}

/// Adds a piece of a part's boundary, `times` times, if it crosses the half-plane of positive u
/// that ends at the line (v = 0). A piece common to two triangles is treated equally in both.
void SurfacePatches::addWinding(const Line& line, const Piece& piece, int times) {
  const fcl::Vector3d from = piece.from - line.from, to = piece.to - line.from;
  const double u0 = from.dot(line.u), v0 = from.dot(line.v), u1 = to.dot(line.u),
               v1 = to.dot(line.v);
  const double product = u0 * v1 - u1 * v0;
  if ((v0 > 0) == (v1 > 0) || !((v1 > v0 ? product : -product) > 0)) return;
  around_.push_back({rootOf(piece.element), v1 > v0 ? times * piece.count : -times * piece.count});
}

/// Returns a root other than `own` whose numbers in around_ do not add up to 0, or kNoRegion.
unsigned SurfacePatches::rootAround(unsigned own) {
  std::sort(around_.begin(), around_.end(),
            [](const Winding& a, const Winding& b) { return a.root < b.root; });
  for (std::size_t i = 0; i < around_.size();) {
    const unsigned root = around_[i].root;
    int number = 0;
    for (; i < around_.size() && around_[i].root == root; ++i) number += around_[i].number;
    if (number != 0 && root != own) return root;
  }
  return kNoRegion;
}

}  // namespace adaptive_bvh
