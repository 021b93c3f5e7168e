#include "solids/flat.h"

#include <algorithm>

namespace adaptive_bvh {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints;

ShapeCore FlatSolid::core() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ShapeCore core;
  core.axes = Eigen::Quaterniond::FromTwoVectors(Vector::UnitX(), n_).toRotationMatrix();
  core.low = Vector(is_solid_ ? -kInfinity : d_, -kInfinity, -kInfinity);
  core.high = Vector(d_, kInfinity, kInfinity);
  return core;
}

FlatSolid::Extremes FlatSolid::extremes(const Triangle& triangle) const {
  Extremes found = {0, 0, std::numeric_limits<double>::infinity(), 0};
  found.high = -found.low;
  for (std::size_t k = 0; k < 3; ++k) {
    const double height = n_.dot(triangle[k]) - d_;
    if (height < found.low) found.low = height, found.lowest = k;
    if (height > found.high) found.high = height, found.highest = k;
  }
  return found;
}

TriangleGap FlatSolid::gap(const Triangle& triangle) const {
  const Extremes found = extremes(triangle);
  const double low = found.low, high = found.high;
  const Vector &lowest = triangle[found.lowest], &highest = triangle[found.highest];
  if (low > 0) return {{lowest, lowest - low * n_}, low};
  if (!is_solid_ && high < 0) return {{highest, highest - high * n_}, -high};
  Vector common = lowest;
  if (!is_solid_ && high > low) common += (highest - common) * (low / (low - high));
  return {{common, common}, 0};
}

Penetration FlatSolid::penetration(const Triangle& triangle) const {
  const Extremes found = extremes(triangle);
  // The half-space moves down until it is below the triangle; a plane may also move up above it.
  const bool is_down = is_solid_ || -found.low <= found.high;
  return {is_down ? Vector(-n_) : n_, std::max(is_down ? -found.low : found.high, 0.), 0};
}

ShapeSurface FlatSolid::surface(const Vector& x) const {
  const double height = n_.dot(x) - d_;
  const Vector nearest = x - height * n_;
  if (is_solid_ || height >= 0) return {height, nearest, n_};
  return {-height, nearest, -n_};
}

LineInterval FlatSolid::lineInside(const Line& line) const {
  const double height = n_.dot(line.origin) - d_, rise = n_.dot(line.direction);
  if (is_solid_) return LineInterval::whereNotPositive(height, rise);
  if (rise == 0) return {};
  return {-height / rise, -height / rise};
}

void FlatSolid::addPatches(std::vector<SurfacePatch>& patches) const {
  const fcl::Matrix3d axes =
      Eigen::Quaterniond::FromTwoVectors(Vector::UnitZ(), n_).toRotationMatrix();
  const Vector middle = d_ * n_, x = axes.col(0), y = axes.col(1), low = middle - x - y,
               high = middle + x + y;
  patches.push_back({SurfaceChart::flat(), low, middle + x - y, high});
  patches.push_back({SurfaceChart::flat(), low, high, middle - x + y});
}

}  // namespace adaptive_bvh
