#pragma once

#include <algorithm>
#include <cmath>

#include "adaptive_bvh/point_query.h"
#include "deformable/mesh_state.h"
#include "triangles/feature_distance.h"
#include "triangles/orientation.h"

namespace adaptive_bvh {

/// A point of the surface of a mesh: its feature, and where it is on a triangle.
struct SurfacePlace {
  SurfaceFeature feature;
  unsigned triangle;
  std::size_t corner;  ///< of the triangle: the vertex, or the start of the edge; 0 for a face
  fcl::Vector3d barycentric;
};

/// Outward normals of a mesh in its present state. Triangles are assumed to face outward.
class SurfaceNormals {
 public:
  explicit SurfaceNormals(const MeshState& mesh) : mesh_(mesh) {}

  /// Returns the triangle's point that is nearest to x. (x is in the mesh's frame.)
  SurfacePlace nearestPlace(const fcl::Vector3d& x, unsigned triangle) const {
    fcl::Vector3d on_face;
    feature_distance::FacePlace place;
    feature_distance::Face(cornersOf(triangle)).distance(x, on_face, place);
    return placeOf(place, triangle);
  }
  /// Converts a place on a triangle.
  static SurfacePlace placeOf(const feature_distance::FacePlace& on_face, unsigned triangle) {
    const std::size_t edge = on_face.edge;
    SurfacePlace place = {SurfaceFeature::Face, triangle, 0, fcl::Vector3d::Zero()};
    const auto weight = [&](std::size_t k) -> double& {
      return place.barycentric[static_cast<Eigen::Index>(k)];
    };
    weight(edge) = 1 - on_face.along - on_face.share;
    weight((edge + 1) % 3) = on_face.along;
    weight((edge + 2) % 3) = on_face.share;
    if (on_face.is_inside) return place;
    place.feature = on_face.along == 0 ? SurfaceFeature::Vertex : SurfaceFeature::Edge;
    place.corner = edge;
    return place;
  }
  /// Converts the place on a triangle that is nearest to x. If x is exactly on a side, so is the
  /// place, which may be inside by rounding.
  SurfacePlace placeOf(const fcl::Vector3d& x, const feature_distance::FacePlace& on_face,
                       unsigned triangle) const {
    SurfacePlace place = placeOf(on_face, triangle);
    const auto p = cornersOf(triangle);
    for (std::size_t k = 0; k < 3 && place.feature == SurfaceFeature::Face; ++k) {
      double& opposite = place.barycentric[int((k + 2) % 3)];
      if (!areOnALine(p[k], p[(k + 1) % 3], x)) continue;
      place.feature = SurfaceFeature::Edge;
      place.corner = k;
      place.barycentric[int(k)] += opposite;
      opposite = 0;
    }
    return place;
  }

  /// The normal of a triangle, of length 1; zero if the triangle has no area.
  fcl::Vector3d ofFace(unsigned triangle) const {
    const auto p = cornersOf(triangle);
    fcl::Vector3d edges[3] = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
    enlarge(edges);
    std::size_t longest = 0;  // the product of the other two has the smallest error
    for (std::size_t k = 1; k < 3; ++k)
      if (edges[k].squaredNorm() > edges[longest].squaredNorm()) longest = k;
    return edges[(longest + 1) % 3].cross(edges[(longest + 2) % 3]).stableNormalized();
  }

  /// The angle-weighted pseudo-normal (VertexContacts::normals), of length 1, or zero.
  fcl::Vector3d at(const SurfacePlace& place) const {
    if (place.feature == SurfaceFeature::Face) return ofFace(place.triangle);
    const VertexIndices v = verticesOf(place.triangle);
    const unsigned vertex = v[place.corner], end = v[(place.corner + 1) % 3];
    return place.feature == SurfaceFeature::Vertex ? ofVertex(vertex) : ofEdge(vertex, end);
  }

  /// The number of the feature: of the vertex, the edge (feature_pairs.h) or the triangle.
  unsigned numberOf(const SurfacePlace& place) const {
    if (place.feature == SurfaceFeature::Face) return place.triangle;
    const VertexIndices v = verticesOf(place.triangle);
    const unsigned vertex = v[place.corner], end = v[(place.corner + 1) % 3];
    if (place.feature == SurfaceFeature::Vertex) return vertex;
    for (const unsigned t : mesh_.topology->vertex_triangles[vertex])
      for (unsigned k = 0; k < 3; ++k)
        if (isEdge(t, k, vertex, end)) return 3 * t + k;
    return 3 * place.triangle + static_cast<unsigned>(place.corner);
  }

 private:
  VertexIndices verticesOf(unsigned triangle) const { return mesh_.view().verticesOf(triangle); }
  fcl::Vector3d point(unsigned vertex) const { return mesh_.vertices[vertex]; }
  std::array<fcl::Vector3d, 3> cornersOf(unsigned triangle) const {
    const VertexIndices v = verticesOf(triangle);
    return {point(v[0]), point(v[1]), point(v[2])};
  }
  /// Scales short vectors by a common factor, so that their products do not underflow.
  template <std::size_t kCount>
  static void enlarge(fcl::Vector3d (&vectors)[kCount]) {
    double extent = 0;
    for (const fcl::Vector3d& v : vectors) extent = std::max(extent, v.lpNorm<Eigen::Infinity>());
    const double unit = rounding::enlargement(extent);
    if (unit != 1)
      for (fcl::Vector3d& v : vectors) v *= unit;
  }
  /// Whether edge k of a triangle is between the vertices a and b.
  bool isEdge(unsigned triangle, std::size_t k, unsigned a, unsigned b) const {
    const VertexIndices v = verticesOf(triangle);
    const unsigned from = v[k], to = v[(k + 1) % 3];
    return (from == a && to == b) || (from == b && to == a);
  }

  /// The weight of a triangle is its angle at the vertex.
  fcl::Vector3d ofVertex(unsigned vertex) const {
    return mean(vertex, [&](unsigned t) {
      const VertexIndices v = verticesOf(t);
      const std::size_t k = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
      fcl::Vector3d sides[2] = {point(v[(k + 1) % 3]) - point(vertex),
                                point(v[(k + 2) % 3]) - point(vertex)};
      enlarge(sides);
      return std::atan2(sides[0].cross(sides[1]).norm(), sides[0].dot(sides[1]));
    });
  }
  fcl::Vector3d ofEdge(unsigned a, unsigned b) const {
    return mean(a, [&](unsigned t) {
      return isEdge(t, 0, a, b) || isEdge(t, 1, a, b) || isEdge(t, 2, a, b) ? 1. : 0.;
    });
  }
  /// Weighted mean of the normals of a vertex's triangles, of length 1; if they cancel each other,
  /// the normal of the first triangle that has an area. weightOf(triangle): 0 if it does not count.
  template <typename Weight>
  fcl::Vector3d mean(unsigned vertex, const Weight& weightOf) const {
    constexpr double kCancelled = 1e-12;  // length of the mean that is rounding only
    fcl::Vector3d sum = fcl::Vector3d::Zero(), first = sum;
    double weights = 0;
    for (const unsigned t : mesh_.topology->vertex_triangles[vertex]) {
      const double weight = weightOf(t);
      if (!(weight > 0)) continue;
      const fcl::Vector3d normal = ofFace(t);
      if (first.isZero(0)) first = normal;
      sum += weight * normal;
      weights += weight;
    }
    return sum.norm() > kCancelled * weights ? fcl::Vector3d(sum.normalized()) : first;
  }

  const MeshState& mesh_;
};

}  // namespace adaptive_bvh
