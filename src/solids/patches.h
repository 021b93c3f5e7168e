#pragma once

#include <cmath>

#include "solids/solid.h"

namespace adaptive_bvh {

/// Adds patches that cover parts of a shape's surface, for Solid::addPatches.
class PatchList {
 public:
  using Vector = fcl::Vector3d;

  explicit PatchList(std::vector<SurfacePatch>& patches) : patches_(patches) {}

  void addTriangle(const Vector& a, const Vector& b, const Vector& c) const {
    patches_.push_back({SurfaceChart::flat(), a, b, c});
  }
  void addBox(const Vector& half) const {
    for (int k = 0; k < 6; ++k) {
      const Vector middle = (k < 3 ? 1 : -1) * half[k % 3] * Vector::Unit(k % 3),
                   u = half[(k + 1) % 3] * Vector::Unit((k + 1) % 3),
                   v = half[(k + 2) % 3] * Vector::Unit((k + 2) % 3);
      const Vector a = middle - u - v, c = middle + u + v;
      addTriangle(a, middle + u - v, c);
      addTriangle(a, c, middle - u + v);
    }
  }
  /// Adds the half of an ellipsoid above its centre, or below it if `sign` is -1.
  void addHalf(const Vector& center, const Vector& radii, double sign) const {
    const Vector x = Vector::UnitX(), y = Vector::UnitY();
    const Vector around[5] = {x, y, -x, -y, x};
    for (int i = 0; i < 4; ++i)
      patches_.push_back(
          {SurfaceChart::round(center, radii), sign * Vector::UnitZ(), around[i], around[i + 1]});
  }
  /// Adds the surface of revolution of the line between two points (radius, z).
  void addTurned(double radius0, double z0, double radius1, double z1) const {
    const SurfaceChart chart = SurfaceChart::turned(radius0, z0, radius1, z1);
    const int parts = chart.patchesOfTurn();
    const auto angle = [&](int i) -> double { return i * (kTurn / parts); };
    for (int i = 0; i < parts; ++i) {
      const Vector a(0, angle(i), 0), b(0, angle(i + 1), 0), c(1, angle(i), 0),
          d(1, angle(i + 1), 0);
      if (radius0 > 0)
        patches_.push_back({chart, a, b, c});  // with radius0 = 0 this triangle has no area
      patches_.push_back({chart, c, b, d});
    }
  }
  /// Adds a disk around the z axis.
  void addDisk(double radius, double z) const {
    const SurfaceChart chart = SurfaceChart::disk(radius, z);
    const int parts = chart.patchesOfTurn();
    const auto rim = [&](int i) -> Vector {
      const double angle = i * (kTurn / parts);
      return {radius * std::cos(angle), radius * std::sin(angle), 1};
    };
    for (int i = 0; i < parts; ++i)
      patches_.push_back({chart, Vector::Zero(), rim(i), rim((i + 1) % parts)});
  }

 private:
  static constexpr double kTurn = 2 * 3.14159265358979323846;

  std::vector<SurfacePatch>& patches_;
};

}  // namespace adaptive_bvh
