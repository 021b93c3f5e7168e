// Lengths by which vertices may move in any direction.
#include <algorithm>
#include <array>
#include <cmath>

#include "ccd/continuous_search.h"
#include "ccd/feature_search.h"
#include "ccd/swept_boxes.h"

namespace adaptive_bvh {
namespace {

/// A visitor of FeatureFinder that computes safe displacements of vertices. They begin with the
/// lengths of the motions. For each pair of features, the distance at the start, less the
/// separation, is divided in proportion to both motions; the displacements of their vertices are
/// lowered to these shares. No point of a feature moves farther than one of its vertices.
class SafeDisplacements {
 public:
  SafeDisplacements(const SweptPair& pair, double separation, std::vector<double>& of_first,
                    std::vector<double>& of_second)
      : pair_(pair),
        separation_(separation),
        first_(of_first),
        second_(pair.isSelf() ? of_first : of_second) {}

  /// Sets the displacement of each vertex to the length of its motion.
  static void setToMotion(const MovingMesh& mesh, std::vector<double>& safe) {
    safe.resize(mesh.num_vertices);
    for (unsigned v = 0; v < mesh.num_vertices; ++v) safe[v] = (mesh.end[v] - mesh.start[v]).norm();
  }

  // The arguments are explained at FeatureFinder.
  void vertexFace(unsigned v, unsigned t) {
    const Int4& b = pair_.second.vertices[t];
    const unsigned a = pair_.first.features->vertices()[v].vertex;
    lower(FeatureKind::VertexFace, {{first(int(a)), second(b[0]), second(b[1]), second(b[2])}});
  }
  void faceVertex(unsigned t, unsigned v) {
    const Int4& a = pair_.first.vertices[t];
    const unsigned b = pair_.second.features->vertices()[v].vertex;
    lower(FeatureKind::FaceVertex, {{second(int(b)), first(a[0]), first(a[1]), first(a[2])}});
  }
  void edgeEdge(unsigned e, unsigned f) {
    const unsigned *a = pair_.first.features->edges()[e].vertices,
                   *b = pair_.second.features->edges()[f].vertices;
    lower(FeatureKind::EdgeEdge,
          {{first(int(a[0])), first(int(a[1])), second(int(b[0])), second(int(b[1]))}});
  }

  void finish() {}

 private:
  /// A vertex of a feature. In arrays of four, the first `num_first` belong to the first feature.
  struct Corner {
    const fcl::Vector3d *start, *end;
    double* safe;  ///< its safe displacement so far

    double motion() const { return (*end - *start).norm(); }
  };

  Corner first(int v) const { return corner(pair_.first, first_, v); }
  Corner second(int v) const { return corner(pair_.second, second_, v); }
  static Corner corner(const MovingMesh& mesh, std::vector<double>& safe, int v) {
    return {&mesh.start[v], &mesh.end[v], &safe[static_cast<std::size_t>(v)]};
  }

  /// Lower bound of the distance of two features at the start: that of their bounding spheres.
  static double distanceOfBalls(const std::array<Corner, 4>& c, std::size_t num_first) {
    fcl::Vector3d middle[2] = {fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
    for (std::size_t i = 0; i < 4; ++i)
      middle[i >= num_first] += *c[i].start / double(i < num_first ? num_first : 4 - num_first);
    double radius[2] = {0, 0};
    for (std::size_t i = 0; i < 4; ++i)
      radius[i >= num_first] =
          std::max(radius[i >= num_first], (*c[i].start - middle[i >= num_first]).squaredNorm());
    return (middle[0] - middle[1]).norm() - std::sqrt(radius[0]) - std::sqrt(radius[1]);
  }

  /// The distance above which two features do not restrict each other, with a reserve for rounding.
  double requiredDistance(const std::array<Corner, 4>& c, std::size_t num_first) const {
    double safe[2] = {0, 0};
    for (std::size_t i = 0; i < 4; ++i)
      safe[i >= num_first] = std::max(safe[i >= num_first], *c[i].safe);
    return (separation_ + safe[0] + safe[1]) * (1 + 1e-9) + 4 * error();
  }
  /// Bound of the error of positions.
  double error() const { return std::max(pair_.first.error, pair_.second.error); }

  /// Lowers the displacements of two features to their shares of the distance, less the separation.
  void lower(FeatureKind kind, const std::array<Corner, 4>& c) {
    const std::size_t num_first = kind == FeatureKind::EdgeEdge ? 2 : 1;
    const double gap = distanceOfBalls(c, num_first);
    if (gap * (1 - 1e-9) > requiredDistance(c, num_first) && gap > 1e-6 * c[0].start->norm())
      return;
    double motions[2] = {0, 0};
    for (std::size_t i = 0; i < 4; ++i)
      motions[i >= num_first] = std::max(motions[i >= num_first], c[i].motion());
    const std::array<fcl::Vector3d, 4> starts = {*c[0].start, *c[1].start, *c[2].start,
                                                 *c[3].start};
    const MovingFeatures at_rest(kind, starts, starts, error());
    const double allowance = std::max(0., at_rest.distanceAtStart() - separation_) * (1 - 1e-12);
    const double sum = motions[0] + motions[1];
    if (!(sum * (1 + 1e-12) > allowance)) return;
    for (std::size_t i = 0; i < 4; ++i)
      *c[i].safe = std::min(*c[i].safe, allowance * (motions[i >= num_first] / sum));
  }

  const SweptPair& pair_;
  const double separation_;
  std::vector<double>&first_, &second_;  ///< safe displacements by vertex, of each mesh
};

}  // namespace

/// Searches several times, with boxes around min(displacement, limit).
void findSafeDisplacements(const ContinuousQuery& query, std::vector<double>& of_first,
                           std::vector<double>& of_second) {
  SafeDisplacements::setToMotion(query.first, of_first);
  if (!query.isSelf()) SafeDisplacements::setToMotion(query.second, of_second);
  SweptBoxes boxes(query);
  const auto largest = [](const std::vector<double>& lengths) {
    return lengths.empty() ? 0. : *std::max_element(lengths.begin(), lengths.end());
  };
  searchByGrowingLimits(
      query, [&] { return std::max(largest(of_first), largest(of_second)); },
      [&](double limit) {
        const SweptPair pair = boxes.by(&SweptTree::refitAroundStarts, of_first, of_second, limit);
        SafeDisplacements displacements(pair, query.separation, of_first, of_second);
        // On one thread, because the result depends on the order of the pairs.
        TriangleSearch<FeatureFinder<SafeDisplacements>>(pair.trees(), displacements, pair)
            .runFromRoots();
      });
}

}  // namespace adaptive_bvh
