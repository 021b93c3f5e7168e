#include "adaptive_bvh/distance_derivatives.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "base/rigid.h"
#include "query/placed_mesh.h"
#include "query/points/point_search.h"
#include "query/points/surface_normals.h"
#include "query/within/required_features.h"
#include "triangles/triangle_gap.h"

// distanceDerivatives: weights of vertices times normals, in the frames of the meshes. Weights and
// normals are those of the caller's results; of two meshes they are computed from the triangles.
namespace adaptive_bvh {
namespace {

/// The vertices of a feature, and their weights at its nearest point.
template <std::size_t kCount>
struct WeightedVertices {
  static constexpr std::size_t kSize = kCount;
  std::array<unsigned, kCount> vertices;
  std::array<double, kCount> weights;
};

WeightedVertices<1> weightedVertex(unsigned vertex) { return {{vertex}, {1}}; }

WeightedVertices<2> weightedEdge(const MeshState& mesh, unsigned number, double along) {
  return {edgeVertices(mesh.topology->triangles.data(), number), {1 - along, along}};
}

template <typename S>
WeightedVertices<3> weightedFace(const MeshState& mesh, unsigned triangle,
                                 const fcl::Vector3<S>& weights) {
  const VertexIndices v = mesh.view().verticesOf(triangle);
  return {{v[0], v[1], v[2]},
          {static_cast<double>(weights[0]), static_cast<double>(weights[1]),
           static_cast<double>(weights[2])}};
}

/// A shape: it has no vertices.
WeightedVertices<0> noVertices() { return {}; }

/// Writes row i of the gradients: each weight times `direction`.
template <typename S, std::size_t kCount>
void setRow(const WeightedVertices<kCount>& feature, const fcl::Vector3d& direction, std::size_t i,
            VertexGradients<S>& result) {
  for (std::size_t k = 0; k != kCount; ++k) {
    result.vertices[kCount * i + k] = feature.vertices[k];
    result.gradients[kCount * i + k] = (feature.weights[k] * direction).template cast<S>();
  }
}

/// Rotations from the world to the frames of two meshes, and the number of threads.
struct DerivativeFrames {
  template <typename S>
  DerivativeFrames(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1, int other_threads,
                   const fcl::Transform3<S>& tf2)
      : to_first(tf1.linear().template cast<double>().transpose()),
        to_second(tf2.linear().template cast<double>().transpose()),
        threads(std::max(stateOf(mesh).query_threads, other_threads)) {}

  const fcl::Matrix3d to_first, to_second;
  const int threads;
};

/// Overwrites the result with a row for each normal. first(i), second(i): the WeightedVertices of
/// the features of distance i.
template <typename S, typename First, typename Second>
void writeRows(const DerivativeFrames& frames, const std::vector<fcl::Vector3<S>>& normals,
               const First& first, const Second& second, DistanceDerivatives<S>& result) {
  result.first.resize(normals.size(), decltype(first(0))::kSize);
  result.second.resize(normals.size(), decltype(second(0))::kSize);
  forEachBatch(frames.threads, normals.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const fcl::Vector3d normal = normals[i].template cast<double>();
      setRow(first(i), -(frames.to_first * normal), i, result.first);
      setRow(second(i), frames.to_second * normal, i, result.second);
    }
  });
}

/// Throws std::invalid_argument unless an array has `expected` rows.
void requireRows(const char* array, std::size_t rows, std::size_t expected) {
  if (rows != expected)
    throw std::invalid_argument("adaptive_bvh, distanceDerivatives: " + std::string(array) +
                                " has " + std::to_string(rows) + " rows; " +
                                std::to_string(expected) + " are needed");
}
template <typename S>
void requireDetails(const char* kind, const std::vector<FeaturePair>& pairs,
                    const FeatureDetails<S>& details) {
  requireRows(kind, details.normals.size(), pairs.size());
  requireRows(kind, details.coordinates.size(), pairs.size());
}

