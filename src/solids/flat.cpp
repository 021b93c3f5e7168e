#include "solids/flat.h"

#include <algorithm>

namespace adaptive_bvh {

using Vector = fcl::Vector3d;
using Triangle = TrianglePoints<double>;

ShapeCore FlatSolid::core() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ShapeCore core;
  core.axes = Eigen::Quaterniond::FromTwoVectors(Vector::UnitX(), n_).toRotationMatrix();
  core.low = Vector(is_solid_ ? -kInfinity : d_, -kInfinity, -kInfinity);
  core.high = Vector(d_, kInfinity, kInfinity);
  return core;
}

FlatSolid::Extremes FlatSolid::extremes(const Triangle& triangle) const {
  Extremes of = {0, 0, std::numeric_limits<double>::infinity(), 0};
  of.high = -of.low;
  for (std::size_t k = 0; k < 3; ++k) {
    const double height = n_.dot(triangle[k]) - d_;
    if (height < of.low) of.low = height, of.lowest = k;
    if (height > of.high) of.high = height, of.highest = k;
  }
  return of;
}

TriangleGap FlatSolid::gap(const Triangle& triangle) const {
  const Extremes of = extremes(triangle);
  const Vector &lowest = triangle[of.lowest], &highest = triangle[of.highest];
  if (of.low > 0) return {{lowest, lowest - of.low * n_}, of.low};
  if (!is_solid_ && of.high < 0) return {{highest, highest - of.high * n_}, -of.high};
  Vector common = lowest;
  if (!is_solid_ && of.high > of.low) common += (highest - common) * (of.low / (of.low - of.high));
  return {{common, common}, 0};
}

Penetration FlatSolid::penetration(const Triangle& triangle) const {
  const Extremes of = extremes(triangle);
  // The half-space moves down until it is below the triangle; a plane may also move up above it.
  const bool is_down = is_solid_ || -of.low <= of.high;
  return {is_down ? Vector(-n_) : n_, std::max(is_down ? -of.low : of.high, 0.), 0};
}

ShapeSurface FlatSolid::surface(const Vector& x) const {
  const double height = n_.dot(x) - d_;
  const Vector nearest = x - height * n_;
  if (is_solid_ || height >= 0) return {height, nearest, n_};
  return {-height, nearest, -n_};
}

LineInterval FlatSolid::along(const Line& line) const {
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
