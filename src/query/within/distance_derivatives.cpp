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

WeightedVertices<3> weightedFace(const MeshState& mesh, unsigned triangle,
                                 const fcl::Vector3d& weights) {
  const VertexIndices v = mesh.view().verticesOf(triangle);
  return {{v[0], v[1], v[2]}, {weights[0], weights[1], weights[2]}};
}

/// A shape: it has no vertices.
WeightedVertices<0> noVertices() { return {}; }

/// Writes row i of the gradients: each weight times `direction`.
template <std::size_t kCount>
void setRow(const WeightedVertices<kCount>& feature, const fcl::Vector3d& direction, std::size_t i,
            VertexGradients& result) {
  for (std::size_t k = 0; k != kCount; ++k) {
    result.vertices[kCount * i + k] = feature.vertices[k];
    result.gradients[kCount * i + k] = (feature.weights[k] * direction);
  }
}

/// Rotations from the world to the frames of two meshes, and the number of threads.
struct DerivativeFrames {
  DerivativeFrames(const DeformableMesh& mesh, const fcl::Transform3d& tf1, int other_threads,
                   const fcl::Transform3d& tf2)
      : to_first(tf1.linear().transpose()),
        to_second(tf2.linear().transpose()),
        threads(std::max(stateOf(mesh).threads, other_threads)) {}

  const fcl::Matrix3d to_first, to_second;
  const int threads;
};

/// Overwrites the result with a row for each normal. first(i), second(i): the WeightedVertices of
/// the features of distance i.
template <typename First, typename Second>
void writeRows(const DerivativeFrames& frames, const std::vector<fcl::Vector3d>& normals,
               const First& first, const Second& second, DistanceDerivatives& result) {
  result.first.resize(normals.size(), decltype(first(0))::kSize);
  result.second.resize(normals.size(), decltype(second(0))::kSize);
  forEachBatch(frames.threads, normals.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const fcl::Vector3d& normal = normals[i];
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
void requireDetails(const char* kind, const std::vector<FeaturePair>& pairs,
                    const FeatureDetails& details) {
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

void requireContacts(const MeshState& mesh, const VertexContacts& contacts) {
  requireRows("VertexContacts::normals", contacts.normals.size(), contacts.size());
  for (const unsigned v : contacts.vertices) requireNumber("vertex", v, mesh.vertices.size());
}

void writePairs(const MeshState& one, const MeshState& other, const DerivativeFrames& frames,
                const FeaturePairs& pairs, const FeaturePairDetails& details,
                FeaturePairDerivatives& result) {
  requireFeatures(pairs, one, other);
  requireDetails("FeaturePairDetails::vertex_face", pairs.vertex_face, details.vertex_face);
  requireDetails("FeaturePairDetails::face_vertex", pairs.face_vertex, details.face_vertex);
  requireDetails("FeaturePairDetails::edge_edge", pairs.edge_edge, details.edge_edge);
  const std::vector<FeaturePair>&vf = pairs.vertex_face, &fv = pairs.face_vertex,
        &ee = pairs.edge_edge;
  const auto& on_second = details.vertex_face.coordinates;
  const auto& on_first = details.face_vertex.coordinates;
  const auto along = [&](std::size_t i, int k) { return details.edge_edge.coordinates[i][k]; };
  writeRows(
      frames, details.vertex_face.normals,
      [&](std::size_t i) { return weightedVertex(vf[i].first); },
      [&](std::size_t i) { return weightedFace(other, vf[i].second, on_second[i]); },
      result.vertex_face);
  writeRows(
      frames, details.face_vertex.normals,
      [&](std::size_t i) { return weightedFace(one, fv[i].first, on_first[i]); },
      [&](std::size_t i) { return weightedVertex(fv[i].second); }, result.face_vertex);
  writeRows(
      frames, details.edge_edge.normals,
      [&](std::size_t i) { return weightedEdge(one, ee[i].first, along(i, 0)); },
      [&](std::size_t i) { return weightedEdge(other, ee[i].second, along(i, 1)); },
      result.edge_edge);
}

/// Returns the weights of a triangle's corners at one of its points.
WeightedVertices<3> weightsAt(const fcl::Vector3d& point, const TrianglePoints& corners,
                              const MeshState& mesh, unsigned triangle) {
  fcl::Vector3d on_face;
  feature_distance::FacePlace place;
  feature_distance::Face(corners).distance(point, on_face, place);
  return weightedFace(mesh, triangle, SurfaceNormals::placeOf(place, triangle).barycentric);
}

}  // namespace

void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const DeformableMesh& second, const fcl::Transform3d& tf2,
                         const FeaturePairs& pairs, const FeaturePairDetails& details,
                         FeaturePairDerivatives& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  const MeshState& other = stateOf(second);
  writePairs(stateOf(first), other, DerivativeFrames(first, tf1, other.threads, tf2), pairs,
             details, result);
}

void selfDistanceDerivatives(const DeformableMesh& mesh, const FeaturePairs& pairs,
                             const FeaturePairDetails& details, FeaturePairDerivatives& result) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  distanceDerivatives(mesh, still, mesh, still, pairs, details, result);
}

void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const DeformableMesh& second, const fcl::Transform3d& tf2,
                         const VertexContacts& contacts, DistanceDerivatives& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  const MeshState& second_state = stateOf(second);
  requireContacts(stateOf(first), contacts);
  requireRows("VertexContacts::triangles", contacts.triangles.size(), contacts.size());
  requireRows("VertexContacts::barycentric", contacts.barycentric.size(), contacts.size());
  for (const int t : contacts.triangles)
    requireNumber("triangle", t, second_state.topology->triangles.size());
  writeRows(
      DerivativeFrames(first, tf1, second_state.threads, tf2), contacts.normals,
      [&](std::size_t i) { return weightedVertex(contacts.vertices[i]); },
      [&](std::size_t i) {
        return weightedFace(second_state, static_cast<unsigned>(contacts.triangles[i]),
                            contacts.barycentric[i]);
      },
      result);
}

void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const fcl::CollisionGeometryd& second, const fcl::Transform3d& tf2,
                         const VertexContacts& contacts, DistanceDerivatives& result) {
  if (const auto* second_mesh = dynamic_cast<const DeformableMesh*>(&second))
    return distanceDerivatives(first, tf1, *second_mesh, tf2, contacts, result);
  requireRigid(tf1);
  requireRigid(tf2);
  requireContacts(stateOf(first), contacts);
  writeRows(
      DerivativeFrames(first, tf1, 1, tf2), contacts.normals,
      [&](std::size_t i) { return weightedVertex(contacts.vertices[i]); },
      [](std::size_t) { return noVertices(); }, result);
}

void distanceDerivatives(const DeformableMesh& first, const fcl::Transform3d& tf1,
                         const DeformableMesh& second, const fcl::Transform3d& tf2,
                         const fcl::DistanceResultd& nearest, DistanceDerivatives& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  const PlacedMesh one(first, tf1), other(second, tf2);
  requireNumber("triangle", nearest.b1, one.mesh.topology->triangles.size());
  requireNumber("triangle", nearest.b2, other.mesh.topology->triangles.size());
  const auto b1 = static_cast<unsigned>(nearest.b1), b2 = static_cast<unsigned>(nearest.b2);
  const RelativePlacement to_first(one.tf, other.tf);
  const TrianglePoints corners = one.pointsOf(b1);
  TrianglePoints placed = other.pointsOf(b2);
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

}  // namespace adaptive_bvh
