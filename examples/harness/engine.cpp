#include "bay.h"

#include <algorithm>
#include <cmath>

#include "solids.h"

namespace harness {
namespace {

Surface block() {
  Surface surface = roundedBox({260, 240, 60}, {640, 420, 262}, 8);
  for (int i = 0; i < 9; ++i) {  // ribs on both sides
    const double x = 280 + 42.5 * i;
    surface.add(roundedBox({x - 4, 232, 70}, {x + 4, 428, 250}, 2, 2));
  }
  for (const double z : {110., 190.})
    surface.add(roundedBox({262, 234, z}, {638, 426, z + 7}, 2, 2));
  for (const double x : kCylinders)  // core plugs
    surface.add(cylinderBetween({x - 20, 241, 150}, {x - 20, 236, 150}, 17));
  return surface;
}

Surface head() {
  Surface surface = roundedBox({264, 250, 258}, {636, 410, 342}, 6);
  surface.add(roundedBox({262, 244, 260}, {638, 416, 268}, 3, 2));  // gasket
  for (const double x : kCylinders) {
    surface.add(cylinderBetween({x, 252, 300}, {x, 243, 300}, 26));  // intake ports
    surface.add(roundedBox({x - 34, 246, 284}, {x + 34, 252, 316}, 2, 2));
    surface.add(roundedBox({x - 30, 406, 272}, {x + 30, 417, 310}, 4, 2));  // exhaust ports
  }
  return surface;
}

Surface valveCover() {
  Surface surface = roundedBox({274, 264, 338}, {626, 396, 386}, 16, 5);
  surface.add(roundedBox({266, 256, 336}, {634, 404, 346}, 4, 2));  // flange
  for (const double x : {450., 540.})                               // ribs
    surface.add(roundedBox({x - 3, 272, 360}, {x + 3, 388, 390}, 2.5, 2));
  return surface;
}

Surface fillerCap() {
  Surface surface = cylinder(24, 14, 3).moved(placed({360, 300, 384}, Point::UnitZ()));
  for (int i = 0; i < 10; ++i) {  // grip
    const double angle = 2 * M_PI * i / 10;
    const Point at(360 + 23 * std::cos(angle), 300 + 23 * std::sin(angle), 386);
    surface.add(cylinder(4, 11, 1, 12).moved(placed(at, Point::UnitZ())));
  }
  return surface;
}

Surface oilPan() {
  Surface surface = roundedBox({268, 245, 52}, {632, 415, 64}, 4, 2);
  surface.add(roundedBox({285, 262, 4}, {470, 398, 60}, 18, 5));
  surface.add(roundedBox({440, 262, 30}, {615, 398, 60}, 12, 5));
  return surface.add(boltHead(8).moved(placed({290, 330, 25}, -Point::UnitX())));
}

Surface timingCover() {
  Surface surface = roundedBox({238, 246, 50}, {262, 414, 345}, 7);
  surface.add(cylinderBetween({240, 330, 95}, {230, 330, 95}, 34));
  surface.add(cylinderBetween({240, 300, 225}, {230, 300, 225}, 28));
  return surface.add(cylinderBetween({240, 290, 305}, {232, 290, 305}, 32, 4))
      .add(cylinderBetween({240, 368, 305}, {232, 368, 305}, 32, 4));
}

Surface coverBolts() {
  Surface surface;
  for (int i = 0; i < 6; ++i)
    for (const double y : {260., 400.})
      surface.add(boltHead(6).moved(placed({280 + 68. * i, y, 345}, Point::UnitZ())));
  for (const double z : {62., 130., 250., 330.})
    for (const double y : {254., 406.})
      surface.add(boltHead(6).moved(placed({239, y, z}, -Point::UnitX())));
  return surface;
}

Surface gearbox() {
  Surface surface = roundedBox({690, 255, 75}, {830, 405, 224}, 22, 5);
  for (int i = 0; i < 4; ++i)
    surface.add(roundedBox({712 + 30. * i, 247, 90}, {718 + 30. * i, 413, 210}, 2.5, 2));
  surface.add(cylinderBetween({760, 420, 110}, {760, 400, 110}, 40, 4));  // output
  return surface.add(cylinderBetween({828, 330, 150}, {842, 330, 150}, 50, 4));
}

Surface bellHousing() {
  const Section cone = {{118, 0}, {124, 3}, {124, 12}, {112, 16}, {92, 58}, {70, 60}};
  Surface surface = turned(cone, 64).moved(placed({640, 330, 165}, Point::UnitX()));
  for (int i = 0; i < 8; ++i) {
    const double angle = 2 * M_PI * (i + 0.5) / 8;
    const Point at(652, 330 + 117 * std::cos(angle), 165 + 117 * std::sin(angle));
    surface.add(boltHead(7).moved(placed(at, Point::UnitX())));
  }
  return surface;
}

Surface mount(double rail, double engine, double y, double z) {
  Surface surface = cylinder(30, 58, 8).moved(placed({rail, y, z - 60}, Point::UnitZ()));
  surface.add(cylinder(9, 30, 2, 24).moved(placed({rail, y, z - 6}, Point::UnitZ())));
  surface.add(boltHead(11).moved(placed({rail, y, z + 12}, Point::UnitZ())));
  const double low = std::min(rail, engine), high = std::max(rail, engine);
  return surface.add(roundedBox({low - 15, y - 14, z - 4}, {high, y + 14, z + 12}, 4));
}

}  // namespace

void addEngine(Parts& parts) {
  parts.push_back({"block", block()});
  parts.push_back({"cylinder_head", head()});
  parts.push_back({"valve_cover", valveCover()});
  parts.push_back({"cover_bolts", coverBolts()});
  parts.push_back({"oil_filler_cap", fillerCap()});
  parts.push_back({"oil_pan", oilPan()});
  parts.push_back({"timing_cover", timingCover()});
  parts.push_back({"bell_housing", bellHousing()});
  parts.push_back({"gearbox", gearbox()});
  parts.push_back({"engine_mount_left", mount(80, 242, 398, 200)});
  parts.push_back({"engine_mount_right", mount(868, 825, 360, 200)});
}

Parts engineBay() {
  Parts parts;
  addEngine(parts);
  addIntake(parts);
  addAccessories(parts);
  addBody(parts);
  return parts;
}

}  // namespace harness
