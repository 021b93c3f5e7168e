// Signed distances with proven bounds: two balls of 20,480 triangles, and, of a file, two of its
// parts (an armadillo and a roller) and a part and a cylinder. One thread; the least of many runs.
// The deepest point is judged by every triangle in long double.
#include <algorithm>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <fcl/geometry/shape/cylinder.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "stopwatch.h"
#include "support/exact_geometry.h"
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
#include "adaptive_bvh/mesh_io.h"
#endif

namespace {

using namespace adaptive_bvh_bench;  // NOLINT: this is its program
using Model = adaptive_bvh::DeformableMesh;
using Result = adaptive_bvh::SignedDistance;
using Point = fcl::Vector3d;
using Transform = fcl::Transform3d;
namespace exact = adaptive_bvh_test::exact;

struct Surface {
  std::vector<Point> vertices;
  std::vector<fcl::Triangle> triangles;

  double size() const {
    fcl::AABBd box;
    for (const Point& p : vertices) box += p;
    return (box.max_ - box.min_).norm();
  }
  Point middle() const {
    fcl::AABBd box;
    for (const Point& p : vertices) box += p;
    return box.center();
  }
};

/// A ball of radius 1: an icosahedron whose triangles are cut in four n times.
Surface ball(int n) {
  const double g = (1 + std::sqrt(5.)) / 2;
  Surface s;
  for (const double a : {-1., 1.})
    for (const double b : {-g, g})
      for (int k = 0; k < 3; ++k) {
        Point p = Point::Zero();
        p[k] = a;
        p[(k + 1) % 3] = b;
        s.vertices.push_back(p.normalized());
      }
  const double edge = 2 / std::sqrt(1 + g * g) * 1.01;
  const auto isEdge = [&](std::size_t i, std::size_t j) {
    return (s.vertices[i] - s.vertices[j]).norm() < edge;
  };
  for (std::size_t i = 0; i < 12; ++i)
    for (std::size_t j = i + 1; j < 12; ++j)
      for (std::size_t k = j + 1; k < 12; ++k) {
        if (!isEdge(i, j) || !isEdge(j, k) || !isEdge(k, i)) continue;
        const bool is_out = s.vertices[i].dot(s.vertices[j].cross(s.vertices[k])) > 0;
        s.triangles.emplace_back(i, is_out ? j : k, is_out ? k : j);
      }
  for (int level = 0; level < n; ++level) {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> middles;
    const auto middle = [&](std::size_t a, std::size_t b) {
      const auto found = middles.emplace(std::minmax(a, b), s.vertices.size());
      if (found.second) s.vertices.push_back((s.vertices[a] + s.vertices[b]).normalized());
      return found.first->second;
    };
    std::vector<fcl::Triangle> finer;
    for (const fcl::Triangle& t : s.triangles) {
      const std::size_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
    }
    s.triangles = std::move(finer);
  }
  return s;
}

/// The distance of a point to a placed surface, by all triangles.
double distanceTo(const Surface& surface, const Transform& tf, const Point& x) {
  const exact::Placement at = exact::placement(tf);
  exact::Real least = 1e30L;
  for (const fcl::Triangle& t : surface.triangles) {
    const auto corner = [&](int k) { return at(exact::of(surface.vertices[t[k]])); };
    least = std::min(least, exact::distance({corner(0), corner(1), corner(2)}, exact::of(x)));
  }
  return static_cast<double>(least);
}

template <typename Query>
Result timed(const std::string& name, double tolerance, const Query& query) {
  Result result{};
  double least = 1e30;
  for (int i = 0; i < 50; ++i) least = std::min(least, milliseconds([&] { result = query(); }));
  std::printf("| %s | %.2g | %.3f | %zu | %.7g | %.7g |", name.c_str(), tolerance, least,
              result.searches, result.lower, result.upper);
  return result;
}
/// Prints by how much the upper bound differs from the depth of the deepest point.
void judge(const Result& result, const Surface& first, const Transform& tf1, const Surface& second,
           const Transform& tf2) {
  const bool is_first = result.deep_body == adaptive_bvh::DeepBody::First;
  const double depth = is_first ? distanceTo(second, tf2, result.points[0])
                                : distanceTo(first, tf1, result.points[1]);
  std::printf(" %.1g |\n", std::abs(depth - std::abs(result.upper)));
}

void measureBalls() {
  const Surface surface = ball(5);
  const Model a(surface.vertices, surface.triangles), b = a;
  Transform tf = Transform::Identity();
  tf.linear() = Eigen::AngleAxisd(0.7, Point(0.2, 0.4, -0.5).normalized()).toRotationMatrix();
  for (const double overlap : {-0.1, 0.1, 0.5, 1.})
    for (const double tolerance : {1e-2, 1e-3, 1e-6}) {
      tf.translation() = (2 - overlap) * Point(0.3, 0.5, 0.8).normalized();
      char name[64];
      std::snprintf(name, sizeof(name), "balls of %zu triangles, overlap %g",
                    surface.triangles.size(), overlap);
      judge(timed(name, tolerance,
                  [&] { return signedDistance(a, Transform::Identity(), b, tf, tolerance); }),
            surface, Transform::Identity(), surface, tf);
    }
}

#ifdef ADAPTIVE_BVH_HAS_MESH_IO
/// The parts of a mesh that hang together, the one with the most triangles first.
std::vector<Surface> partsOf(const adaptive_bvh::TriangleMesh& mesh) {
  std::vector<std::size_t> part(mesh.vertices.size());
  for (std::size_t i = 0; i < part.size(); ++i) part[i] = i;
  for (bool changes = true; changes;) {
    changes = false;
    for (const fcl::Triangle& t : mesh.triangles) {
      const std::size_t least = std::min({part[t[0]], part[t[1]], part[t[2]]});
      for (int k = 0; k < 3; ++k) changes |= part[t[k]] != least, part[t[k]] = least;
    }
  }
  std::map<std::size_t, Surface> parts;
  std::vector<std::size_t> number(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    Surface& surface = parts[part[v]];
    number[v] = surface.vertices.size();
    surface.vertices.push_back(mesh.vertices[v]);
  }
  for (const fcl::Triangle& t : mesh.triangles)
    parts[part[t[0]]].triangles.emplace_back(number[t[0]], number[t[1]], number[t[2]]);
  std::vector<Surface> list;
  for (auto& one : parts) list.push_back(std::move(one.second));
  std::stable_sort(list.begin(), list.end(), [](const Surface& a, const Surface& b) {
    return a.triangles.size() > b.triangles.size();
  });
  return list;
}

/// Each smaller part is pushed into the largest one; then a cylinder, from each side.
void measureParts(const std::string& file) {
  const std::vector<Surface> parts = partsOf(adaptive_bvh::loadMesh(file));
  const Surface& body = parts[0];
  const Model largest(body.vertices, body.triangles);
  const double size = body.size(), tolerance = 1e-3 * size;
  const Transform still = Transform::Identity();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const Model part(parts[i].vertices, parts[i].triangles);
    for (const double push : {0., 0.02, 0.05, 0.1}) {
      Transform tf = still;
      tf.translation() = push * size * (body.middle() - parts[i].middle()).normalized();
      judge(timed("part " + std::to_string(i), tolerance,
                  [&] { return signedDistance(largest, still, part, tf, tolerance); }),
            body, still, parts[i], tf);
    }
  }
  const fcl::Cylinderd cylinder(0.05 * size, 0.5 * size);
  const fcl::CollisionGeometryd& shape = cylinder;
  for (int axis = 0; axis < 3; ++axis)
    for (const double off : {0.15, 0.2, 0.25}) {
      Transform tf = still;
      tf.translation() = body.middle() + off * size * Point::Unit(axis);
      timed("cylinder", tolerance,
            [&] { return signedDistance(largest, still, shape, tf, tolerance); });
      std::printf(" |\n");
    }
}
#endif

}  // namespace

int main(int argc, char** argv) {
  std::string file;
  CLI::App app("Signed distances of bodies, ms a query.");
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  app.add_option("--mesh", file, "A file with several closed parts");
#endif
  CLI11_PARSE(app, argc, argv);
  std::printf(
      "| bodies | tolerance | ms | searches | lower | upper | judged, off by |\n"
      "| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n");
  measureBalls();
#ifdef ADAPTIVE_BVH_HAS_MESH_IO
  if (!file.empty()) measureParts(file);
#endif
  return 0;
}
