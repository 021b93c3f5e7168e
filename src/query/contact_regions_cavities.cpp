#include <algorithm>
#include <cmath>

#include "query/contact_regions_patches.h"
#include "triangles/solid_angle.h"

namespace adaptive_bvh {

/// A closed surface that encloses a negative volume is the inner boundary of a region. It is
/// connected with the smallest region around it.
void SurfacePatches::connectCavities() {
  // Less than that, for its area, is the rounding of a region without volume.
  constexpr double kFlat = 1e-9;
  measureRoots();
  std::size_t solid = 0;
  for (const Enclosed& e : enclosed_) solid += e.volume > 0;
  if (solid == 0) return;
  for (const Enclosed& cavity : enclosed_) {
    if (!(cavity.volume < -kFlat * cavity.area * std::sqrt(cavity.area))) continue;
    const Enclosed* around = nullptr;
    for (const Enclosed& e : enclosed_)
      if (e.volume > -cavity.volume && (!around || e.volume < around->volume) &&
          (solid == 1 || isAround(e.root, cavity.origin)))
        around = &e;
    if (around) connect(cavity.root, around->root);
  }
}

/// The volume that the parts of each root enclose.
void SurfacePatches::measureRoots() {
  enclosed_.clear();
  numbers_.assign(parents_.size(), kNoRegion);
  for (const SurfacePart& part : parts_) {
    unsigned& number = numbers_[rootOf(part.region)];
    if (number == kNoRegion) {
      number = static_cast<unsigned>(enclosed_.size());
      enclosed_.push_back({rootOf(part.region), 0, 0, part.origin});
    }
    Enclosed& e = enclosed_[number];
    e.volume += (part.origin - e.origin).dot(part.normal) * part.area / 3;
    e.area += std::fabs(part.area);
  }
}

/// Whether the parts of a root wind around a point, by solid angles.
bool SurfacePatches::isAround(unsigned root, const fcl::Vector3d& point) const {
  double sum = 0;
  const auto angle = [&](const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c) {
    return SolidAngle<double>(a - point, b - point, c - point).value();
  };
  root = rootOf(root);
  for (const SurfacePart& part : parts_) {
    if (rootOf(part.region) != root) continue;
    const ClosedSurface& surface = (*bodies_)[indexOf(part.body)];
    const CutTriangle* const cut = cutTriangle(part.body, part.triangle);
    if (!cut) {
      const TrianglePoints<double> p = surface.triangle(part.triangle);
      sum += angle(p[0], p[1], p[2]);
      continue;
    }
    for (std::size_t i = cut->begin; i < cut->end; ++i)
      if (rootOf(pieces_[i].element) == root)
        sum += pieces_[i].count * angle(part.origin, pieces_[i].from, pieces_[i].to);
  }
  return std::fabs(sum) > 2 * M_PI;
}

}  // namespace adaptive_bvh
