#include "surface.h"

#include <algorithm>
#include <cmath>

namespace harness {
namespace {

unsigned size(const Points& points) { return static_cast<unsigned>(points.size()); }

Point middle(const Points& points) {
  Point sum = Point::Zero();
  for (const Point& p : points) sum += p;
  return sum / double(points.size());
}

/// The quads between two rings that begin at vertices `low` and `high`.
void addBand(Surface& surface, unsigned low, unsigned high, unsigned around) {
  for (unsigned i = 0; i < around; ++i) {
    const unsigned next = (i + 1) % around;
    surface.triangles.push_back({low + i, low + next, high + next});
    surface.triangles.push_back({low + i, high + next, high + i});
  }
}

void addFan(Surface& surface, unsigned ring, unsigned around, const Point& centre, bool up) {
  const unsigned tip = size(surface.vertices);
  surface.vertices.push_back(centre);
  for (unsigned i = 0; i < around; ++i) {
    const unsigned a = ring + i, b = ring + (i + 1) % around;
    surface.triangles.push_back({up ? a : b, up ? b : a, tip});
  }
}

/// Centripetal Catmull-Rom between b and c.
Point between(const Point& a, const Point& b, const Point& c, const Point& d, double t) {
  const double ab = std::sqrt((b - a).norm()), bc = std::sqrt((c - b).norm()),
               cd = std::sqrt((d - c).norm());
  const Point at_b = (c - b) + bc * ((b - a) / ab - (c - a) / (ab + bc));
  const Point at_c = (c - b) + bc * ((d - c) / cd - (d - b) / (bc + cd));
  const double s = 1 - t;
  return s * s * (1 + 2 * t) * b + t * t * (3 - 2 * t) * c + t * s * s * at_b - t * t * s * at_c;
}

Points densePoints(const Points& through) {
  const int cuts = 64;
  const std::size_t last = through.size() - 1;
  Points dense;
  for (std::size_t i = 0; i < last; ++i) {
    const Point &b = through[i], &c = through[i + 1];
    const Point a = i > 0 ? through[i - 1] : Point(2 * b - c);
    const Point d = i + 1 < last ? through[i + 2] : Point(2 * c - b);
    for (int k = 0; k < cuts; ++k) dense.push_back(between(a, b, c, d, double(k) / cuts));
  }
  dense.push_back(through.back());
  return dense;
}

}  // namespace

Surface& Surface::add(const Surface& other) {
  const unsigned first = size(vertices);
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles)
    triangles.push_back({first + a, first + b, first + c});
  return *this;
}

Surface Surface::moved(const Eigen::Isometry3d& tf) const {
  Surface result = *this;
  for (Point& p : result.vertices) p = tf * p;
  return result;
}

Surface skin(const std::vector<Points>& rings, bool loop) {
  Surface surface;
  const unsigned around = size(rings.front());
  for (const Points& ring : rings)
    surface.vertices.insert(surface.vertices.end(), ring.begin(), ring.end());
  const auto count = static_cast<unsigned>(rings.size());
  for (unsigned i = 0; i + 1 < count; ++i) addBand(surface, i * around, (i + 1) * around, around);
  const unsigned last = (count - 1) * around;
  if (loop) {
    addBand(surface, last, 0, around);
  } else {
    addFan(surface, 0, around, middle(rings.front()), false);
    addFan(surface, last, around, middle(rings.back()), true);
  }
  return surface;
}

Points smoothCurve(const Points& through, double step) {
  const Points dense = densePoints(through);
  std::vector<double> length = {0};
  for (std::size_t i = 1; i < dense.size(); ++i)
    length.push_back(length.back() + (dense[i] - dense[i - 1]).norm());
  const int pieces = std::max(1, int(std::lround(length.back() / step)));
  Points curve;
  std::size_t i = 1;
  for (int k = 0; k < pieces; ++k) {
    const double wanted = length.back() * k / pieces;
    while (length[i] < wanted) ++i;
    const double t = (wanted - length[i - 1]) / (length[i] - length[i - 1]);
    curve.emplace_back(dense[i - 1] + t * (dense[i] - dense[i - 1]));
  }
  curve.push_back(dense.back());
  return curve;
}

Points tangents(const Points& curve, bool loop) {
  const std::size_t count = curve.size();
  Points directions;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = i > 0 ? i - 1 : loop ? count - 1 : 0;
    const std::size_t after = i + 1 < count ? i + 1 : loop ? 0 : count - 1;
    directions.emplace_back((curve[after] - curve[before]).normalized());
  }
  return directions;
}

Eigen::Quaterniond shortestTurn(const Point& from, const Point& to) {
  const double w = 1 + from.dot(to);
  const Point axis = w > 1e-12 ? Point(from.cross(to)) : from.unitOrthogonal();
  return Eigen::Quaterniond(w > 1e-12 ? w : 0, axis[0], axis[1], axis[2]).normalized();
}

Points transportedNormals(const Points& directions, const Point& first) {
  Points normals;
  Point normal = first;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (i > 0) normal = shortestTurn(directions[i - 1], directions[i]) * normal;
    normal = (normal - directions[i].dot(normal) * directions[i]).normalized();
    normals.push_back(normal);
  }
  return normals;
}

}  // namespace harness
