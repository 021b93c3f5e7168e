#include <stdexcept>
#include <string>

#include "adaptive_bvh/proximity.h"
#include "base/rigid.h"
#include "query/placed_mesh.h"
#include "query/points/point_search.h"
#include "query/points/surface_normals.h"
#include "query/within/near_pairs.h"
#include "query/within/required_features.h"
#include "triangles/feature_distance.h"
#include "triangles/triangle_gap.h"

// featurePairDetails: distance, nearest points, coordinates and normal of given pairs of features.
namespace adaptive_bvh {
namespace {

using Corners = std::array<fcl::Vector3d, 3>;
using Segment = std::array<fcl::Vector3d, 2>;

/// Details of one pair, as FeatureDetails has them, but in the first mesh's frame.
struct Detail {
  double distance;
  fcl::Vector3d first, second;  ///< nearest points
  fcl::Vector3d coordinates, normal;

  Detail swapped() const { return {distance, second, first, coordinates, -normal}; }
};

/// Returns v / |v| for any length that is not 0, however small or large; zero for a zero vector.
fcl::Vector3d directionOf(const fcl::Vector3d& v) {
  const double size = v.lpNorm<Eigen::Infinity>();
  if (!(size > 0)) return fcl::Vector3d::Zero();
  return fcl::Vector3d(v / size).normalized();
}

/// Features nearer than this times their largest coordinate count as touching: their normal is that
/// of the surfaces, because rounding turns the line between so near points.
constexpr double kTouching = 1e-8;
/// Edges are parallel, or directions equal, if their cross product or difference is shorter.
constexpr double kParallel = 1e-8;

/// Largest absolute coordinate.
template <std::size_t kCount>
double sizeOf(const std::array<fcl::Vector3d, kCount>& points) {
  double size = 0;
  for (const fcl::Vector3d& x : points) size = std::max(size, x.lpNorm<Eigen::Infinity>());
  return size;
}

/// Features and outward directions of a mesh, in the first mesh's frame.
class MeshFeatures {
 public:
  MeshFeatures(const MeshState& mesh, const RelativePlacement& to_first)
      : mesh_(mesh), normals_(mesh), to_first_(to_first) {}

  fcl::Vector3d point(unsigned vertex) const { return to_first_(mesh_.vertices[vertex]); }
  Corners face(unsigned triangle) const {
    const VertexIndices v = mesh_.view().verticesOf(triangle);
    return {point(v[0]), point(v[1]), point(v[2])};
  }
  Segment edge(unsigned number) const {
    const auto ends = edgeVertices(mesh_.topology->triangles.data(), number);
    return {point(ends[0]), point(ends[1])};
  }

  /// The outward direction of the surface at one of its points (SurfaceNormals).
  fcl::Vector3d outward(const SurfacePlace& place) const {
    return to_first_.R * normals_.at(place);
  }
  fcl::Vector3d outwardOfEdge(unsigned number) const {
    return outward({SurfaceFeature::Edge, number / 3, number % 3, fcl::Vector3d::Zero()});
  }

