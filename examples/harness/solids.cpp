#include "solids.h"

#include <algorithm>
#include <cmath>

namespace harness {
namespace {

Section circle(double radius, int around) {
  Section section;
  for (int i = 0; i < around; ++i) {
    const double angle = 2 * M_PI * i / around;
    section.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return section;
}

Section rectangle(double width, double height) {
  const double x = width / 2, y = height / 2;
  return {{x, y}, {-x, y}, {-x, -y}, {x, -y}};
}

/// The section at each point of a curve, scaled there.
Surface swept(const Points& curve, const Points& directions, const Section& section,
              const Point& normal, const std::vector<double>& scales, bool loop = false) {
  const Points normals = transportedNormals(directions, normal);
  std::vector<Points> rings(curve.size());
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const Point second = directions[i].cross(normals[i]);
    for (const Eigen::Vector2d& p : section)
      rings[i].emplace_back(curve[i] + scales[i] * (p[0] * normals[i] + p[1] * second));
  }
  return skin(rings, loop);
}

Point anyAcross(const Point& direction) { return direction.unitOrthogonal(); }

/// Lines of a rounded box along an axis: `cuts` + 1 of the lower edge, and of the upper.
struct RoundedLattice {
  int cuts;
  int last() const { return 2 * cuts + 1; }
  bool isUpper(int line) const { return line > cuts; }
  double slope(int line) const {
    const double u = isUpper(line) ? double(line - cuts - 1) / cuts : double(line) / cuts - 1;
    return std::tan(u * M_PI / 4);
  }
};

/// Vertices of the lattice on the surface of a box, by number.
class RoundedBox {
 public:
  RoundedBox(const Point& low, const Point& high, double radius, int cuts)
      : low_(low), high_(high), radius_(radius), lattice_{cuts} {
    const auto lines = static_cast<std::size_t>(lattice_.last() + 1);
    numbers_.assign(lines * lines * lines, -1);
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, lattice_.last()}) addFace(axis, side);
  }
  Surface take() { return std::move(surface_); }

 private:
  void addFace(int axis, int side) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    const auto at = [&](int i, int j) {
      std::array<int, 3> lines{};
      lines[std::size_t(axis)] = side;
      lines[std::size_t(b)] = i;
      lines[std::size_t(c)] = j;
      return number(lines);
    };
    for (int i = 0; i < lattice_.last(); ++i)
      for (int j = 0; j < lattice_.last(); ++j) {
        const unsigned p = at(i, j), q = at(i + 1, j), r = at(i + 1, j + 1), s = at(i, j + 1);
        addTriangle({p, q, r}, side == 0);
        addTriangle({p, r, s}, side == 0);
      }
  }
  void addTriangle(std::array<unsigned, 3> t, bool reversed) {
    if (reversed) std::swap(t[1], t[2]);
    surface_.triangles.push_back(t);
  }
  unsigned number(const std::array<int, 3>& lines) {
    const int size = lattice_.last() + 1;
    int& number = numbers_[std::size_t((lines[0] * size + lines[1]) * size + lines[2])];
    if (number < 0) {
      number = static_cast<int>(surface_.vertices.size());
      surface_.vertices.push_back(position(lines));
    }
    return static_cast<unsigned>(number);
  }
  Point position(const std::array<int, 3>& lines) const {
    Point slopes, centre;
    for (int k = 0; k < 3; ++k) {
      const int line = lines[std::size_t(k)];
      slopes[k] = lattice_.slope(line);
      centre[k] = lattice_.isUpper(line) ? high_[k] - radius_ : low_[k] + radius_;
    }
    return centre + radius_ * slopes.normalized();
  }

  Point low_, high_;
  double radius_;
  RoundedLattice lattice_;
  std::vector<int> numbers_;
  Surface surface_;
};

/// The convex hull of points in the plane, counter-clockwise.
Section hull(Section points) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a[0] < b[0] || (a[0] == b[0] && a[1] < b[1]);
  });
  const auto turns_right = [](const auto& a, const auto& b, const auto& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0;
  };
  Section result;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = result.size();
    for (const auto& p : points) {
      while (result.size() >= first + 2 && turns_right(result.end()[-2], result.back(), p))
        result.pop_back();
      result.push_back(p);
    }
    result.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return result;
}

}  // namespace

Eigen::Isometry3d placed(const Point& origin, const Point& axis) {
  return Eigen::Translation3d(origin) * shortestTurn(Point::UnitZ(), axis.normalized());
}

