#include <limits>

#include "fcl/mesh_pairs.h"
#include "fcl/shape_depth.h"
#include "fcl/shape_search.h"
#include "fcl/shape_surfaces.h"
#include "query/closed_surface.h"
#include "query/depth_meshes.h"
#include "query/signed_distance.h"

namespace adaptive_bvh {
namespace {

/// The surface of a shape, for DepthSearch, in the target's frame.
template <typename AddPatches>
class ShapeSource {
 public:
  using Vector = fcl::Vector3d;

  ShapeSource(const AddPatches& addPatches, const RelativePlacement& to_target)
      : addPatches_(addPatches), to_target_(to_target) {}

  template <typename Search>
  void start(Search& search) {
    const int hint = search.addMeasured(to_target_.T, -1);
    addPatches_([&](const SurfaceChart& chart, const Vector& p, const Vector& q, const Vector& r) {
      const auto add = [&](const Vector& parameter) {
        return search.add(to_target_(chart(parameter)), parameter);
      };
      const int a = add(p), b = add(q), c = add(r);
      search.addTriangle(a, b, c, numberOf(chart), hint);
    });
  }
  template <typename Search>
  void openBox(int, int, Search&, int) const {}
  TurnedBox boxOf(int, int) const { return {}; }

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
  double deviation(const Point& a, const Point& b, const Point& c, std::uint8_t chart) const {
    return charts_[chart].deviation(a.parameter, b.parameter, c.parameter);
  }

 private:
  /// Patches of one chart follow each other.
  std::uint8_t numberOf(const SurfaceChart& chart) {
    for (std::uint8_t i = 0; i < count_; ++i)
      if (charts_[i] == chart) return i;
    charts_[count_] = chart;
    return count_++;
  }

  const AddPatches& addPatches_;
  const RelativePlacement to_target_;
  std::array<SurfaceChart, 3> charts_ = {SurfaceChart::flat(), SurfaceChart::flat(),
                                         SurfaceChart::flat()};
  std::uint8_t count_ = 0;
};

/// A mesh and a shape.
template <typename S>
class MeshAndShape {
 public:
  MeshAndShape(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& shape, S tolerance)
      : mesh_(mesh),
        shape_(shape),
        to_shape_(shape.tf, mesh.tf),
        to_mesh_(mesh.tf, shape.tf),
        precision_(mesh.tf, shape.tf, size(), tolerance),
        result_(mesh.tf, shape.tf, precision_) {}

  SignedDistance<S> distance() const {
    SignedDistance<S> found;
    visitSolid(*shape_.geometry, [&](const auto& target, const auto& addPatches) {
      found = distanceTo(target, addPatches);
    });
    return found;
  }
  /// The deepest point of the mesh's surface is a vertex. A point of the plane is no deeper: from
  /// there straight on into the half-space the mesh's surface is reached, which is deeper.
  SignedDistance<S> distanceToHalfSpace(const fcl::Halfspace<S>& solid) const {
    const fcl::Vector3d n = solid.n.template cast<double>() / double(solid.n.norm());
    const double d = double(solid.d) / double(solid.n.norm());
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

 private:
  double size() const {
    double shape = 0;
    visitShape(*shape_.geometry, [&](const TriangleShape&, const ShapeCore& core) {
      const fcl::Vector3d far = core.low.cwiseAbs().cwiseMax(core.high.cwiseAbs());
      shape = core.isBounded() ? far.norm() + core.radius : 0;
    });
    const auto& mesh = *mesh_.geometry;
    return double(mesh.aabb_center.norm()) + double(mesh.aabb_radius) + shape + to_shape_.T.norm();
  }

  /// The nearest points, in the frame of the shape.
  TriangleGap nearest() const {
    const fcl::DistanceRequest<S> request;
    fcl::DistanceResult<S> result;
    meshShapeDistance<S>(mesh_, shape_, {request, result});
    TriangleGap gap;
    visitShape(*shape_.geometry, [&](const TriangleShape& shape, const ShapeCore& core) {
      const MeshShapeSearch<S> search(mesh_, shape, core, shape_.tf);
      gap = search.triangles.gap(static_cast<int>(result.b1));
    });
    return gap;
  }

  template <typename Target, typename AddPatches>
  SignedDistance<S> distanceTo(Target target, const AddPatches& addPatches) const {
    const TriangleGap gap = nearest();
    const double tolerance = precision_.tolerance();
    MeshTarget<S> mesh_target(mesh_);
    if (gap.distance > 0 && !mesh_target.isInside(innerPoint()))
      return result_.apart(gap, false, target.outward(gap.points.second));
    DepthBounds in_shape = DepthBounds::from(precision_.error()), in_mesh = in_shape;
    if (gap.distance > 0) {
      in_mesh = depthAt(to_mesh_(gap.points.second), mesh_target, precision_.error());
    } else {
      MeshSource<S> source(mesh_, to_shape_);
      in_shape =
          DepthSearch<MeshSource<S>, Target>(source, target, tolerance,
                                             depthAt(gap.points.first, target, precision_.error()))
              .run();
      in_mesh = DepthBounds::from(in_shape.lower);
    }
    ShapeSource<AddPatches> source(addPatches, to_mesh_);
    in_mesh =
        DepthSearch<ShapeSource<AddPatches>, MeshTarget<S>>(source, mesh_target, tolerance, in_mesh)
            .run();
    SignedDistance<S> found = in_shape.is_found || in_mesh.is_found
                                  ? result_.inside(in_shape, in_mesh)
                                  : result_.touching(gap, false, target.outward(gap.points.second),
                                                     std::max(in_shape.upper, in_mesh.upper));
    found.searches = in_shape.searches + in_mesh.searches;
    return found;
  }
  /// A point in the shape, where the mesh sees it.
  fcl::Vector3d innerPoint() const {
    fcl::Vector3d middle = fcl::Vector3d::Zero();
    if (shape_.geometry->getNodeType() == fcl::GEOM_CONVEX)
      middle = static_cast<const fcl::Convex<S>&>(*shape_.geometry)
                   .getInteriorPoint()
                   .template cast<double>();
    return to_mesh_(middle);
  }

  const PlacedMesh<S> mesh_;
  const PlacedGeometry<S> shape_;
  const RelativePlacement to_shape_, to_mesh_;
  const DepthPrecision precision_;
  const SignedDistanceResult<S> result_;
};

}  // namespace

template <typename S>
SignedDistance<S> signedDistance(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                                 const fcl::CollisionGeometry<S>& second,
                                 const fcl::Transform3<S>& tf2, S tolerance) {
  if (const auto* mesh = dynamic_cast<const DeformableMesh<S>*>(&second))
    return signedDistance(first, tf1, *mesh, tf2, tolerance);
  requireTolerance(tolerance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireClosed(stateOf(first), "signedDistance");
  requireSolid(second);
  const MeshAndShape<S> pair({first, tf1}, {&second, tf2}, tolerance);
  if (second.getNodeType() == fcl::GEOM_HALFSPACE)
    return pair.distanceToHalfSpace(static_cast<const fcl::Halfspace<S>&>(second));
  return pair.distance();
}

template SignedDistance<float> signedDistance(const DeformableMesh<float>&,
                                              const fcl::Transform3<float>&,
                                              const fcl::CollisionGeometry<float>&,
                                              const fcl::Transform3<float>&, float);
template SignedDistance<double> signedDistance(const DeformableMesh<double>&,
                                               const fcl::Transform3<double>&,
                                               const fcl::CollisionGeometry<double>&,
                                               const fcl::Transform3<double>&, double);

}  // namespace adaptive_bvh
