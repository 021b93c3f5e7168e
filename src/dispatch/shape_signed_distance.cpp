// Signed distances of a closed mesh and a shape: the depths of both surfaces, by branch and bound.
#include <limits>

#include "dispatch/separating_motion.h"
#include "dispatch/shape_search.h"
#include "query/closed_surface.h"
#include "query/depth/depth_meshes.h"
#include "query/depth/depth_search.h"
#include "query/depth/signed_distance.h"
#include "solids/hull.h"

namespace adaptive_bvh {
namespace {

/// A shape as the target of DepthSearch, in its own frame. Supporting planes bound the depth. (The
/// functions of target and source are described at DepthSearch.)
class ShapeTarget {
 public:
  static constexpr bool kIsConvex = true;
  /// A supporting plane n x = d, beyond which no point of the shape lies. No point in the shape is
  /// deeper than its distance from this plane.
  struct Witness {
    fcl::Vector3d n = fcl::Vector3d::Zero();
    double d = 0;
  };
  struct WitnessBound {
    Witness plane;
    double operator()(const fcl::Vector3d& x) const { return plane.d - plane.n.dot(x); }
  };

  explicit ShapeTarget(const Solid& shape) : shape_(shape) {}

  WitnessBound boundBy(const Witness& plane) const { return {plane}; }
  double overBox(const WitnessBound& bound, const OrientedBox& box) const {
    return bound(box.middle) + (bound.plane.n.transpose() * box.halves).cwiseAbs().sum();
  }
  void measure(DepthPoint<Witness>& point, const Witness&) const {
    const ShapeSurface found = shape_.surface(point.x);
    point.distance = std::abs(found.distance);
    point.side = found.distance < 0 ? SurfaceSide::Inside : SurfaceSide::Outside;
    point.witness = {found.outward, found.outward.dot(shape_.support(found.outward))};
  }
  bool isInside(const fcl::Vector3d& x) const { return shape_.surface(x).distance < 0; }
  bool isClear(const fcl::Vector3d&, double) const { return false; }
  /// Bounds by planes are negative outside, so `touches` and `crossing` are not needed.
  bool touches(const std::array<fcl::Vector3d, 3>&, const Bulge&) const { return true; }
  double crossing(const Witness&, const fcl::Vector3d&, const fcl::Vector3d&) const { return -1; }
  fcl::Vector3d outward(const fcl::Vector3d& x) const { return shape_.surface(x).outward; }
  void findNearest(const DepthPoint<Witness>& point, DepthBounds& bounds) const {
    const ShapeSurface found = shape_.surface(point.x);
    bounds.nearest = found.nearest;
    bounds.outward = found.outward;
  }

 private:
  const Solid& shape_;
};

/// The surface of a shape as the source of DepthSearch, in the target's frame.
class ShapeSource {
 public:
  using Vector = fcl::Vector3d;

  ShapeSource(const Solid& shape, const RelativePlacement& to_target)
      : shape_(shape), to_target_(to_target) {}

  template <typename Search>
  void start(Search& search) {
    const int hint = search.addMeasured(to_target_.T, -1);
    std::vector<SurfacePatch> patches;
    shape_.addPatches(patches);
    for (const SurfacePatch& patch : patches) {
      const auto add = [&](const Vector& parameter) {
        return search.add(to_target_(patch.chart(parameter)), parameter);
      };
      const int a = add(patch.p), b = add(patch.q), c = add(patch.r);
      search.addTriangle(a, b, c, numberOf(patch.chart), hint);
    }
  }
  template <typename Search>
  void openBox(int, int, Search&, int) const {}
  OrientedBox boxOf(int, int) const { return {}; }

  template <typename Point>
  Vector between(const Point& a, const Point& b, double share, std::uint8_t chart,
                 Vector& parameter) const {
    parameter = charts_[chart].between(a.parameter, b.parameter, share);
    return to_target_(charts_[chart](parameter));
  }
  template <typename Point>
  double length(const Point& a, const Point& b, std::uint8_t chart) const {
    return charts_[chart].length(a.parameter, b.parameter);
  }
  template <typename Point>
  Bulge bulge(const Point& a, const Point& b, const Point& c, std::uint8_t chart) const {
    Bulge bulge = charts_[chart].bulge(a.parameter, b.parameter, c.parameter);
    for (Vector& offset : bulge.offsets) offset = to_target_.R * offset;
    return bulge;
  }

