#pragma once

#include <set>
#include <tuple>

#include "adaptive_bvh/feature_pairs.h"
#include "support/meshes.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {

/// Kind, and the vertices that pairs of features have: those of a vertex and a face, or of two
/// edges, each in ascending order. Of a pair there is one, whichever triangles share the features.
using FeatureVertices =
    std::tuple<adaptive_bvh::FeatureKind, std::set<std::size_t>, std::set<std::size_t>>;
using FeatureSet = std::set<FeatureVertices>;

inline quad::Real distance(const quad::Point& a, const quad::Point& b, const quad::Point& c,
                           const quad::Point& d) {
  quad::Real least = std::min({quad::squaredDistance(a, c, d), quad::squaredDistance(b, c, d),
                               quad::squaredDistance(c, a, b), quad::squaredDistance(d, a, b)});
  const quad::Real inside = quad::squaredDistanceInside(a, b, c, d);
  return quad::root(inside >= 0 ? std::min(least, inside) : least);
}

/// All pairs of features of meshes with small whole numbers as coordinates that are at most `limit`
/// apart, a whole number, and `beyond`. Whatever is not within `limit`, is farther by more than
/// 1e-12. `is_self`: of one mesh, without features that have a vertex in common.
inline FeatureSet featurePairs(const TriangleMesh& first, const TriangleMesh& second, int limit,
                               bool is_self = false, double beyond = 1e-12) {
  using adaptive_bvh::FeatureKind;
  FeatureSet pairs;
  const quad::Real most = quad::Real(limit) + quad::Real(beyond);
  const auto of = [](const TriangleMesh& mesh, std::size_t v) {
    return quad::of(mesh.vertices[v]);
  };
  const auto addVertices = [&](const TriangleMesh& mesh, const TriangleMesh& other,
                               FeatureKind kind) {
    for (const fcl::Triangle& face : other.triangles)
      for (const fcl::Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
          const std::size_t v = t[k];
          if (is_self && (v == face[0] || v == face[1] || v == face[2])) continue;
          const quad::Triangle corners = {of(other, face[0]), of(other, face[1]),
                                          of(other, face[2])};
          if (quad::distance(of(mesh, v), corners) <= most)
            pairs.insert({kind, {v}, {face[0], face[1], face[2]}});
        }
  };
  addVertices(first, second, FeatureKind::VertexFace);
  if (!is_self) addVertices(second, first, FeatureKind::FaceVertex);
  for (const fcl::Triangle& s : first.triangles)
    for (const fcl::Triangle& t : second.triangles)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const std::size_t a = s[i], b = s[(i + 1) % 3], c = t[j], d = t[(j + 1) % 3];
          if (is_self && (a == c || a == d || b == c || b == d)) continue;
          if (distance(of(first, a), of(first, b), of(second, c), of(second, d)) > most) continue;
          const std::set<std::size_t> e = {a, b}, f = {c, d};
          pairs.insert(
              {FeatureKind::EdgeEdge, is_self ? std::min(e, f) : e, is_self ? std::max(e, f) : f});
        }
  return pairs;
}

/// What a query found, likewise.
inline FeatureSet featurePairs(const adaptive_bvh::FeaturePairs& found, const TriangleMesh& first,
                               const TriangleMesh& second, bool is_self = false) {
  using adaptive_bvh::FeatureKind;
  FeatureSet pairs;
  const auto face = [](const TriangleMesh& mesh, unsigned t) -> std::set<std::size_t> {
    return {mesh.triangles[t][0], mesh.triangles[t][1], mesh.triangles[t][2]};
  };
  const auto edge = [](const TriangleMesh& mesh, unsigned e) -> std::set<std::size_t> {
    const auto ends = adaptive_bvh::edgeVertices(mesh.triangles.data(), e);
    return {ends[0], ends[1]};
  };
  for (const auto& p : found.vertex_face)
    pairs.insert({FeatureKind::VertexFace, {p.first}, face(second, p.second)});
  for (const auto& p : found.face_vertex)
    pairs.insert({FeatureKind::FaceVertex, {p.second}, face(first, p.first)});
  for (const auto& p : found.edge_edge) {
    const auto e = edge(first, p.first), f = edge(second, p.second);
    pairs.insert(
        {FeatureKind::EdgeEdge, is_self ? std::min(e, f) : e, is_self ? std::max(e, f) : f});
  }
  return pairs;
}

}  // namespace adaptive_bvh_test
