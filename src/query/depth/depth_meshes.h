#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "base/leased.h"
#include "query/depth/depth_search.h"
#include "query/placed_mesh.h"
#include "query/points/point_search.h"
#include "query/points/surface_normals.h"
#include "query/points/winding_number.h"
#include "query/tree_pair.h"
#include "triangles/triangle_gap.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {

/// The body of a closed mesh as the target of DepthSearch: measures distances of points to its
/// surface, and on which side they are. All points are in the mesh's frame.
class MeshTarget {
 public:
  using Witness = int;  ///< index of the nearest triangle
  static constexpr bool kIsConvex = false;

  /// The distance to one triangle: a convex function, nowhere less than that to the surface.
  class WitnessBound {
   public:
    explicit WitnessBound(const TrianglePoints& triangle) : face_(triangle) {}
    double operator()(const fcl::Vector3d& x) const {
      fcl::Vector3d on_face;
      return face_.distance(x, on_face);
    }

   private:
    feature_distance::Face face_;
  };

  explicit MeshTarget(const PlacedMesh& mesh)
      : mesh_(mesh), search_(mesh.mesh), winding_(mesh.mesh), walk_(mesh.tree()) {}

  WitnessBound boundBy(int triangle) const {
    return WitnessBound(mesh_.pointsOf(unsigned(triangle)));
  }
  /// The largest value of a bound in a box: at a corner, because the bound is convex.
  double overBox(const WitnessBound& bound, const OrientedBox& box) const {
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      fcl::Vector3d x = box.middle;
      for (int k = 0; k < 3; ++k) x += (corner >> k & 1 ? 1. : -1.) * box.halves.col(k);
      most = std::max(most, bound(x));
    }
    return most;
  }

  /// Sets the point's distance and nearest triangle. `hint`: a triangle that may be near.
  void measure(DepthPoint<int>& point, int hint) {
    PointSearch::Nearest nearest;
    search_.tryTriangle(point.x, hint, nearest);
    search_.search(point.x, nearest);
    point.distance = nearest.distance;
    point.witness = nearest.triangle;
  }
  bool isInside(const fcl::Vector3d& x) { return winding_.of(x) != 0; }
  /// Whether a ball is certainly outside of the mesh's bounding box.
  bool isClear(const fcl::Vector3d& middle, double radius) const {
    const WideTree& tree = mesh_.tree();
    const fcl::Vector3d y = tree.coordinates()(middle);
    const WideNode& root = tree.nodes()[0];
    double gap = 0;
    for (int k = 0; k < 3; ++k) {
      double low = root.boxes.low[k][0], high = root.boxes.high[k][0];
      for (unsigned i = 1; i < root.count; ++i) {
        low = std::min(low, double(root.boxes.low[k][i]));
        high = std::max(high, double(root.boxes.high[k][i]));
      }
      gap = std::max({gap, low - y[k], y[k] - high});
    }
    return gap * kSlack > radius * tree.scale();
  }
  /// Whether a triangle, or the hull of the curved patch above it (Bulge), may touch the surface.
  bool touches(const TrianglePoints& triangle, const Bulge& bulge) {
    const WideTree& tree = mesh_.tree();
    const double margin = bulge.height * tree.scale() / kSlack;  // in the tree's coordinates
    Float4 low[3], high[3];
    for (int k = 0; k < 3; ++k) low[k] = float4::all(kFar), high[k] = float4::all(-kFar);
    for (const fcl::Vector3d& x : triangle) {
      const fcl::Vector3d y = tree.coordinates()(x);
      for (int k = 0; k < 3; ++k) {
        low[k] = float4::lower(low[k], splat(y[k] - margin));
        high[k] = float4::upper(high[k], splat(y[k] + margin));
      }
    }
    const auto overlaps = [&](const Boxes4& boxes) {
      auto overlap = low[0] <= boxes.high[0];
      for (int k = 0; k < 3; ++k) overlap &= (low[k] <= boxes.high[k]) & (high[k] >= boxes.low[k]);
      return float4::bits(overlap);
    };
    return walk_.visit(overlaps, [&](unsigned leaf_index) {
      const TrianglePoints other = mesh_.pointsAt(leaf_index);
      if (areSurelyFarther(triangle, other, bulge.height)) return false;
      return bulge.count > 0 ? !isBeyond(other, triangle, bulge) : touch(triangle, other);
    });
  }
  /// The plane n x = d of a triangle. n: outward normal, of length 1; zero without an area.
  struct Plane {
    fcl::Vector3d n;
    double d;
  };
  Plane planeOf(int triangle) const {
    const auto index = static_cast<unsigned>(triangle);
    const fcl::Vector3d n = SurfaceNormals(mesh_.mesh).ofFace(index);
    return {n, n.dot(mesh_.pointsOf(index)[0])};
  }
  /// Where the segment from a to b crosses a triangle's plane, from 0 to 1; -1 if it does not.
  double crossing(int triangle, const fcl::Vector3d& a, const fcl::Vector3d& b) const {
    const TrianglePoints t = mesh_.pointsOf(static_cast<unsigned>(triangle));
    const fcl::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const double at_a = normal.dot(a - t[0]), at_b = normal.dot(b - t[0]);
    return (at_a < 0) == (at_b < 0) ? -1 : at_a / (at_a - at_b);
  }
  /// Sets the nearest point of the surface to a measured point, and the normal there.
  void findNearest(const DepthPoint<int>& point, DepthBounds& bounds) const {
    const auto triangle = static_cast<unsigned>(point.witness);
    const SurfaceNormals normals(mesh_.mesh);
    bounds.nearest = vertexFaceDistance(point.x, mesh_.pointsOf(triangle)).second;
    bounds.outward = normals.at(normals.nearestPlace(point.x, triangle));
  }

 private:
  static constexpr double kSlack = 1 - 1e-9;  // for all rounding in this class
  static constexpr float kFar = 1e15f;

  /// Whether a plane is found that separates a triangle of the surface, `face`, from the patch
  /// above `triangle`: the face's, or one across the line between the nearest points.
  static bool isBeyond(const TrianglePoints& face, const TrianglePoints& triangle,
                       const Bulge& bulge) {
    const auto separates = [&](const fcl::Vector3d& direction) {
      double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, above = 0;
      for (const fcl::Vector3d& x : face) lowest = std::min(lowest, direction.dot(x - face[0]));
      for (const fcl::Vector3d& x : triangle)
        highest = std::max(highest, direction.dot(x - face[0]));
      for (int k = 0; k < bulge.count; ++k)
        above = std::max(above, direction.dot(bulge.offsets[static_cast<std::size_t>(k)]));
      return highest + above < lowest;
    };
    const fcl::Vector3d normal = (face[1] - face[0]).cross(face[2] - face[0]);
    if (separates(normal) || separates(-normal)) return true;
    const auto [p, q] = gapOf(triangle, face).points;
    return separates(q - p);
  }
  static Float4 splat(double y) {
    return float4::all(static_cast<float>(std::clamp<double>(y, -kFar, kFar)));
  }

  const PlacedMesh& mesh_;
  PointSearch search_;
  WindingNumber winding_;
  TreeWalk walk_;
};