 private:
  /// The index of a chart in charts_.
  std::uint8_t numberOf(const SurfaceChart& chart) {
    for (std::uint8_t i = 0; i < count_; ++i)
      if (charts_[i] == chart) return i;
    charts_[count_] = chart;
    return count_++;
  }

  const Solid& shape_;
  const RelativePlacement to_target_;
  std::array<SurfaceChart, 3> charts_ = {SurfaceChart::flat(), SurfaceChart::flat(),
                                         SurfaceChart::flat()};
  std::uint8_t count_ = 0;  ///< of charts_ in use
};

/// Computes the signed distance of a mesh and a shape.
class MeshAndShape {
 public:
  MeshAndShape(const PlacedMesh& mesh, const ShapeSolid& shape, const fcl::Transform3d& shape_tf,
               double tolerance)
      : mesh_(mesh),
        shape_(shape),
        shape_tf_(shape_tf),
        to_shape_(shape_tf_, mesh_.tf),
        to_mesh_(mesh_.tf, shape_tf_),
        precision_(mesh_.tf, shape_tf_, size(), tolerance),
        result_(mesh_.tf, shape_tf_, precision_) {}

  /// Throws std::invalid_argument for a plane, and if the faces of a convex do not enclose it.
  SignedDistance distance() const {
    if (const HullSolid* hull = shape_->hull()) return distanceTo(FacedHull(*hull));
    const FlatSolid* const flat = shape_->flat();
    if (!flat) return distanceTo(*shape_);
    if (!flat->isSolid())
      throw std::invalid_argument(
          "adaptive_bvh: there is no signed distance to a plane, which has no inside");
    return distanceToHalfSpace(*flat);
  }

 private:
  /// The signed distance to a bounded shape.
  SignedDistance distanceTo(const Solid& solid) const {
    const ShapeTarget target(solid);
    const Nearest nearest = findNearest();
    const TriangleGap& gap = nearest.gap;
    MeshTarget mesh_target(mesh_);
    if (gap.distance > 0 && !mesh_target.isInside(to_mesh_(solid.innerPoint())))
      return result_.apart(gap, false, target.outward(gap.points.second));
    Depths depths;
    if (gap.distance > 0)
      depths.in_mesh =
          depthInMesh(solid, depthAt(to_mesh_(gap.points.second), mesh_target, precision_.error()));
    else
      depths = depthsOf(solid, nearest);
    SignedDistance found =
        depths.in_shape.is_found || depths.in_mesh.is_found
            ? result_.inside(depths.in_shape, depths.in_mesh)
            : result_.touching(gap, false, target.outward(gap.points.second),
                               std::max(depths.in_shape.upper, depths.in_mesh.upper));
    found.searches = depths.in_shape.searches + depths.in_mesh.searches;
    return found;
  }
  /// The deepest point of the mesh's surface is a vertex. No point of the plane is deeper in the
  /// mesh: its perpendicular into the half-space reaches the mesh's surface at that depth or below.
  SignedDistance distanceToHalfSpace(const FlatSolid& solid) const {
    const fcl::Vector3d& n = solid.normal();
    const double d = solid.offset();
    TriangleGap lowest;
    lowest.distance = std::numeric_limits<double>::infinity();
    for (unsigned t = 0; t < unsigned(mesh_.mesh.numTriangles()); ++t)
      for (const fcl::Vector3d& p : mesh_.pointsOf(t)) {
        const fcl::Vector3d x = to_shape_(p);
        const double height = n.dot(x) - d;
        if (height < lowest.distance) lowest = {{x, x - height * n}, height};
      }
    if (lowest.distance > 0) return result_.apart(lowest, false, n);
    if (lowest.distance == 0) return result_.touching(lowest, false, n, 0);
    DepthBounds bounds;
    bounds.lower = bounds.upper = -lowest.distance;
    bounds.is_found = true;
    bounds.x = lowest.points.first;
    bounds.nearest = lowest.points.second;
    bounds.outward = n;
    return result_.inside(bounds, {});
  }

