// The surfaces of shapes and octrees as meshes: patches are subdivided, then welded.
#include "adaptive_bvh/shape_mesh.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "dispatch/convex_parts.h"

namespace adaptive_bvh {
namespace {

constexpr int kMinEdgesPerTurn = 8;  ///< adjacent charts begin with 4 or 8 patches around a turn

/// The surface of one convex part as a mesh, in the part's frame.
class PartMesh {
 public:
  /// `turn`: least number of edges around a full turn of a curved surface.
  explicit PartMesh(const Solid& solid, int turn)
      : inner_(solid.innerPoint()), is_bounded_(solid.core().isBounded()) {
    std::vector<SurfacePatch> patches;
    solid.addPatches(patches);
    for (const SurfacePatch& patch : patches) {
      int edges = patch.chart.patchesOfTurn(), cuts = 0;
      for (; edges > 0 && edges < turn; edges *= 2) ++cuts;
      subdivide(patch.chart, {patch.p, patch.q, patch.r}, cuts);
    }
    weld();
  }

  const TriangleMesh& mesh() const { return mesh_; }

 private:
  /// Adds a patch, after `times` subdivisions into four at the midpoints of edges.
  void subdivide(const SurfaceChart& chart, const TrianglePoints& corners, int times) {
    if (times == 0) return add(chart(corners[0]), chart(corners[1]), chart(corners[2]));
    const auto middle = [&](int i, int k) -> fcl::Vector3d {
      return chart.between(corners[i], corners[k], 0.5);
    };
    const fcl::Vector3d a = middle(1, 2), b = middle(2, 0), c = middle(0, 1);
    subdivide(chart, {corners[0], c, b}, times - 1);
    subdivide(chart, {c, corners[1], a}, times - 1);
    subdivide(chart, {b, a, corners[2]}, times - 1);
    subdivide(chart, {a, b, c}, times - 1);
  }
  /// Adds a triangle, counter-clockwise from outside; an unbounded surface keeps its orientation.
  void add(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c) {
    const bool is_outward = !is_bounded_ || (b - a).cross(c - a).dot((a + b + c) / 3 - inner_) > 0;
    const std::size_t first = mesh_.vertices.size();
    mesh_.vertices.insert(mesh_.vertices.end(), {a, b, c});
    mesh_.triangles.emplace_back(first, is_outward ? first + 1 : first + 2,
                                 is_outward ? first + 2 : first + 1);
  }
  /// Welds the vertices where charts meet, which each chart rounds differently.
  void weld() {
    double size = 0;
    for (const fcl::Vector3d& x : mesh_.vertices)
      size = std::max(size, x.lpNorm<Eigen::Infinity>());
    weldVertices(mesh_, 32 * std::numeric_limits<double>::epsilon() * size);
  }

  const fcl::Vector3d inner_;
  const bool is_bounded_;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh shapeMesh(const fcl::CollisionGeometryd& shape, int turn) {
  if (turn < 1 || turn > 1024)
    throw std::invalid_argument("shapeMesh: " + std::to_string(turn) +
                                " edges around a turn; there may be 1 to 1024");
  if (!isShape(shape.getNodeType()) && shape.getNodeType() != fcl::GEOM_OCTREE)
    throw std::invalid_argument("shapeMesh: the geometry is neither a shape nor an octree");
  TriangleMesh mesh;
  const auto add = [&](const ConvexPart& part) {
    const PartMesh of_part(part.placed.solid, std::max(turn, kMinEdgesPerTurn));
    const std::size_t first = mesh.vertices.size();
    for (const fcl::Vector3d& x : of_part.mesh().vertices)
      mesh.vertices.push_back((part.placed.tf * x));
    for (const fcl::Triangle& t : of_part.mesh().triangles)
      mesh.triangles.emplace_back(first + t[0], first + t[1], first + t[2]);
    return false;
  };
  const auto anyOrder = [](const CellBall&) { return 0.; };
  ConvexParts(shape, fcl::Transform3d::Identity())
      .visit(
          anyOrder, [] { return 0.; }, add);
  return mesh;
}

}  // namespace adaptive_bvh