/// The surface of a mesh as the source of DepthSearch: the boxes of its tree and its triangles, in
/// the target's frame. (The functions that DepthSearch requires are described there.)
class MeshSource {
 public:
  MeshSource(const PlacedMesh& mesh, const RelativePlacement& to_target)
      : mesh_(mesh), to_target_(to_target) {
    const BodyCoordinates& body = mesh.tree().coordinates();
    from_tree_ = to_target.R * body.axes() / body.scale;
    origin_ = to_target(body.origin);
    std::vector<int>& numbers = memory_->numbers;
    if (numbers.size() < mesh.mesh.vertices.size()) numbers.resize(mesh.mesh.vertices.size(), -1);
  }
  ~MeshSource() {
    for (const unsigned vertex : memory_->used) memory_->numbers[vertex] = -1;
    memory_->used.clear();
  }
  MeshSource(const MeshSource&) = delete;
  MeshSource& operator=(const MeshSource&) = delete;

  template <typename Search>
  void start(Search& search) {
    openBox(0, search, search.addMeasured(origin_, -1));
  }
  template <typename Search>
  void openBox(int node, int lane, Search& search, int hint) {
    openBox(mesh_.tree().nodes()[node].below[lane], search, hint);
  }
  OrientedBox boxOf(int node, int lane) const {
    const Boxes4& boxes = mesh_.tree().nodes()[node].boxes;
    OrientedBox box;
    box.middle = origin_;
    for (int k = 0; k < 3; ++k) {
      const double low = boxes.low[k][lane], high = boxes.high[k][lane];
      box.middle += from_tree_.col(k) * ((low + high) / 2);
      box.halves.col(k) = from_tree_.col(k) * ((high - low) / 2);
    }
    return box;
  }