 private:
  const MeshState& mesh_;
  const SurfaceNormals normals_;
  const RelativePlacement to_first_;
};

/// Returns the details of a vertex at x, as the first feature, and a face, as the second.
Detail vertexFaceDetail(const fcl::Vector3d& x, const MeshFeatures& mesh, unsigned triangle) {
  const Corners corners = mesh.face(triangle);
  Detail found;
  feature_distance::FacePlace on_face;
  found.first = x;
  found.distance = feature_distance::Face(corners).distance(x, found.second, on_face);
  const SurfacePlace place = SurfaceNormals::placeOf(on_face, triangle);
  found.coordinates = place.barycentric;
  const double size = std::max(x.lpNorm<Eigen::Infinity>(), sizeOf(corners));
  if (found.distance > kTouching * size)
    found.normal = directionOf(found.second - x);
  else
    found.normal = -mesh.outward(place);
  return found;
}

/// Returns the normal of two edges that touch: their cross product, with the sign that makes it
/// point along the difference of the outward directions of both edges' surfaces. For parallel edges
/// it is that difference, perpendicular to the longer edge; zero if that is zero, too.
fcl::Vector3d directionOfTouching(const Segment& a, const Segment& b, const fcl::Vector3d& outward1,
                                  const fcl::Vector3d& outward2) {
  const fcl::Vector3d u = a[1] - a[0], v = b[1] - b[0], facing = outward1 - outward2;
  const fcl::Vector3d across = directionOf(u).cross(directionOf(v));
  if (across.norm() > kParallel)
    return (across.dot(facing) < 0 ? fcl::Vector3d(-across) : across).normalized();
  const fcl::Vector3d along = directionOf(u.norm() < v.norm() ? v : u);
  const fcl::Vector3d rest = facing - facing.dot(along) * along;
  return rest.norm() > kParallel ? fcl::Vector3d(rest.normalized()) : fcl::Vector3d::Zero();
}

/// Returns the details of two edges, given by their numbers.
Detail edgeEdgeDetail(const MeshFeatures& first, unsigned edge1, const MeshFeatures& second,
                      unsigned edge2) {
  const Segment a = first.edge(edge1), b = second.edge(edge2);
  std::array<double, 2> position;  // of the nearest points: from 0 to 1 along each edge
  const FeatureDistance nearest = edgeEdgeDistance(a, b, position);
  Detail found{nearest.distance, nearest.first, nearest.second, {position[0], position[1], 0}, {}};
  if (nearest.distance > kTouching * std::max(sizeOf(a), sizeOf(b)))
    found.normal = directionOf(nearest.second - nearest.first);
  else
    found.normal =
        directionOfTouching(a, b, first.outwardOfEdge(edge1), second.outwardOfEdge(edge2));
  return found;
}

/// How many features of each kind a mesh has.
struct FeatureCounts {
  std::size_t vertices, triangles, edges;
};
FeatureCounts countsOf(const MeshState& mesh) {
  const std::size_t triangles = mesh.topology->triangles.size();
  return {mesh.vertices.size(), triangles, 3 * triangles};
}

/// Throws std::invalid_argument unless all numbers exist: are below `count1` and below `count2`.
void requireExist(const std::vector<FeaturePair>& pairs, const char* kind, std::size_t count1,
                  std::size_t count2) {
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (pairs[i].first >= count1 || pairs[i].second >= count2)
      throw std::invalid_argument("adaptive_bvh: pair " + std::to_string(i) + " of " + kind +
                                  " is (" + std::to_string(pairs[i].first) + ", " +
                                  std::to_string(pairs[i].second) + "), but there are " +
                                  std::to_string(count1) + " and " + std::to_string(count2));
}

/// Sets the result to detailOf(pair) of each pair. `tf`: maps the details' frame to the world.
template <typename DetailOf>
void writeDetails(int threads, const fcl::Transform3d& tf, const std::vector<FeaturePair>& pairs,
                  const DetailOf& detailOf, FeatureDetails& result) {
  result.resize(pairs.size());
  forEachBatch(threads, pairs.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Detail detail = detailOf(pairs[i]);
      result.distances[i] = detail.distance;
      result.nearest_points[i] = {tf * detail.first, tf * detail.second};
      result.coordinates[i] = detail.coordinates;
      result.normals[i] = tf.linear() * detail.normal;
    }
  });
}

}  // namespace

void requireFeatures(const FeaturePairs& pairs, const MeshState& first, const MeshState& second) {
  const FeatureCounts one = countsOf(first), other = countsOf(second);
  requireExist(pairs.vertex_face, "vertex_face", one.vertices, other.triangles);
  requireExist(pairs.face_vertex, "face_vertex", one.triangles, other.vertices);
  requireExist(pairs.edge_edge, "edge_edge", one.edges, other.edges);
}

void findFeatureDetails(const PlacedMesh& first, const MeshState& second,
                        const RelativePlacement& to_first, const FeaturePairs& pairs,
                        FeaturePairDetails& result) {
  requireFeatures(pairs, first.mesh, second);
  const MeshFeatures a(first.mesh, RelativePlacement()), b(second, to_first);
  const int threads = queryThreads(first.mesh, second);
  writeDetails(
      threads, first.tf, pairs.vertex_face,
      [&](const FeaturePair& p) { return vertexFaceDetail(a.point(p.first), b, p.second); },
      result.vertex_face);
  writeDetails(
      threads, first.tf, pairs.face_vertex,
      [&](const FeaturePair& p) {
        return vertexFaceDetail(b.point(p.second), a, p.first).swapped();
      },
      result.face_vertex);
  writeDetails(
      threads, first.tf, pairs.edge_edge,
      [&](const FeaturePair& p) { return edgeEdgeDetail(a, p.first, b, p.second); },
      result.edge_edge);
}

void featurePairDetails(const DeformableMesh& first, const fcl::Transform3d& tf1,
                        const DeformableMesh& second, const fcl::Transform3d& tf2,
                        const FeaturePairs& pairs, FeaturePairDetails& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  const PlacedMesh one(first, tf1), two(second, tf2);
  findFeatureDetails(one, two.mesh, RelativePlacement(one.tf, two.tf), pairs, result);
}

void selfFeaturePairDetails(const DeformableMesh& mesh, const FeaturePairs& pairs,
                            FeaturePairDetails& result) {
  const PlacedMesh in_own_frame(mesh, fcl::Transform3d(fcl::Transform3d::Identity()));
  findFeatureDetails(in_own_frame, in_own_frame.mesh, RelativePlacement(), pairs, result);
}

}  // namespace adaptive_bvh
