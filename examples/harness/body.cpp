#include "bay.h"

#include <cmath>

#include "solids.h"

namespace harness {
namespace {

Surface radiator() {
  Surface surface = roundedBox({150, 10, 115}, {750, 36, 410}, 3, 2);
  for (int i = 0; i < 24; ++i)  // rows of fins
    surface.add(roundedBox({152, 8, 122 + 12. * i}, {748, 38, 127 + 12. * i}, 1, 1));
  for (const double x : {128., 740.}) surface.add(roundedBox({x, 4, 108}, {x + 32, 44, 418}, 8));
  return surface.add(cylinder(20, 14, 3).moved(placed({756, 24, 414}, Point::UnitZ())));
}

Surface shroud() {
  Surface surface;
  for (const double x : {310., 590.})
    surface.add(plateWithHole(279, 280, 122, 3).moved(placed({x, 46, 262}, -Point::UnitY())));
  for (const double x : {168., 446., 726.})
    surface.add(roundedBox({x, 44, 124}, {x + 6, 62, 400}, 2, 2));
  return surface;
}

Surface fan(double x) {
  Surface surface = cylinderBetween({x, 64, 262}, {x, 46, 262}, 36, 4);
  for (int i = 0; i < 7; ++i) {
    const Eigen::Isometry3d tf = Eigen::Translation3d(x, 55, 262) *
                                 Eigen::AngleAxisd(2 * M_PI * i / 7 + 0.3, Point::UnitY()) *
                                 Eigen::AngleAxisd(0.5, Point::UnitZ());
    surface.add(roundedBox({-18, -1.5, 30}, {18, 1.5, 116}, 1.2, 1).moved(tf));
  }
  for (int i = 0; i < 3; ++i) {  // arms of the motor
    const Eigen::Isometry3d tf =
        Eigen::Translation3d(x, 72, 262) * Eigen::AngleAxisd(2 * M_PI * i / 3, Point::UnitY());
    surface.add(roundedBox({-5, -3, 20}, {5, 3, 128}, 2, 2).moved(tf));
  }
  return surface.add(cylinderBetween({x, 78, 262}, {x, 66, 262}, 28, 3));
}

Surface battery() {
  Surface surface = roundedBox({706, 302, 240}, {880, 452, 398}, 5);
  surface.add(roundedBox({703, 299, 380}, {883, 455, 412}, 5));  // lid
  for (const double x : {735., 850.}) {
    surface.add(cylinder(9, 18, 1.5, 32).moved(placed({x, 330, 410}, Point::UnitZ())));
    surface.add(roundedBox({x - 14, 316, 416}, {x + 14, 350, 426}, 3, 2));
    surface.add(boltHead(5).moved(placed({x, 343, 425}, Point::UnitZ())));
  }
  for (int i = 0; i < 6; ++i)
    surface.add(cylinder(8, 5, 1, 24).moved(placed({725 + 27. * i, 400, 410}, Point::UnitZ())));
  return surface;
}

Surface airBox() {
  Surface surface = roundedBox({742, 64, 250}, {884, 262, 338}, 14, 5);
  surface.add(roundedBox({734, 56, 334}, {892, 270, 344}, 4, 2));  // flange
  surface.add(roundedBox({742, 64, 340}, {884, 262, 402}, 22, 5));
  for (int i = 0; i < 5; ++i)
    surface.add(roundedBox({762, 92 + 32. * i, 398}, {864, 98 + 32. * i, 406}, 2, 2));
  for (const double y : {95., 165., 235.})  // latches
    surface.add(roundedBox({730, y - 9, 322}, {738, y + 9, 356}, 3, 2));
  return surface;
}

Surface airHose() {
  Surface surface =
      pipe({{664, 130, 312}, {690, 130, 313}, {722, 134, 318}, {748, 140, 320}}, 37, 2);
  return surface.add(torus(39, 2.5, 48).moved(placed({668, 130, 312}, Point::UnitX())));
}

Surface ecu() {
  Surface surface = roundedBox({556, 548, 322}, {706, 582, 452}, 6);
  for (int i = 0; i < 11; ++i)
    surface.add(roundedBox({570 + 12. * i, 543, 330}, {574 + 12. * i, 550, 365}, 1.5, 1));
  surface.add(roundedBox({596, 536, 376}, {690, 552, 420}, 4));  // header of its socket
  for (const double z : {330., 440.})
    for (const double x : {546., 704.})
      surface.add(roundedBox({x, 572, z - 8}, {x + 14, 592, z + 8}, 3, 2));
  return surface;
}

Surface fuseBox() {
  Surface surface = roundedBox({66, 250, 322}, {164, 366, 384}, 6);
  surface.add(roundedBox({62, 246, 380}, {168, 370, 412}, 12, 4));
  surface.add(roundedBox({100, 366, 360}, {130, 374, 392}, 3, 2));
  for (const double x : {80., 150.})
    surface.add(cylinder(7, 170, 2, 24).moved(placed({x, 308, 156}, Point::UnitZ())));
  return surface;
}

Surface booster() {
  const Section profile = {{30, 0},  {84, 0},  {88, 6},  {88, 30}, {92, 33},
                           {92, 39}, {86, 42}, {80, 72}, {50, 86}, {30, 88}};
  return turned(profile, 64).moved(placed({285, 590, 400}, -Point::UnitY()));
}

Surface masterCylinder() {
  Surface surface = cylinderBetween({285, 505, 400}, {285, 432, 400}, 19, 4);
  surface.add(roundedBox({256, 436, 424}, {314, 500, 462}, 9, 4));  // reservoir
  surface.add(cylinder(19, 14, 3).moved(placed({285, 466, 460}, Point::UnitZ())));
  for (const double y : {450., 486.})
    surface.add(cylinder(8, 16, 1, 24).moved(placed({285, y, 412}, Point::UnitZ())));
  return surface;
}

Surface expansionTank() {
  Surface surface = roundedBox({62, 388, 318}, {168, 462, 420}, 20, 5);
  surface.add(roundedBox({60, 386, 366}, {170, 464, 372}, 2, 2));  // seam
  surface.add(cylinder(23, 20, 4).moved(placed({115, 425, 416}, Point::UnitZ())));
  return surface.add(cylinder(9, 160, 2, 24).moved(placed({80, 425, 160}, Point::UnitZ())));
}

Surface tower(double x) {
  const Section profile = {{66, 0}, {66, 270}, {62, 288}, {50, 298}, {24, 300}, {22, 296}};
  Surface surface = turned(profile, 56).moved(placed({x, 526, 120}, Point::UnitZ()));
  surface.add(cylinder(12, 22, 2, 32).moved(placed({x, 526, 412}, Point::UnitZ())));
  for (int i = 0; i < 3; ++i) {
    const double angle = 2 * M_PI * i / 3;
    const Point at(x + 38 * std::cos(angle), 526 + 38 * std::sin(angle), 418);
    surface.add(boltHead(7).moved(placed(at, Point::UnitZ())));
  }
  return surface;
}

Surface fireWall() {
  Surface surface = roundedBox({2, 590, 10}, {898, 598, 492}, 2, 2);
  for (const double x : {30., 170., 405., 500., 730., 850.})  // beads
    surface.add(roundedBox({x, 586, 40}, {x + 24, 592, 470}, 2.5, 2));
  return surface.add(roundedBox({4, 570, 484}, {896, 598, 496}, 3, 2));
}

Surface frame() {
  Surface surface;
  for (const double x : {6., 842.}) surface.add(roundedBox({x, 4, 62}, {x + 52, 590, 156}, 10));
  surface.add(roundedBox({40, 2, 40}, {860, 44, 98}, 8));
  surface.add(roundedBox({30, 4, 424}, {870, 40, 452}, 8));
  for (const double x : {40., 836.}) surface.add(roundedBox({x, 6, 60}, {x + 24, 38, 440}, 6));
  return surface;
}

Surface tray() {
  Surface surface;
  for (const double x : {747., 839.})
    for (const double y : {339., 417.})
      surface.add(plateWithHole(91, 77, 14, 3).moved(placed({x, y, 232}, Point::UnitZ())));
  surface.add(roundedBox({701, 298, 230}, {704, 458, 262}, 1.2, 1));
  return surface.add(roundedBox({836, 330, 150}, {850, 430, 234}, 4));
}

void addFluids(Parts& parts) {
  parts.push_back({"upper_hose", pipe({{655, 268, 300},
                                       {656, 240, 298},
                                       {678, 190, 250},
                                       {712, 120, 215},
                                       {735, 75, 206},
                                       {752, 36, 205}},
                                      17)});
  parts.push_back({"lower_hose", pipe({{146, 36, 140},
                                       {160, 82, 142},
                                       {230, 98, 142},
                                       {370, 96, 128},
                                       {430, 135, 120},
                                       {440, 242, 120}},
                                      17)});
  parts.push_back({"brake_line", pipe({{285, 440, 388},
                                       {304, 440, 386},
                                       {345, 470, 386},
                                       {400, 545, 350},
                                       {520, 572, 300},
                                       {680, 574, 290},
                                       {752, 560, 280},
                                       {768, 520, 262}},
                                      3)});
  parts.push_back({"expansion_hose", pipe({{166, 420, 335},
                                           {182, 405, 320},
                                           {190, 330, 250},
                                           {180, 200, 250},
                                           {172, 90, 330},
                                           {158, 40, 380}},
                                          8)});
}

}  // namespace

void addBody(Parts& parts) {
  parts.push_back({"radiator", radiator()});
  parts.push_back({"fan_shroud", shroud()});
  parts.push_back({"fan_left", fan(310)});
  parts.push_back({"fan_right", fan(590)});
  addFluids(parts);
  parts.push_back({"battery", battery()});
  parts.push_back({"battery_tray", tray()});
  parts.push_back({"air_box", airBox()});
  parts.push_back({"air_hose", airHose()});
  parts.push_back({"ecu", ecu()});
  parts.push_back({"fuse_box", fuseBox()});
  parts.push_back({"brake_booster", booster()});
  parts.push_back({"master_cylinder", masterCylinder()});
  parts.push_back({"expansion_tank", expansionTank()});
  parts.push_back({"strut_tower_left", tower(75)});
  parts.push_back({"strut_tower_right", tower(825)});
  parts.push_back({"fire_wall", fireWall()});
  parts.push_back({"frame", frame()});
}

}  // namespace harness