  template <typename Point>
  fcl::Vector3d between(const Point& a, const Point& b, double share, std::uint8_t,
                        fcl::Vector3d&) const {
    return a.x + share * (b.x - a.x);
  }
  template <typename Point>
  double length(const Point& a, const Point& b, std::uint8_t) const {
    return (b.x - a.x).norm();
  }
  template <typename Point>
  Bulge bulge(const Point&, const Point&, const Point&, std::uint8_t) const {
    return {};
  }

 private:
  struct Memory {
    /// By vertex: the number of its point in the search; -1: none yet. All are -1 between searches.
    std::vector<int> numbers;
    std::vector<unsigned> used;  ///< vertices that have a number
  };

  /// Adds the boxes, or triangles, of a node.
  template <typename Search>
  void openBox(int index, Search& search, int hint) {
    const WideNode& node = mesh_.tree().nodes()[index];
    for (unsigned i = 0; i < node.count; ++i) {
      if (!node.isLeaf()) {
        search.addBox(index, static_cast<int>(i), hint);
        continue;
      }
      const Int4& corners = mesh_.tree().corners(static_cast<unsigned>(node.first) + i);
      search.addTriangle(pointOf(corners[0], search), pointOf(corners[1], search),
                         pointOf(corners[2], search), 0, hint);
    }
  }
  /// Returns the number of a vertex's point in the search. All triangles of the vertex share it.
  template <typename Search>
  int pointOf(int vertex, Search& search) {
    const auto v = static_cast<unsigned>(vertex);
    int& number = memory_->numbers[v];
    if (number >= 0) return number;
    memory_->used.push_back(v);
    return number = search.add(to_target_(mesh_.mesh.vertices[v]));
  }

  const PlacedMesh& mesh_;
  const RelativePlacement to_target_;
  const Leased<Memory> memory_;
  fcl::Matrix3d from_tree_;  ///< linear map of the tree's coordinates to the target's frame
  fcl::Vector3d origin_;     ///< of the tree's coordinates, in the target's frame
};

/// Calls visit(triangle, x, target) for each component of a mesh that is inside a closed one, until
/// `visit` returns false; x is the first corner of that triangle, in the frame of `around`. The
/// surfaces must not touch, so that one vertex decides for its component. If they are nearer than
/// the rounding error of a transformed vertex, either answer is possible.
template <typename Visit>
void visitContained(const PlacedMesh& mesh, const PlacedMesh& around, const Visit& visit) {
  const RelativePlacement to_around(around.tf, mesh.tf);
  MeshTarget target(around);
  if (target.isClear(to_around(mesh.bounds().aabb_center), 1.01 * mesh.bounds().aabb_radius))
    return;
  for (const unsigned triangle : mesh.mesh.topology->components.firstTriangles()) {
    const fcl::Vector3d x = to_around(mesh.mesh.vertices[mesh.mesh.view().verticesOf(triangle)[0]]);
    if (target.isInside(x) && !visit(static_cast<int>(triangle), x, target)) return;
  }
}

/// Whether a component of a mesh is inside a closed one. The surfaces must not touch.
inline bool isContained(const PlacedMesh& mesh, const PlacedMesh& around) {
  bool is_contained = false;
  visitContained(mesh, around, [&](int, const fcl::Vector3d&, MeshTarget&) {
    is_contained = true;
    return false;
  });
  return is_contained;
}

}  // namespace adaptive_bvh
