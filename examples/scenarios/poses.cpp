#include "poses.h"

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "bodies.h"

namespace scenarios {
namespace {

/// A mesh and a second pose of its vertices.
struct TwoPoses {
  Mesh from;
  std::vector<Point> to;
};

TwoPoses checked(const std::string& name, const Mesh& from, const std::vector<Point>& to) {
  if (from.vertices.size() != to.size())
    throw std::invalid_argument(name + ": the two poses differ in their number of vertices");
  return {from, to};
}

Body thereAndBack(const std::string& name, const TwoPoses& poses, int frames) {
  return {name, poses.from, frames,
          [to = poses.to](const std::vector<Point>& rest, double t, std::vector<Point>& out) {
            const double there = (1 - std::cos(2 * M_PI * t)) / 2;
            for (std::size_t v = 0; v < rest.size(); ++v)
              out[v] = (1 - there) * rest[v] + there * to[v];
          }};
}

/// Sets of numbers that grow together.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), std::size_t(0));
  }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t i, std::size_t j) { parent_[find(i)] = find(j); }

 private:
  std::vector<std::size_t> parent_;
};

/// The number of the connected part of every triangle: any number below that of the vertices.
std::vector<std::size_t> partsOf(const Mesh& mesh) {
  Mesh welded = mesh;
  adaptive_bvh::weldVertices(welded);
  DisjointSets sets(welded.vertices.size());
  for (const fcl::Triangle& t : welded.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  std::vector<std::size_t> parts;
  for (const fcl::Triangle& t : welded.triangles) parts.push_back(sets.find(t[0]));
  return parts;
}

/// Of the triangles that are `chosen`, with the vertices that they use.
TwoPoses extract(const TwoPoses& poses, const std::vector<bool>& chosen) {
  TwoPoses part;
  const std::size_t unused = poses.to.size();
  std::vector<std::size_t> number(poses.to.size(), unused);
  const auto renumbered = [&](std::size_t v) {
    if (number[v] == unused) {
      number[v] = part.to.size();
      part.from.vertices.push_back(poses.from.vertices[v]);
      part.to.push_back(poses.to[v]);
    }
    return number[v];
  };
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const fcl::Triangle& t = poses.from.triangles[i];
    if (!chosen[i]) continue;
    const std::size_t a = renumbered(t[0]), b = renumbered(t[1]), c = renumbered(t[2]);
    part.from.triangles.emplace_back(a, b, c);
  }
  return part;
}

}  // namespace

Scenario interpolated(const std::string& name, const Mesh& from, const std::vector<Point>& to,
                      int frames) {
  Eigen::AlignedBox3d box;
  for (const Point& p : from.vertices) box.extend(p);
  const double size = box.sizes().maxCoeff();
  const Point below(box.center()[0], box.center()[1], box.min()[2] - 0.15 * size);
  const auto still = [](const std::vector<Point>& rest, double, std::vector<Point>& out) {
    out = rest;
  };
  return {
      name, thereAndBack(name, checked(name, from, to), frames),
      Body("plate", grid(9, 9, size, size), 1, still).placed(Pose(Eigen::Translation3d(below)))};
}

Scenario interpolatedParts(const std::string& name, const Mesh& from, const std::vector<Point>& to,
                           int frames) {
  const TwoPoses poses = checked(name, from, to);
  const std::vector<std::size_t> parts = partsOf(from);
  std::vector<std::size_t> triangles(from.vertices.size());  // by part
  for (std::size_t part : parts) ++triangles[part];
  const auto most = std::max_element(triangles.begin(), triangles.end());
  const auto largest = std::size_t(most - triangles.begin());

  std::vector<bool> first, second;
  for (std::size_t part : parts) {
    first.push_back(part == largest);
    second.push_back(part != largest);
  }
  TwoPoses others = extract(poses, second);
  if (others.to.empty()) throw std::invalid_argument(name + ": the mesh has only one part");
  return {name, thereAndBack("largest part", extract(poses, first), frames),
          thereAndBack("other parts", others, frames)};
}

}  // namespace scenarios
