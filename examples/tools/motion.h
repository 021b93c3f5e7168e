#pragma once

#include <vector>

#include <fcl/common/types.h>

namespace tools {

using Point = fcl::Vector3d;
using Positions = std::vector<Point>;

/// A motion for any mesh: where its vertices are at time t in [0, 1]. It ends where it began.
class Motion {
 public:
  enum Style {
    Squeeze,      ///< flattened from one side, bulging to the other, with a dent
    Wave,         ///< a wave across the thin side
    Interpolate,  ///< to the target and back
  };

  /// `target` is for Interpolate: as many positions as `rest`.
  Motion(Positions rest, Style style, Positions target = {});

  /// Valid until the next call.
  const Positions& at(double t);

 private:
  Point positionOf(std::size_t v, double phase) const;
  Point squeezed(const Point& q, double phase) const;
  Point waved(const Point& q, double phase) const;

  Positions rest_, target_;
  Style style_;
  Positions now_;
  Point center_;
  double size_ = 1;  ///< half the longest side of the box around it
  int thin_axis_ = 0;
};

/// Scales a plate to the size of a mesh and places it below.
void placeBelow(Positions& plate, const Positions& mesh);

}  // namespace tools
