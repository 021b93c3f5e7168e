#include "query/nearest_pair.h"

#include "geometry/mesh_of_model.h"
#include "query/nearest_points.h"

namespace adaptive_bvh {
namespace {

/// The distance of two triangles is off by some epsilon of what their coordinates are made of: the
/// second's are placed in the first's frame.
template <typename BV>
typename BV::S roundingOf(const fcl::Vector3<typename BV::S>& T, const PlacedMesh<BV>& first,
                          const PlacedMesh<BV>& second) {
  using S = typename BV::S;
  const auto size = [](const BoxTree<S>& boxes) -> S {
    return boxes.middle().template lpNorm<1>() +
           S(float4::sum(boxes.root().halfSides())) * boxes.frame.unit();
  };
  return 8 * rounding::epsilon<S>() *
         (T.template lpNorm<1>() + size(*first.tree->boxes) + size(*second.tree->boxes));
}

}  // namespace

template <typename BV>
NearestPair<BV>::NearestPair(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                             const DistanceQuery<S>& query)
    : first_(first),
      second_(second),
      request_(query.request),
      result_(query.result),
      triangles_(first.model->vertices, first.tf, second.model->vertices, second.tf),
      rounding_(roundingOf(triangles_.T(), first, second)) {
  setLimit();
}

/// FCL goes on below a pair unless its bound c meets c >= min - abs_err and c (1 + rel_err) >= min.
template <typename BV>
void NearestPair<BV>::setLimit() {
  limit_ = std::max(result_.min_distance - request_.abs_err,
                    result_.min_distance / (1 + request_.rel_err));
}

template <typename BV>
void NearestPair<BV>::improve(S distance, int triangle1, int triangle2, const Point& on1,
                              const Point& on2) {
  if (request_.enable_nearest_points)
    result_.update(distance, first_.model, second_.model, triangle1, triangle2, on1, on2);
  else
    result_.update(distance, first_.model, second_.model, triangle1, triangle2);
  improved_ = true;
  setLimit();
  triangles_.lookAlong(on1, on2);
}

template <typename BV>
void NearestPair<BV>::addWitness(int triangle1, int triangle2) {
  if (triangle1 < 0 || triangle1 >= first_.model->num_tris || triangle2 < 0 ||
      triangle2 >= second_.model->num_tris)
    return;
  Point on1, on2;
  const S d = triangles_.distance(viewOf(*first_.model).verticesOf(unsigned(triangle1)),
                                  viewOf(*second_.model).verticesOf(unsigned(triangle2)), on1, on2);
  ++tests_;
  if (d < result_.min_distance)
    improve(d, triangle1, triangle2, on1, on2);
  else
    triangles_.lookAlong(on1, on2);
}

template <typename BV>
auto NearestPair<BV>::boundsOf(unsigned open, unsigned kept, const TriangleBlock& block,
                               double unit, double off) const -> Float4x4 {
  const auto enough =
      kept ? std::numeric_limits<float>::infinity()
           : static_cast<float>((double(limit_) + off) / unit * (1 + 1. / (1 << 20)));
  const unsigned pairs = open | kept;
  Float4x4 bounds;
  if (pairs & 0x000f) bounds.row[0] = block.bounds<0>(enough, pairs & 15);
  if (pairs & 0x00f0) bounds.row[1] = block.bounds<1>(enough, pairs >> 4 & 15);
  if (pairs & 0x0f00) bounds.row[2] = block.bounds<2>(enough, pairs >> 8 & 15);
  if (pairs & 0xf000) bounds.row[3] = block.bounds<3>(enough, pairs >> 12 & 15);
  return bounds;
}

/// Returns a lower bound of the distance of two triangles. `bound`: one in single precision;
/// `slack`: by so much one along the same lines may be larger in double precision.
template <typename BV>
double NearestPair<BV>::testPair(const MeshTriangle& first, const MeshTriangle& second,
                                 double bound, double slack) {
  const VertexIndices &a = first.corners, &b = second.corners;
  if (bound + slack >= double(limit_)) {
    S separation = triangles_.separation(a, b);
    if (separation < limit_)
      separation = std::max(separation, triangles_.separationNearby(a, b, limit_));
    bound = std::max(bound, double(separation));
    if (separation >= limit_) return bound;
  }
  Point on1, on2;
  const S d = triangles_.distance(a, b, on1, on2);
  ++tests_;
  if (d < result_.min_distance) improve(d, first.index, second.index, on1, on2);
  return bound;
}

/// As in FCL's traversal, nearest points are in the frame of the first object until the end.
template <typename BV>
bool NearestPair<BV>::finish() {
  if (!improved_) return false;
  for (auto& point : result_.nearest_points) point = first_.tf * point;
  settleNearestPoints<BV>(first_, second_, {request_, result_});
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class NearestPair<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
