#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "support/closed_bodies.h"
#include "support/shape_oracle.h"

namespace adaptive_bvh_test {

/// The judge of signed distances, in long double: a closed body, and points spread over its
/// surface.
class JudgedBody {
 public:
  using Real = exact::Real;
  using Point = exact::Point;

  virtual ~JudgedBody() = default;
  /// How deep a point of the world is inside; minus its distance to the surface outside.
  virtual Real depth(const Point& x) const = 0;
  /// How far it is from the surface.
  Real distance(const Point& x) const { return std::abs(depth(x)); }
  /// Calls each(p, q, r) for triangles of points of the surface that cover it; curved ones only
  /// with their corners.
  virtual void forEachPatch(
      const std::function<void(const Point&, const Point&, const Point&)>& each) const = 0;
  /// The point of the surface that stands for a point of a patch.
  virtual Point onSurface(const Point& x) const { return x; }
};

/// By all triangles and solid angles.
class JudgedMesh : public JudgedBody {
 public:
  template <typename Model>
  JudgedMesh(const Model& mesh, const fcl::Transform3d& tf) {
    const exact::Placement at = exact::placement(tf);
    for (const fcl::Triangle& t : mesh.triangles())
      triangles_.push_back({at(exact::of(mesh.vertices()[t[0]])),
                            at(exact::of(mesh.vertices()[t[1]])),
                            at(exact::of(mesh.vertices()[t[2]]))});
  }
  const std::vector<exact::Triangle>& triangles() const { return triangles_; }

  Real depth(const Point& x) const override {
    Real least = std::numeric_limits<Real>::infinity();
    for (const exact::Triangle& t : triangles_) least = std::min(least, exact::distance(t, x));
    if (least == 0) return 0;
    return std::lround(turns(x)) != 0 ? least : -least;
  }
  void forEachPatch(
      const std::function<void(const Point&, const Point&, const Point&)>& each) const override {
    for (const exact::Triangle& t : triangles_) each(t[0], t[1], t[2]);
  }

 private:
  Real turns(const Point& x) const {
    Real sum = 0;
    for (const exact::Triangle& t : triangles_) {
      const Point a = t[0] - x, b = t[1] - x, c = t[2] - x;
      const Real la = a.norm(), lb = b.norm(), lc = c.norm();
      sum += std::atan2(a.dot(b.cross(c)),
                        la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2 * std::acos(Real(-1)));
  }
  std::vector<exact::Triangle> triangles_;
};

/// A convex solid by its formula, in its own frame: `inside` is its depth, negative outside, and
/// `nearest` takes a point near its surface to one on it.
class JudgedSolid : public JudgedBody {
 public:
  using Map = std::function<Point(Real, Real)>;

  JudgedSolid(const fcl::Transform3d& tf, std::function<Real(const Point&)> inside)
      : at_(exact::placement(tf)), inside_(std::move(inside)) {}
  /// A part of the surface: the image of the unit square.
  void add(Map map) { maps_.push_back(std::move(map)); }

  Real depth(const Point& x) const override { return inside_(at_.R.transpose() * (x - at_.T)); }
  void forEachPatch(
      const std::function<void(const Point&, const Point&, const Point&)>& each) const override {
    constexpr int kParts = 12;
    for (const Map& map : maps_)
      for (int i = 0; i < kParts; ++i)
        for (int j = 0; j < kParts; ++j) {
          const auto p = [&](int u, int v) -> Point {
            return at_(map(Real(i + u) / kParts, Real(j + v) / kParts));
          };
          each(p(0, 0), p(1, 0), p(1, 1));
          each(p(0, 0), p(1, 1), p(0, 1));
        }
  }

 private:
  exact::Placement at_;
  std::function<Real(const Point&)> inside_;
  std::vector<Map> maps_;
};

/// The deepest of many points of one surface in another body: a grid on each patch, then again
/// around the deepest.
struct SampledDepth {
  exact::Real depth = -std::numeric_limits<exact::Real>::infinity();
  long points = 0;

  /// `is_flat`: whether patches are the surface; else only their corners count.
  SampledDepth(const JudgedBody& source, const JudgedBody& target, int grid, bool is_flat) {
    struct Cell {
      exact::Real depth;
      exact::Triangle corners;
    };
    std::vector<Cell> cells;
    source.forEachPatch([&](const exact::Point& p, const exact::Point& q, const exact::Point& r) {
      if (!is_flat) {
        take(target.depth(p));
        return;
      }
      cells.push_back({take(target.depth((p + q + r) / 3)), {p, q, r}});
    });
    for (int round = 0; round < grid; ++round) {
      std::vector<Cell> finer;
      const std::size_t kept = round < 2 ? cells.size() : std::size_t(24);
      std::partial_sort(cells.begin(), cells.begin() + long(std::min(kept, cells.size())),
                        cells.end(),
                        [](const Cell& a, const Cell& b) { return a.depth > b.depth; });
      cells.resize(std::min(kept, cells.size()));
      for (const Cell& cell : cells) {
        const exact::Triangle& t = cell.corners;
        const exact::Point ab = (t[0] + t[1]) / 2, bc = (t[1] + t[2]) / 2, ca = (t[2] + t[0]) / 2;
        for (const exact::Triangle& part :
             {exact::Triangle{t[0], ab, ca}, exact::Triangle{ab, t[1], bc},
              exact::Triangle{ca, bc, t[2]}, exact::Triangle{ab, bc, ca}}) {
          take(target.depth(part[0]));
          finer.push_back({take(target.depth((part[0] + part[1] + part[2]) / 3)), part});
        }
      }
      cells = std::move(finer);
    }
  }

 private:
  exact::Real take(exact::Real found) {
    ++points;
    depth = std::max(depth, found);
    return found;
  }
};

}  // namespace adaptive_bvh_test
