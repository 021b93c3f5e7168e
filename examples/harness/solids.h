#pragma once

#include "surface.h"

namespace harness {

using Section = std::vector<Eigen::Vector2d>;

/// A frame at `origin` whose z axis points along `axis`.
Eigen::Isometry3d placed(const Point& origin, const Point& axis);

/// A box with rounded edges; `cuts` of a quarter turn, 1 for a bevel. The radius is positive and
/// below half of each side.
Surface roundedBox(const Point& low, const Point& high, double radius, int cuts = 3);

/// A profile of (radius, height), turned about z; counter-clockwise: up on the outside. Its ends
/// are closed by discs, or joined if `ring`.
Surface turned(const Section& profile, int around = 48, bool ring = false);

/// A cylinder about z, from height 0, with a bevel.
Surface cylinder(double radius, double height, double bevel = 1.5, int around = 48);
/// Both ends of the axis.
Surface cylinderBetween(const Point& from, const Point& to, double radius, double bevel = 1.5);

/// A belt pulley about z, from height 0, with grooves.
Surface pulley(double radius, double width);

/// A hexagonal bolt's head with its washer, standing on z = 0.
Surface boltHead(double size);

/// A torus about z through the origin.
Surface torus(double radius, double thickness, int around = 32);

/// A rectangular plate in z from 0 to `thickness` with a round hole in its middle.
Surface plateWithHole(double width, double height, double hole, double thickness);

/// A round tube along a smooth curve through the points. Its radius swings by `ripple` every 8 mm.
Surface pipe(const Points& through, double radius, double ripple = 0);

/// A bent strip of sheet metal along a smooth curve through the points. `across` is the direction
/// of its width.
Surface sheet(const Points& through, const Point& across, double width, double thickness);

/// A closed belt in the plane across x, around discs (y, z, radius) at x.
Surface belt(double x, const std::vector<Point>& discs, double width, double thickness);

}  // namespace harness
