#include <algorithm>
#include <cmath>

#include "adaptive_bvh/proximity.h"
#include "base/rigid.h"
#include "query/point_search.h"
#include "query/ray_search.h"

namespace adaptive_bvh {
namespace {

/// How often a closed surface winds around a point, by what a ray from there meets: 1 more for each
/// triangle that is left through its front, 1 less for each entered. A ray that meets a side or a
/// corner says nothing; then another one is tried. Where many say nothing, solid angles are summed.
template <typename S>
class WindingNumber {
 public:
  explicit WindingNumber(const MeshState<S>& mesh) : mesh_(mesh), rays_(mesh) {}

  int of(const fcl::Vector3d& x) {
    constexpr int kTries = 16;
    for (int i = 0, number = 0; i < kTries; ++i)
      if (countAlong(x, direction(i), number)) return number;
    return bySolidAngles(x);
  }

 private:
  /// Directions spread over the sphere that no edge of a mesh is likely to have.
  static fcl::Vector3d direction(int i) {
    const double z = 0.87390 - 0.109134 * i, around = 0.4321 + 2.399963229728653 * i,
                 radius = std::sqrt(1 - z * z);
    return {radius * std::cos(around), radius * std::sin(around), z};
  }

  bool countAlong(const fcl::Vector3d& x, const fcl::Vector3d& along, int& number) {
    bool is_certain = true;
    number = 0;
    rays_.search(x, along, [&](int, const RayTriangle::Hit& hit) {
      is_certain = is_certain && !hit.is_on_a_side;
      number += hit.is_front ? 1 : -1;
      return is_certain ? std::numeric_limits<double>::infinity() : -1;
    });
    return is_certain;
  }

  /// Van Oosterom and Strackee 1983, "The solid angle of a plane triangle".
  int bySolidAngles(const fcl::Vector3d& x) const {
    using Point = Eigen::Matrix<long double, 3, 1>;
    long double sum = 0;
    for (int i = 0; i < mesh_.numTriangles(); ++i) {
      const VertexIndices v = mesh_.view().verticesOf(static_cast<unsigned>(i));
      Point p[3];
      long double length[3];
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = mesh_.vertices[v[k]].template cast<long double>() - x.template cast<long double>();
        length[k] = p[k].norm();
      }
      sum += std::atan2(p[0].dot(p[1].cross(p[2])),
                        length[0] * length[1] * length[2] + p[0].dot(p[1]) * length[2] +
                            p[1].dot(p[2]) * length[0] + p[2].dot(p[0]) * length[1]);
    }
    return static_cast<int>(std::lround(sum / (2 * std::acos(-1.L))));
  }

  const MeshState<S>& mesh_;
  RaySearch<S> rays_;
};

/// Calls sign(x), for each vertex x where it is in the other's frame, for the sign of its distance.
template <typename S, typename MakeSign>
void findDistances(const MeshState<S>& mesh, const RelativePlacement& to_other,
                   const MeshState<S>& other, S limit, const MakeSign& makeSign,
                   std::vector<S>& result) {
  result.resize(mesh.vertices.size());
  forEachBatch(other.query_threads, result.size(), [&](std::size_t begin, std::size_t end) {
    PointSearch<S> search(other);
    auto sign = makeSign();
    int last = -1;
    for (std::size_t i = begin; i < end; ++i) {
      const fcl::Vector3d x = to_other(mesh.vertices[i]);
      typename PointSearch<S>::Nearest nearest;
      nearest.distance = static_cast<double>(limit);
      if (last >= 0) search.tryTriangle(x, last, nearest);
      search.search(x, nearest);
      if (nearest.triangle >= 0) last = nearest.triangle;
      result[i] = sign(x) * static_cast<S>(nearest.distance);
    }
  });
}

}  // namespace

template <typename S>
void clearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
               const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf, S limit,
               std::vector<S>& result) {
  requireDistance(limit);
  requireRigid(tf);
  requireRigid(other_tf);
  const auto noSign = [] { return [](const fcl::Vector3d&) { return S(1); }; };
  findDistances(stateOf(mesh), RelativePlacement(other_tf, tf), stateOf(other), limit, noSign,
                result);
}

template <typename S>
void signedClearance(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                     const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf, S limit,
                     std::vector<S>& result) {
  requireDistance(limit);
  requireRigid(tf);
  requireRigid(other_tf);
  const MeshState<S>& closed = stateOf(other);
  if (!closed.topology->owners.isClosed())
    throw std::invalid_argument(
        "adaptive_bvh: a signed clearance is asked for to a mesh that is not closed: some edge is "
        "not run through as often in one direction as in the other");
  const auto byWinding = [&] {
    return [number = WindingNumber<S>(closed)](const fcl::Vector3d& x) mutable {
      return number.of(x) != 0 ? S(-1) : S(1);
    };
  };
  findDistances(stateOf(mesh), RelativePlacement(other_tf, tf), closed, limit, byWinding, result);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                     \
  template void clearance(const DeformableMesh<S>&, const fcl::Transform3<S>&,          \
                          const DeformableMesh<S>&, const fcl::Transform3<S>&, S,       \
                          std::vector<S>&);                                             \
  template void signedClearance(const DeformableMesh<S>&, const fcl::Transform3<S>&,    \
                                const DeformableMesh<S>&, const fcl::Transform3<S>&, S, \
                                std::vector<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
