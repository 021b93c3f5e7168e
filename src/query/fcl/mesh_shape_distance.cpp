#include "query/fcl/mesh_shape.h"

#include "query/fcl/mesh_shape_search.h"
#include "query/fcl/shape_geometry.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// One query. All that depends on the type of the shape is behind TriangleShape.
template <typename BV>
class ShapeDistance {
 public:
  using S = typename BV::S;

  ShapeDistance(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& shape,
                const MeshShapeSearch<BV>& search, const DistanceQuery<S>& query, S enough)
      : mesh_(mesh), shape_(shape), search_(search), query_(query), enough_(enough) {}

  void run() const {
    WitnessCache* const witnesses = mesh_.tree ? &mesh_.tree->witnesses : nullptr;
    const unsigned last = witnesses ? witnesses->recall(shape_.geometry).first : 0;
    const int first = last < unsigned(mesh_.model->num_tris) ? int(last) : 0;
    search_.nearest(query_, first, [&](int triangle) { return take(triangle); });
    const fcl::DistanceResult<S>& result = query_.result;
    if (result.o1 != mesh_.model || result.o2 != shape_.geometry) return;
    if (witnesses) witnesses->keep(shape_.geometry, {unsigned(result.b1), 0, false});
    if (result.min_distance <= 0 && query_.request.enable_signed_distance) takeDepth();
  }

 private:
  bool take(int triangle) const {
    const TriangleGap gap = search_.gap(triangle);
    if (!(gap.distance < double(query_.result.min_distance))) return false;
    query_.result.update(distanceAs<S>(gap.distance), mesh_.model, shape_.geometry, triangle,
                         fcl::DistanceResult<S>::NONE, search_.inWorld(gap.points.first),
                         search_.inWorld(gap.points.second));
    return query_.isSatisfied() || query_.result.min_distance <= enough_;
  }

  /// The deepest triangle's depth, negative.
  void takeDepth() const {
    fcl::DistanceResult<S>& result = query_.result;
    double deepest = -1;
    search_.touching([&](int triangle) {
      ShapeContact contact;
      if (!search_.touches(triangle, contact) || !(contact.depth > deepest)) return false;
      deepest = contact.depth;
      result.b1 = triangle;
      result.nearest_points[0] = result.nearest_points[1] = search_.inWorld(contact.position);
      return false;
    });
    result.min_distance = deepest > 0 ? static_cast<S>(-deepest) : S(0);
  }

  const PlacedMesh<BV>& mesh_;
  const PlacedGeometry<S>& shape_;
  const MeshShapeSearch<BV>& search_;
  const DistanceQuery<S>& query_;
  const S enough_;
};

}  // namespace

template <typename BV>
typename BV::S meshShapeDistance(const PlacedMesh<BV>& mesh,
                                 const PlacedGeometry<typename BV::S>& shape,
                                 const DistanceQuery<typename BV::S>& query,
                                 typename BV::S enough) {
  if (query.isSatisfied()) return query.result.min_distance;
  visitShape(*shape.geometry, [&](const TriangleShape& geometry, const ShapeCore& core) {
    const MeshShapeSearch<BV> search(mesh, geometry, core, shape.tf);
    ShapeDistance<BV>(mesh, shape, search, query, enough).run();
  });
  return query.result.min_distance;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template BV::S meshShapeDistance(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&, \
                                   const DistanceQuery<BV::S>&, BV::S);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
