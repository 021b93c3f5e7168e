// The part of SurfacePatches that finds cavities: a region may have several closed boundaries, an
// outer one and one around each cavity.
#include <algorithm>
#include <cmath>

#include "query/regions/patches.h"

namespace adaptive_bvh {

/// Connects the surfaces of cavities with the surfaces around them. The closed surface of a root is
/// that of a cavity if the volume that it encloses has the opposite sign of the total volume.
void SurfacePatches::connectCavities() {
  // Smaller volumes, relative to the area to the power of 1.5, are rounding errors.
  constexpr double kFlat = 1e-9;
  measureRoots();
  double sum = 0;
  for (const Enclosed& e : enclosed_) sum += e.volume;
  const double sense = sum < 0 ? -1 : 1;
  for (const Enclosed& cavity : enclosed_) {
    if (!(sense * cavity.volume < -kFlat * cavity.area * std::sqrt(cavity.area))) continue;
    if (connectCavity(cavity.root, parts_[cavity.largest])) continue;
    // The line through that part missed the cavity.
    for (const SurfacePart& part : parts_)
      if (rootOf(part.region) == cavity.root && connectCavity(cavity.root, part)) break;
  }
}

/// Computes the volume that the parts of each root enclose, and finds the largest part.
void SurfacePatches::measureRoots() {
  enclosed_.clear();
  numbers_.assign(parents_.size(), kNoRegion);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const SurfacePart& part = parts_[i];
    unsigned& index = numbers_[rootOf(part.region)];  // in enclosed_
    if (index == kNoRegion) {
      index = static_cast<unsigned>(enclosed_.size());
      enclosed_.push_back({rootOf(part.region), 0, 0, part.origin, i});
    }
    Enclosed& e = enclosed_[index];
    e.volume += (part.origin - e.origin).dot(part.normal) * part.area / 3;
    e.area += std::fabs(part.area);
    if (std::fabs(part.area) > std::fabs(parts_[e.largest].area)) e.largest = i;
  }
}

/// Connects a cavity with the surface around it, which is found along a line through one of the
/// cavity's parts. Returns false if the line misses the cavity.
bool SurfacePatches::connectCavity(unsigned root, const SurfacePart& part) {
  if (part.area == 0) return false;
  // The line is steep to the part, and not along an edge of a regular grid.
  Line line;
  line.origin = part.centroid();
  const fcl::Vector3d tangent = part.normal.unitOrthogonal();
  line.along = part.normal + 0.3127 * tangent + 0.1741 * part.normal.cross(tangent);
  line.u = line.along.unitOrthogonal();
  line.v = line.along.cross(line.u);
  hits_.clear();
  for (const WhichBody body : {WhichBody::First, WhichBody::Second}) {
    candidates_.clear();
    RayCandidates& rays = *(*bodies_)[indexOf(body)].rays;
    rays.find(line.origin, line.along, candidates_);
    rays.find(line.origin, -line.along, candidates_);
    std::sort(candidates_.begin(), candidates_.end());
    candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());
    for (const unsigned t : candidates_) addHits(line, body, t);
  }
  const unsigned around = rootAround(root);
  if (around != kNoRegion) connect(root, around);
  return around != kNoRegion;
}

/// Adds the crossings of a line with the parts of a triangle. Their position is where the line
/// crosses the triangle's plane, clamped to the triangle's extent along the line.
void SurfacePatches::addHits(const Line& line, WhichBody body, unsigned triangle) {
  const ClosedSurface& surface = (*bodies_)[indexOf(body)];
  const TrianglePoints<double> p = surface.triangle(triangle);
  const fcl::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
  double low = line.along.dot(p[0] - line.origin), high = low;
  for (const fcl::Vector3d& x : p) {
    low = std::min(low, line.along.dot(x - line.origin));
    high = std::max(high, line.along.dot(x - line.origin));
  }
  const double in_plane =
      normal.dot(p[0] - line.origin) / normal.dot(line.along) * line.along.squaredNorm();
  const double position = in_plane > low ? std::min(in_plane, high) : low;  // `low` if it is NaN
  if (const CutTriangle* const cut = cutTriangle(body, triangle)) {
    for (std::size_t i = cut->begin; i < cut->end; ++i) addHit(line, pieces_[i], position);
    return;
  }
  const SurfaceWinding& winding = (*windings_)[indexOf(body)];
  const unsigned label = winding.label(surface.corners(triangle)[0]);
  const int number = winding.numberOf(label);
  if (number == 0) return;
  for (std::size_t k = 0; k < 3; ++k)
    addHit(line, {labelElement(body, label), number, p[k], p[(k + 1) % 3]}, position);
}

/// Adds a hit if a piece of a part's boundary, seen along the line, crosses the half-line of
/// positive u (v = 0). The sum of these hits is how often the boundary winds around the line, so
/// how often the line crosses the part. A piece common to two triangles is treated equally in both.
void SurfacePatches::addHit(const Line& line, const Piece& piece, double position) {
  const fcl::Vector3d from = piece.from - line.origin, to = piece.to - line.origin;
  const double u0 = from.dot(line.u), v0 = from.dot(line.v), u1 = to.dot(line.u),
               v1 = to.dot(line.v);
  const double product = u0 * v1 - u1 * v0;
  if ((v0 > 0) == (v1 > 0) || !((v1 > v0 ? product : -product) > 0)) return;
  hits_.push_back({position, rootOf(piece.element), v1 > v0 ? piece.count : -piece.count});
}

}  // namespace adaptive_bvh
