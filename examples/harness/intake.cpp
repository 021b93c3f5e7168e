#include "bay.h"
#include "solids.h"

namespace harness {
namespace {

Surface plenum() {
  Surface surface =
      turned({{20, 0}, {36, 5}, {44, 18}, {45, 30}, {45, 292}, {44, 304}, {36, 316}, {20, 320}}, 56)
          .moved(placed({290, 130, 312}, Point::UnitX()));
  for (int i = 0; i < 4; ++i)  // stiffening rings
    surface.add(torus(44, 3, 56).moved(placed({360 + 60. * i, 130, 312}, Point::UnitX())));
  return surface;
}

Surface runner(double x) {
  Surface surface = pipe(
      {{x, 250, 300}, {x, 232, 303}, {x, 200, 330}, {x, 165, 362}, {x, 138, 358}, {x, 130, 335}},
      18);
  surface.add(roundedBox({x - 32, 238, 282}, {x + 32, 246, 318}, 3, 2));  // flange
  for (const double side : {-1., 1.})
    surface.add(boltHead(6).moved(placed({x + 25 * side, 239, 300}, -Point::UnitY())));
  return surface;
}

Surface throttle() {
  Surface surface = cylinderBetween({606, 130, 312}, {668, 130, 312}, 34);
  surface.add(cylinderBetween({608, 130, 312}, {618, 130, 312}, 44));
  surface.add(roundedBox({622, 108, 336}, {662, 152, 370}, 5));           // motor
  return surface.add(roundedBox({630, 118, 366}, {654, 142, 376}, 2.5));  // its socket
}

Surface mapSensor() {
  Surface surface = roundedBox({436, 100, 352}, {464, 126, 368}, 3);
  surface.add(cylinder(8, 14, 1, 24).moved(placed({450, 113, 342}, Point::UnitZ())));
  return surface.add(roundedBox({442, 104, 366}, {458, 122, 375}, 2));
}

Surface fuelRail() {
  Surface surface = cylinderBetween({288, 226, 360}, {612, 226, 360}, 9);
  for (const double x : kCylinders)
    surface.add(cylinder(11, 16, 1.5, 32).moved(placed({x + 28, 226, 344}, Point::UnitZ())));
  for (const double x : {360., 540.})  // posts on the head
    surface.add(roundedBox({x - 8, 222, 349}, {x + 8, 262, 355}, 2, 2));
  return surface;
}

Surface injector(double x) {
  const Section profile = {{4, 0},   {5, 1},   {5, 9},  {8, 11}, {8, 24},
                           {10, 25}, {10, 33}, {7, 34}, {7, 46}, {6, 47}};
  Surface surface = turned(profile, 32).moved(placed({x + 28, 240, 306}, {0, -14, 42}));
  return surface.add(roundedBox({x + 21, 214, 322}, {x + 35, 232, 334}, 2));  // its socket
}

Surface coil(double x) {
  Surface surface = roundedBox({x - 16, 300, 384}, {x + 16, 358, 408}, 5);
  surface.add(cylinder(19, 8, 2, 40).moved(placed({x, 332, 382}, Point::UnitZ())));
  surface.add(roundedBox({x - 10, 290, 390}, {x + 10, 306, 404}, 2.5));  // its socket
  return surface.add(boltHead(5).moved(placed({x, 350, 406}, Point::UnitZ())));
}

Surface exhaust() {
  Surface surface;
  for (const double x : kCylinders) {
    const double end = 450 + 0.12 * (x - 450);
    surface.add(roundedBox({x - 32, 415, 270}, {x + 32, 425, 312}, 3, 2));
    surface.add(pipe({{x, 412, 290},
                      {x, 432, 290},
                      {x + 0.2 * (450 - x), 458, 275},
                      {end, 470, 205},
                      {end, 472, 165}},
                     16));
  }
  surface.add(turned({{24, 0}, {26, 2}, {26, 40}, {44, 85}, {44, 95}, {30, 96}}, 48)
                  .moved(placed({450, 472, 85}, Point::UnitZ())));
  return surface.add(pipe({{450, 472, 90}, {450, 474, 62}, {452, 500, 36}, {452, 560, 30}}, 25));
}

Surface heatShield() {
  const Points bend = {
      {450, 424, 346}, {450, 455, 344}, {450, 490, 325}, {450, 502, 280}, {450, 505, 215}};
  Surface surface = sheet(bend, Point::UnitX(), 310, 1.5);
  for (int i = 0; i < 5; ++i) {  // beads
    Points shifted = bend;
    for (Point& p : shifted) p += Point(-120 + 60. * i, 0.5, 0.5);
    surface.add(sheet(shifted, Point::UnitX(), 8, 4));
  }
  return surface;
}

}  // namespace

void addIntake(Parts& parts) {
  parts.push_back({"plenum", plenum()});
  parts.push_back({"throttle_body", throttle()});
  parts.push_back({"map_sensor", mapSensor()});
  parts.push_back({"fuel_rail", fuelRail()});
  for (std::size_t i = 0; i < kCylinders.size(); ++i) {
    const std::string number = "_" + std::to_string(i + 1);
    parts.push_back({"runner" + number, runner(kCylinders[i])});
    parts.push_back({"injector" + number, injector(kCylinders[i])});
    parts.push_back({"ignition_coil" + number, coil(kCylinders[i])});
  }
  parts.push_back({"exhaust_manifold", exhaust()});
  parts.push_back({"heat_shield", heatShield()});
  parts.push_back({"fuel_line", pipe({{610, 226, 360},
                                      {632, 232, 360},
                                      {652, 270, 362},
                                      {660, 340, 365},
                                      {655, 430, 362},
                                      {640, 510, 330},
                                      {600, 560, 300},
                                      {590, 592, 285}},
                                     4)});
}

}  // namespace harness