Surface roundedBox(const Point& low, const Point& high, double radius, int cuts) {
  return RoundedBox(low, high, radius, cuts).take();
}

Surface turned(const Section& profile, int around, bool ring) {
  std::vector<Points> rings;
  for (const Eigen::Vector2d& p : profile) {
    rings.emplace_back();
    for (const Eigen::Vector2d& xy : circle(p[0], around))
      rings.back().emplace_back(xy[0], xy[1], p[1]);
  }
  return skin(rings, ring);
}

Surface cylinder(double radius, double height, double bevel, int around) {
  return turned(
      {{radius - bevel, 0}, {radius, bevel}, {radius, height - bevel}, {radius - bevel, height}},
      around);
}

Surface cylinderBetween(const Point& from, const Point& to, double radius, double bevel) {
  return cylinder(radius, (to - from).norm(), bevel).moved(placed(from, to - from));
}

Surface pulley(double radius, double width) {
  Section profile = {{radius * 0.3, 0.3 * width}, {radius * 0.8, 0.3 * width}, {radius * 0.85, 0}};
  const int grooves = 5;
  for (int i = 0; i < grooves; ++i) {
    const double z = width * (i + 0.5) / (grooves + 0.5), step = width / (grooves + 0.5);
    profile.emplace_back(radius, z - 0.4 * step);
    profile.emplace_back(radius, z);
    profile.emplace_back(radius - 2.5, z + 0.3 * step);
  }
  profile.emplace_back(radius, width);
  profile.emplace_back(radius * 0.85, width);
  profile.emplace_back(radius * 0.8, 0.6 * width);
  profile.emplace_back(radius * 0.3, 0.6 * width);
  Surface surface = turned(profile, 64);
  return surface.add(cylinder(radius * 0.22, width, 1, 32));
}

Surface boltHead(double size) {
  Surface surface = cylinder(1.05 * size, 0.2 * size, 0.05 * size, 24);
  return surface.add(
      turned({{0.8 * size, 0.1 * size}, {0.8 * size, 0.8 * size}, {0.65 * size, 0.9 * size}}, 6));
}

Surface torus(double radius, double thickness, int around) {
  Section profile;
  for (const Eigen::Vector2d& p : circle(thickness, 12)) profile.emplace_back(radius + p[0], p[1]);
  return turned(profile, around, true);
}

Surface plateWithHole(double width, double height, double hole, double thickness) {
  const int side = 12;
  Points outer, inner;
  for (int i = 0; i < 4 * side; ++i) {
    const double angle = 2 * M_PI * (i - side / 2.) / (4 * side);
    const Point direction(std::cos(angle), std::sin(angle), 0);
    inner.emplace_back(hole * direction);
    outer.emplace_back(direction / direction.cwiseAbs().maxCoeff());
    outer.back() = Point(outer.back()[0] * width / 2, outer.back()[1] * height / 2, 0);
  }
  const auto raised = [&](Points ring) {
    for (Point& p : ring) p[2] = thickness;
    return ring;
  };
  return skin({outer, raised(outer), raised(inner), inner}, true);
}

Surface pipe(const Points& through, double radius, double ripple) {
  const double step = ripple > 0 ? 2 : std::max(3., radius / 2);
  const Points curve = smoothCurve(through, step), directions = tangents(curve);
  std::vector<double> scales;
  for (std::size_t i = 0; i < curve.size(); ++i)
    scales.push_back(radius + ripple * std::sin(double(i) * M_PI / 2));
  return swept(curve, directions, circle(1, radius < 10 ? 16 : 28), anyAcross(directions.front()),
               scales);
}

Surface sheet(const Points& through, const Point& across, double width, double thickness) {
  const Points curve = smoothCurve(through, 4), directions = tangents(curve);
  return swept(curve, directions, rectangle(width, thickness), across,
               std::vector<double>(curve.size(), 1));
}

Surface belt(double x, const std::vector<Point>& discs, double width, double thickness) {
  Section points;
  for (const Point& disc : discs)
    for (const Eigen::Vector2d& p : circle(disc[2] + thickness / 2, 64))
      points.emplace_back(disc[0] + p[0], disc[1] + p[1]);
  Points curve;
  for (const Eigen::Vector2d& p : hull(points)) curve.emplace_back(x, p[0], p[1]);
  return swept(curve, tangents(curve, true), rectangle(width, thickness), Point::UnitX(),
               std::vector<double>(curve.size(), 1), true);
}

}  // namespace harness
