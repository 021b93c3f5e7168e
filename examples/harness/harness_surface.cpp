// The surface of the harness: tubes around its cables, and connectors.
#include <algorithm>
#include <cmath>

#include "harness.h"
#include "solids.h"

namespace harness {

/// Chooses quads of about equal sides for all cables, until there are enough of them.
void Harness::tessellate(std::size_t triangles) {
  std::size_t plugs = 0;
  for (const Rod& rod : cables_) plugs += plug(rod).triangles.size();
  std::size_t count = 0;
  for (double side = 20; count + plugs < triangles; side *= 0.998) {
    count = 0;
    for (Rod& rod : cables_) {
      rod.around = std::max(6, int(std::lround(2 * M_PI * rod.cable.radius / side)));
      rod.rings =
          std::max(int(rod.edges.size()), int(std::lround(10 * double(rod.edges.size()) / side)));
      count += std::size_t(2 * rod.around * (rod.rings + 1));
    }
  }
}

Surface Harness::currentSurface() const {
  Surface surface;
  for (const Rod& rod : cables_) surface.add(tube(rod)).add(plug(rod));
  return surface;
}

Surface Harness::tube(const Rod& rod) const {
  std::vector<Points> rings;
  for (int i = 0; i <= rod.rings; ++i)
    rings.push_back(ring(rod, double(i) * double(rod.edges.size()) / rod.rings));
  return skin(rings);
}

/// The tube's section where so many edges lie behind: on a cubic through the nodes, turned with the
/// frames of the edges.
Points Harness::ring(const Rod& rod, double at) const {
  const std::size_t last = rod.edges.size() - 1;
  const std::size_t i = std::min(last, std::size_t(at));
  const double t = at - double(i), s = 1 - t;
  const auto node = [&](std::size_t k) -> const Point& { return rods_.positions()[rod.nodes[k]]; };
  const auto tangent = [&](std::size_t k) -> Point {
    const std::size_t low = k > 0 ? k - 1 : 0, high = std::min(k + 1, last + 1);
    return (node(high) - node(low)) / double(high - low);
  };
  const auto normal = [&](std::size_t k) -> Point {  // at a node
    return rods_.frame(rod.edges[k > 0 ? k - 1 : 0]) * Point::UnitX() +
           rods_.frame(rod.edges[std::min(k, last)]) * Point::UnitX();
  };
  const Point a = node(i), b = node(i + 1), da = tangent(i), db = tangent(i + 1);
  const Point centre =
      s * s * (1 + 2 * t) * a + t * t * (3 - 2 * t) * b + t * s * (s * da - t * db);
  const Point along =
      (6 * t * s * (b - a) + s * (1 - 3 * t) * da + t * (3 * t - 2) * db).normalized();
  Point across = s * normal(i) + t * normal(i + 1);
  across = (across - along.dot(across) * along).normalized();
  double radius = rod.cable.radius;
  for (const auto& [middle, reach, height] : rod.sleeves)
    radius =
        std::max(radius, rod.cable.radius +
                             height * std::clamp(3 * (1 - std::abs(at - middle) / reach), 0., 1.));
  Points points;
  for (int k = 0; k < rod.around; ++k) {
    const double angle = 2 * M_PI * k / rod.around;
    points.emplace_back(
        centre + radius * (std::cos(angle) * across + std::sin(angle) * along.cross(across)));
  }
  return points;
}

/// The connector at the free end of a cable: a housing with a collar and a latch.
Surface Harness::plug(const Rod& rod) const {
  const bool is_trunk = &rod == &cables_[0];
  const Eigen::Quaterniond frame = rods_.frame(is_trunk ? rod.edges.front() : rod.edges.back());
  Eigen::Isometry3d end =
      Eigen::Translation3d(rods_.positions()[is_trunk ? rod.nodes.front() : rod.nodes.back()]) *
      frame;
  if (is_trunk) end.rotate(Eigen::AngleAxisd(M_PI, Point::UnitX()));
  const double x = rod.cable.plug[0] / 2, y = rod.cable.plug[1] / 2, length = rod.cable.plug[2];
  Surface surface = roundedBox({-x, -y, -3}, {x, y, length}, 2, 1);
  surface.add(
      roundedBox({-x - 1.5, -y - 1.5, length * 0.35}, {x + 1.5, y + 1.5, length * 0.55}, 1, 1));
  surface.add(roundedBox({-x / 3, y - 1, -1}, {x / 3, y + 3, length * 0.8}, 0.8, 1));
  return surface.moved(end);
}

}  // namespace harness
