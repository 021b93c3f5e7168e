#include "bay.h"

#include <cmath>

#include "route.h"
#include "solids.h"

namespace harness {
namespace {

const Point kAlternator(0, 172, 200), kCompressor(0, 170, 85), kCrank(0, 330, 95),
    kPump(0, 300, 225);

Surface alternator() {
  const Section body = {{40, 0}, {58, 4}, {60, 12}, {60, 84}, {56, 94}, {42, 98}};
  Surface surface = turned(body, 56).moved(placed({247, 172, 200}, Point::UnitX()));
  surface.add(cylinderBetween({228, 172, 200}, {250, 172, 200}, 12));
  for (int i = 0; i < 16; ++i) {  // cooling ribs
    const double angle = 2 * M_PI * i / 16;
    const Eigen::Isometry3d tf =
        Eigen::Translation3d(296, 172, 200) * Eigen::AngleAxisd(angle, Point::UnitX());
    surface.add(roundedBox({-28, 57, -2}, {28, 62.5, 2}, 1.5, 1).moved(tf));
  }
  surface.add(roundedBox({270, 210, 236}, {300, 248, 252}, 4));  // lugs
  surface.add(roundedBox({270, 205, 146}, {300, 248, 162}, 4));
  return surface.add(roundedBox({252, 160, 255}, {276, 184, 268}, 3));  // its socket
}

Surface compressor() {
  Surface surface = cylinderBetween({236, 170, 85}, {370, 170, 85}, 50, 6);
  surface.add(roundedBox({255, 205, 110}, {345, 246, 125}, 4));
  surface.add(roundedBox({255, 205, 45}, {345, 262, 60}, 4));
  for (const double x : {290., 325.})
    surface.add(cylinderBetween({x, 140, 120}, {x, 128, 140}, 11));
  return surface;
}

Surface pulleyAt(const Point& axis, double radius) {
  return pulley(radius, 26).moved(placed({231, axis[1], axis[2]}, -Point::UnitX()));
}

Surface driveBelt() {
  const auto disc = [](const Point& axis, double radius) {
    return Point(axis[1], axis[2], radius);
  };
  return belt(218,
              {disc(kCrank, 65), disc(kCompressor, 48), disc(kAlternator, 30), disc(kPump, 50)}, 21,
              4);
}

Surface thermostat() {
  Surface surface = roundedBox({632, 272, 272}, {672, 332, 326}, 10);
  surface.add(cylinderBetween({655, 280, 300}, {655, 256, 300}, 16));
  return surface.add(cylinder(9, 22, 2, 32).moved(placed({652, 312, 318}, Point::UnitZ())));
}

Surface starter() {
  Surface surface = cylinderBetween({545, 203, 112}, {640, 203, 112}, 34, 6);
  surface.add(cylinderBetween({560, 203, 162}, {628, 203, 162}, 18, 3));
  return surface.add(cylinderBetween({560, 203, 162}, {546, 203, 162}, 5));
}

Surface oilFilter() {
  Surface surface = cylinderBetween({500, 243, 110}, {500, 158, 110}, 33, 9);
  return surface.add(cylinderBetween({500, 246, 110}, {500, 234, 110}, 40, 3));
}

Surface dipstick() {
  Surface surface = pipe(
      {{360, 236, 190}, {360, 222, 220}, {360, 203, 280}, {360, 199, 320}, {360, 199, 347}}, 4);
  surface.add(cylinder(7, 8, 1.5, 24).moved(placed({360, 199, 343}, Point::UnitZ())));
  return surface.add(torus(8, 2.5).moved(placed({360, 199, 361}, Point::UnitX())));
}

Surface camSensor() {
  Surface surface = roundedBox({200, 376, 268}, {240, 408, 292}, 4);
  return surface.add(roundedBox({204, 383, 288}, {222, 401, 300}, 2.5));
}

/// A bracket for a clip: a bent sheet from its foot to below the cable.
Surface bracket(const Points& through, const Point& across) {
  Surface surface = sheet(through, across, 20, 2.5);
  const Point up = (through[0] - through[1]).cross(across).normalized();
  return surface.add(boltHead(6).moved(placed(through[0] + 1.2 * up, up)));
}

/// From the flange of the valve cover to 16 mm below the axis of the trunk.
Surface railBracket(const Point& clip) {
  const double x = clip[0], y = clip[1], z = clip[2] - 16;
  return bracket({{x, 268, 349},
                  {x, 256, 350},
                  {x, 243, 362},
                  {x, 232, z - 4},
                  {x, y + 12, z},
                  {x, y - 10, z}},
                 Point::UnitX());
}

}  // namespace

void addAccessories(Parts& parts) {
  parts.push_back({"alternator", alternator()});
  parts.push_back({"alternator_pulley", pulleyAt(kAlternator, 30)});
  parts.push_back({"compressor", compressor()});
  parts.push_back({"compressor_pulley", pulleyAt(kCompressor, 48)});
  parts.push_back({"crank_pulley", pulleyAt(kCrank, 65)});
  parts.push_back({"water_pump_pulley", pulleyAt(kPump, 50)});
  parts.push_back({"belt", driveBelt()});
  parts.push_back({"thermostat_housing", thermostat()});
  parts.push_back({"starter", starter()});
  parts.push_back({"oil_filter", oilFilter()});
  parts.push_back({"dipstick", dipstick()});
  parts.push_back({"cam_sensor", camSensor()});
  parts.push_back({"bracket_gearbox", bracket({{628, 390, 348},
                                               {640, 410, 352},
                                               {652, 428, 380},
                                               {654, 433, 402},
                                               {655, 443, 410},
                                               {655, 455, 410}},
                                              Point::UnitX())});
  parts.push_back({"bracket_right", railBracket(trunkClips().rail_right)});
  parts.push_back({"bracket_left", railBracket(trunkClips().rail_left)});
}

}  // namespace harness