/// Throws std::invalid_argument unless a number is that of one of `count` vertices or triangles.
void requireNumber(const char* feature, std::intptr_t number, std::size_t count) {
  if (number < 0 || static_cast<std::size_t>(number) >= count)
    throw std::invalid_argument("adaptive_bvh, distanceDerivatives: there is no " +
                                std::string(feature) + " " + std::to_string(number) + " of " +
                                std::to_string(count));
}

template <typename S>
void requireContacts(const MeshState& mesh, const VertexContacts<S>& contacts) {
  requireRows("VertexContacts::normals", contacts.normals.size(), contacts.size());
  for (const unsigned v : contacts.vertices) requireNumber("vertex", v, mesh.vertices.size());
}

template <typename S>
void writePairs(const MeshState& one, const MeshState& other, const DerivativeFrames& frames,
                const FeaturePairs& pairs, const FeaturePairDetails<S>& details,
                FeaturePairDerivatives<S>& result) {
  requireFeatures(pairs, one, other);
  requireDetails("FeaturePairDetails::vertex_face", pairs.vertex_face, details.vertex_face);
  requireDetails("FeaturePairDetails::face_vertex", pairs.face_vertex, details.face_vertex);
  requireDetails("FeaturePairDetails::edge_edge", pairs.edge_edge, details.edge_edge);
  const std::vector<FeaturePair>&vf = pairs.vertex_face, &fv = pairs.face_vertex,
        &ee = pairs.edge_edge;
  const auto& on_second = details.vertex_face.coordinates;
  const auto& on_first = details.face_vertex.coordinates;
  const auto along = [&](std::size_t i, int k) {
    return static_cast<double>(details.edge_edge.coordinates[i][k]);
  };
  writeRows(
      frames, details.vertex_face.normals,
      [&](std::size_t i) { return weightedVertex(vf[i].first); },
      [&](std::size_t i) { return weightedFace<S>(other, vf[i].second, on_second[i]); },
      result.vertex_face);
  writeRows(
      frames, details.face_vertex.normals,
      [&](std::size_t i) { return weightedFace<S>(one, fv[i].first, on_first[i]); },
      [&](std::size_t i) { return weightedVertex(fv[i].second); }, result.face_vertex);
  writeRows(
      frames, details.edge_edge.normals,
      [&](std::size_t i) { return weightedEdge(one, ee[i].first, along(i, 0)); },
      [&](std::size_t i) { return weightedEdge(other, ee[i].second, along(i, 1)); },
      result.edge_edge);
}

/// Returns the weights of a triangle's corners at one of its points.
WeightedVertices<3> weightsAt(const fcl::Vector3d& point, const TrianglePoints<double>& corners,
                              const MeshState& mesh, unsigned triangle) {
  fcl::Vector3d on_face;
  feature_distance::FacePlace<double> place;
  feature_distance::Face<double>(corners).distance(point, on_face, place);
  return weightedFace<double>(mesh, triangle, SurfaceNormals::placeOf(place, triangle).barycentric);
}

}  // namespace

template <typename S>
void distanceDerivatives(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                         const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                         const FeaturePairs& pairs, const FeaturePairDetails<S>& details,
                         FeaturePairDerivatives<S>& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  const MeshState& other = stateOf(second);
  writePairs(stateOf(first), other, DerivativeFrames(first, tf1, other.query_threads, tf2), pairs,
             details, result);
}

template <typename S>
void distanceDerivatives(const DeformableMesh<S>& mesh, const FeaturePairs& pairs,
                         const FeaturePairDetails<S>& details, FeaturePairDerivatives<S>& result) {
  const fcl::Transform3<S> still = fcl::Transform3<S>::Identity();
  distanceDerivatives(mesh, still, mesh, still, pairs, details, result);
}

