#pragma once

#include <array>
#include <cmath>

#include "support/random_geometry.h"

namespace adaptive_bvh_test {

/// Pairs of triangles that CAD data has and random coordinates never hit: on lattices, with
/// parallel and perpendicular edges, in one plane, needles, slivers that cross.
class DegenerateTriangles {
 public:
  using Point = Eigen::Vector3d;
  using Triangle = std::array<Point, 3>;
  struct Pair {
    Triangle first, second;
  };

  explicit DegenerateTriangles(unsigned seed) : random_(seed) {}
  RandomGeometry& random() { return random_; }

  Pair pair() {
    switch (random_.below(5)) {
      case 0: return {alongAxes(), alongAxes()};
      case 1: return {onLattice(), onLattice()};
      case 2: return inOnePlane();
      case 3: return crossingSlivers();
      default: return needleAndNeighbour();
    }
  }

  /// Right angles between edges along axes, coordinates with one decimal.
  Triangle alongAxes() {
    const Point corner = decimals();
    const int first = random_.below(3), second = (first + 1 + random_.below(2)) % 3;
    Triangle t = {corner, corner, corner};
    t[1][first] = decimal();
    t[2][second] = decimal();
    std::rotate(t.begin(), t.begin() + random_.below(3), t.end());
    return t;
  }
  Triangle onLattice() {
    Triangle t;
    for (Point& p : t) p = Point(random_.below(5), random_.below(5), random_.below(5));
    return t;
  }
  Pair inOnePlane() {
    Pair pair{onLattice(), onLattice()};
    const int axis = random_.below(3);
    for (Triangle* t : {&pair.first, &pair.second})
      for (Point& p : *t) p[axis] = 1;
    if (random_.oneIn(2))
      for (Point& p : pair.second) p[axis] = 1 + decimal();
    return pair;
  }
  /// Long, and of any width down to a few roundings.
  Triangle needle() {
    const Point from = random_.point(), along = random_.vectorOfSize(random_.size(-1, 4));
    const Point across = random_.direction() * along.norm() * random_.size(-12, -2);
    const double where = random_.oneIn(3) ? random_.below(2) : random_.uniform(0, 1);
    return {from, from + along, from + where * along + across};
  }
  /// The first is a needle; a corner of the second is inside it or about as near as it is wide.
  Pair needleAndNeighbour() {
    Pair pair{needle(), onLattice()};
    const Triangle& t = pair.first;
    double b = random_.uniform(0, 1), c = random_.uniform(0, 1);
    if (b + c > 1) b = 1 - b, c = 1 - c;
    const double width = (t[1] - t[0]).cross(t[2] - t[0]).norm() / (t[1] - t[0]).norm();
    const Point near = t[0] + b * (t[1] - t[0]) + c * (t[2] - t[0]) +
                       random_.point() * width * random_.size(-2, 1);
    pair.second = random_.oneIn(2) ? Triangle{near, near, near}
                                   : Triangle{near, near + random_.point(), near + random_.point()};
    return pair;
  }
  Pair crossingSlivers() {
    Pair pair{needle(), needle()};
    // The second passes through or by a point of the first.
    const Triangle &p = pair.first, &q = pair.second;
    const double s = random_.uniform(0, 1), t = random_.uniform(0, 1);
    const Point shift = p[0] + s * (p[1] - p[0]) - q[0] - t * (q[1] - q[0]);
    for (Point& x : pair.second) x += shift;
    return pair;
  }

 private:
  double decimal() { return (random_.below(41) - 20) / 10.; }
  Point decimals() { return Point(decimal(), decimal(), decimal()); }

  RandomGeometry random_;
};

}  // namespace adaptive_bvh_test