  /// Depths of the mesh's surface in the shape, and of the shape's surface in the mesh.
  struct Depths {
    DepthBounds in_shape, in_mesh;
  };
  struct Nearest {
    TriangleGap gap;  ///< in the frame of the shape
    unsigned triangle;
  };

  /// The depths of surfaces that touch. A ball that rolls inside a round shape, or a separating
  /// motion, bounds the depth of the shape's surface; else it is searched. docs/bounds.md, 19.
  Depths depthsOf(const Solid& solid, const Nearest& nearest) const {
    const bool is_round = solid.rollingRadius() > 0;
    Depths depths;
    DepthBounds &in_shape = depths.in_shape, &in_mesh = depths.in_mesh;
    ShapeTarget target(solid);
    in_shape = depthAt(nearest.gap.points.first, target, precision_.error());
    SeparatingMotion motion(mesh_, {solid, shape_tf_}, shape_.core(), precision_);
    motion.raiseTo(in_shape.lower);
    if (!is_round && motion.isFound(SurfaceNormals(mesh_.mesh).ofFace(nearest.triangle))) {
      in_mesh = motion.deepest();
      return depths;
    }
    if (motion.deepest().is_found) in_shape = DepthBounds::from(motion.deepest().lower);
    in_shape = depthInShape(solid, in_shape);
    motion.raiseTo(in_shape.lower);
    const bool is_out = !is_round || !MeshTarget(mesh_).isInside(to_mesh_(solid.innerPoint()));
    if (is_out && in_shape.upper + 4 * precision_.error() < solid.rollingRadius()) {
      in_mesh.upper = in_shape.upper;
    } else if (is_out && in_shape.is_found && motion.isFound(to_mesh_.R * -in_shape.outward)) {
      in_mesh = motion.deepest();
      in_shape.upper = in_mesh.upper;
    } else {
      in_mesh = depthInMesh(solid, motion.deepest());
      in_mesh.searches += motion.deepest().searches;
    }
    return depths;
  }
  DepthBounds depthInShape(const Solid& solid, const DepthBounds& known) const {
    MeshSource source(mesh_, to_shape_);
    ShapeTarget target(solid);
    return DepthSearch<MeshSource, ShapeTarget>(source, target, precision_.tolerance(), known)
        .run();
  }
  DepthBounds depthInMesh(const Solid& solid, const DepthBounds& known) const {
    ShapeSource source(solid, to_mesh_);
    MeshTarget target(mesh_);
    return DepthSearch<ShapeSource, MeshTarget>(source, target, precision_.tolerance(), known)
        .run();
  }
  /// Upper bound of the coordinates of both bodies, in the frame of either.
  double size() const {
    const ShapeCore& core = shape_.core();
    const fcl::Vector3d largest = core.low.cwiseAbs().cwiseMax(core.high.cwiseAbs());
    return mesh_.bounds().aabb_center.norm() + mesh_.bounds().aabb_radius +
           (core.isBounded() ? largest.norm() + core.radius : 0) + to_shape_.T.norm();
  }

  Nearest findNearest() const {
    const MeshShapeSearch search(mesh_, {*shape_, shape_tf_}, shape_.core());
    const fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    distanceToShape(search, {request, result});
    const auto triangle = static_cast<int>(result.b1);
    return {search.triangles.gap(triangle), static_cast<unsigned>(triangle)};
  }

  const PlacedMesh& mesh_;
  const ShapeSolid& shape_;
  const fcl::Transform3d shape_tf_;
  const RelativePlacement to_shape_, to_mesh_;
  const DepthPrecision precision_;
  const SignedDistanceResult result_;
};

}  // namespace

SignedDistance signedDistance(const DeformableMesh& first, const fcl::Transform3d& tf1,
                              const fcl::CollisionGeometryd& second, const fcl::Transform3d& tf2,
                              double tolerance) {
  if (const auto* mesh = dynamic_cast<const DeformableMesh*>(&second))
    return signedDistance(first, tf1, *mesh, tf2, tolerance);
  requireTolerance(tolerance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireClosed(stateOf(first), "signedDistance");
  const ShapeSolid shape(second);
  const PlacedMesh mesh(first, tf1);
  return MeshAndShape(mesh, shape, tf2, tolerance).distance();
}

}  // namespace adaptive_bvh