template <typename S>
void distanceDerivatives(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                         const DeformableMesh<S>& other, const fcl::Transform3<S>& other_tf,
                         const VertexContacts<S>& contacts, DistanceDerivatives<S>& result) {
  requireRigid(tf);
  requireRigid(other_tf);
  const MeshState& other_state = stateOf(other);
  requireContacts(stateOf(mesh), contacts);
  requireRows("VertexContacts::triangles", contacts.triangles.size(), contacts.size());
  requireRows("VertexContacts::barycentric", contacts.barycentric.size(), contacts.size());
  for (const int t : contacts.triangles)
    requireNumber("triangle", t, other_state.topology->triangles.size());
  writeRows(
      DerivativeFrames(mesh, tf, other_state.query_threads, other_tf), contacts.normals,
      [&](std::size_t i) { return weightedVertex(contacts.vertices[i]); },
      [&](std::size_t i) {
        return weightedFace<S>(other_state, static_cast<unsigned>(contacts.triangles[i]),
                               contacts.barycentric[i]);
      },
      result);
}

template <typename S>
void distanceDerivatives(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                         const fcl::CollisionGeometry<S>& other, const fcl::Transform3<S>& other_tf,
                         const VertexContacts<S>& contacts, DistanceDerivatives<S>& result) {
  if (const auto* other_mesh = dynamic_cast<const DeformableMesh<S>*>(&other))
    return distanceDerivatives(mesh, tf, *other_mesh, other_tf, contacts, result);
  requireRigid(tf);
  requireRigid(other_tf);
  requireContacts(stateOf(mesh), contacts);
  writeRows(
      DerivativeFrames(mesh, tf, 1, other_tf), contacts.normals,
      [&](std::size_t i) { return weightedVertex(contacts.vertices[i]); },
      [](std::size_t) { return noVertices(); }, result);
}

template <typename S>
void distanceDerivatives(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                         const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                         const fcl::DistanceResult<S>& nearest, DistanceDerivatives<S>& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  const PlacedMesh one(first, tf1), other(second, tf2);
  requireNumber("triangle", nearest.b1, one.mesh.topology->triangles.size());
  requireNumber("triangle", nearest.b2, other.mesh.topology->triangles.size());
  const auto b1 = static_cast<unsigned>(nearest.b1), b2 = static_cast<unsigned>(nearest.b2);
  const RelativePlacement to_first(one.tf, other.tf);
  const TrianglePoints<double> corners = one.pointsOf(b1);
  TrianglePoints<double> placed = other.pointsOf(b2);
  for (fcl::Vector3d& x : placed) x = to_first(x);
  const TriangleGap gap = gapOf(corners, placed);
  fcl::Vector3d normal = fcl::Vector3d::Zero();  // in the first's frame, as the points
  if (gap.distance > 0) normal = (gap.points.second - gap.points.first).stableNormalized();
  result.first.resize(1, 3);
  result.second.resize(1, 3);
  setRow(weightsAt(gap.points.first, corners, one.mesh, b1), -normal, 0, result.first);
  setRow(weightsAt(gap.points.second, placed, other.mesh, b2), to_first.R.transpose() * normal, 0,
         result.second);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template void distanceDerivatives(const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const FeaturePairs&, const FeaturePairDetails<S>&,           \
                                    FeaturePairDerivatives<S>&);                                 \
  template void distanceDerivatives(const DeformableMesh<S>&, const FeaturePairs&,               \
                                    const FeaturePairDetails<S>&, FeaturePairDerivatives<S>&);   \
  template void distanceDerivatives(const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const VertexContacts<S>&, DistanceDerivatives<S>&);          \
  template void distanceDerivatives(const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, \
                                    const VertexContacts<S>&, DistanceDerivatives<S>&);          \
  template void distanceDerivatives(const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const DeformableMesh<S>&, const fcl::Transform3<S>&,         \
                                    const fcl::DistanceResult<S>&, DistanceDerivatives<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
