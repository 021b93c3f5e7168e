#pragma once

#include "geometry/triangle_gap.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// The distance of the triangles of a mesh or model and a shape. `Search`: MeshShapeSearch or
/// ModelShapeSearch. All that depends on the type of the shape is behind TriangleShape.
template <typename S, typename Search>
class ShapeDistance {
 public:
  /// Ends where the distance is at most `enough`.
  ShapeDistance(const PlacedGeometry<S>& shape, const Search& search, const DistanceQuery<S>& query,
                S enough)
      : shape_(shape), search_(search), query_(query), enough_(enough) {}

  void run() const {
    search_.nearest(query_, [&](int triangle) { return take(triangle); });
    const fcl::DistanceResult<S>& result = query_.result;
    if (result.o1 != object() || result.o2 != shape_.geometry) return;
    if (result.min_distance <= 0 && query_.request.enable_signed_distance) takeDepth();
  }

 private:
  const fcl::CollisionGeometry<S>* object() const { return search_.triangles.placed().geometry; }

  bool take(int triangle) const {
    const TriangleGap gap = search_.triangles.gap(triangle);
    if (!(gap.distance < double(query_.result.min_distance))) return false;
    query_.result.update(distanceAs<S>(gap.distance), object(), shape_.geometry, triangle,
                         fcl::DistanceResult<S>::NONE, search_.triangles.inWorld(gap.points.first),
                         search_.triangles.inWorld(gap.points.second));
    return query_.isSatisfied() || query_.result.min_distance <= enough_;
  }

  /// The deepest triangle's depth, negative.
  void takeDepth() const {
    fcl::DistanceResult<S>& result = query_.result;
    double deepest = -1;
    search_.touching([&](int triangle) {
      ShapeContact contact;
      if (!search_.triangles.touches(triangle, contact) || !(contact.depth > deepest)) return false;
      deepest = contact.depth;
      result.b1 = triangle;
      result.nearest_points[0] = result.nearest_points[1] =
          search_.triangles.inWorld(contact.position);
      return false;
    });
    result.min_distance = deepest > 0 ? static_cast<S>(-deepest) : S(0);
  }

  const PlacedGeometry<S>& shape_;
  const Search& search_;
  const DistanceQuery<S>& query_;
  const S enough_;
};

}  // namespace adaptive_bvh
