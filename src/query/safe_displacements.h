#pragma once

#include <algorithm>

#include "query/continuous_search.h"
#include "query/feature_tasks.h"

namespace adaptive_bvh {

/// A visitor of FeatureFinder that shares the room between two features among their vertices, in
/// proportion to how far they move. While a vertex moves by r at most, no point of a feature moves
/// by more than the largest r of its vertices. What is shared out only becomes less, from how far
/// each vertex moves.
template <bool kIsSelf>
class SafeDisplacements {
 public:
  SafeDisplacements(const SweptPair& pair, double separation, std::vector<double>& of_first,
                    std::vector<double>& of_second)
      : pair_(pair), separation_(separation), first_(of_first), second_(of_second) {}

  /// Where nothing is in the way.
  static void setToMotion(const MovingMesh& mesh, std::vector<double>& safe) {
    safe.resize(mesh.num_vertices);
    for (unsigned v = 0; v < mesh.num_vertices; ++v) safe[v] = (mesh.end[v] - mesh.start[v]).norm();
  }

  void vertexFace(unsigned v, unsigned t) {
    const Int4& b = pair_.second.vertices[t];
    const unsigned a = pair_.first.features->vertices()[v].vertex;
    share(FeatureKind::VertexFace, {{first(int(a)), second(b[0]), second(b[1]), second(b[2])}});
  }
  void faceVertex(unsigned t, unsigned v) {
    const Int4& a = pair_.first.vertices[t];
    const unsigned b = pair_.second.features->vertices()[v].vertex;
    share(FeatureKind::FaceVertex, {{second(int(b)), first(a[0]), first(a[1]), first(a[2])}});
  }
  void edgeEdge(unsigned e, unsigned f) {
    const unsigned *a = pair_.first.features->edges()[e].vertices,
                   *b = pair_.second.features->edges()[f].vertices;
    share(FeatureKind::EdgeEdge,
          {{first(int(a[0])), first(int(a[1])), second(int(b[0])), second(int(b[1]))}});
  }

  /// Not on several threads: what it skips depends on the order.
  SafeDisplacements forWorker(FeaturePairs&) const { return *this; }
  void clear() {}
  void finish() {}
  struct Mark {};
  Mark mark() const { return {}; }
  template <typename Found>
  void take(const std::vector<Found>&, const TaskPool&) {}

 private:
  struct Corner {
    const fcl::Vector3d *start, *end;
    double* safe;

    double motion() const { return (*end - *start).norm(); }
  };

  Corner first(int v) const { return corner(pair_.first, first_, v); }
  Corner second(int v) const { return corner(pair_.second, kIsSelf ? first_ : second_, v); }
  static Corner corner(const MovingMesh& mesh, std::vector<double>& safe, int v) {
    return {&mesh.start[v], &mesh.end[v], &safe[static_cast<std::size_t>(v)]};
  }

  /// At most the distance of two features: that of the balls around their corners.
  static double distanceOfBalls(const std::array<Corner, 4>& c, std::size_t firsts) {
    fcl::Vector3d middle[2] = {fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
    for (std::size_t i = 0; i < 4; ++i)
      middle[i >= firsts] += *c[i].start / double(i < firsts ? firsts : 4 - firsts);
    double radius[2] = {0, 0};
    for (std::size_t i = 0; i < 4; ++i)
      radius[i >= firsts] =
          std::max(radius[i >= firsts], (*c[i].start - middle[i >= firsts]).squaredNorm());
    return (middle[0] - middle[1]).norm() - std::sqrt(radius[0]) - std::sqrt(radius[1]);
  }

  /// What the two may move by now, with some reserve for rounding.
  double needs(const std::array<Corner, 4>& c, std::size_t firsts) const {
    double safe[2] = {0, 0};
    for (std::size_t i = 0; i < 4; ++i) safe[i >= firsts] = std::max(safe[i >= firsts], *c[i].safe);
    return (separation_ + safe[0] + safe[1]) * (1 + 1e-9) + 4 * error();
  }
  double error() const { return std::max(pair_.first.error, pair_.second.error); }

  void share(FeatureKind kind, const std::array<Corner, 4>& c) {
    const std::size_t firsts = kind == FeatureKind::EdgeEdge ? 2 : 1;
    const double far = distanceOfBalls(c, firsts);
    if (far * (1 - 1e-9) > needs(c, firsts) && far > 1e-6 * c[0].start->norm()) return;
    double moves[2] = {0, 0};
    for (std::size_t i = 0; i < 4; ++i)
      moves[i >= firsts] = std::max(moves[i >= firsts], c[i].motion());
    const std::array<fcl::Vector3d, 4> at = {*c[0].start, *c[1].start, *c[2].start, *c[3].start};
    const MovingFeatures still(kind, at, at, error());
    const double room = std::max(0., still.distanceAtStart() - separation_) * (1 - 1e-12);
    const double sum = moves[0] + moves[1];
    if (!(sum * (1 + 1e-12) > room)) return;
    for (std::size_t i = 0; i < 4; ++i)
      *c[i].safe = std::min(*c[i].safe, room * (moves[i >= firsts] / sum));
  }

  const SweptPair& pair_;
  const double separation_;
  std::vector<double>&first_, &second_;
};

}  // namespace adaptive_bvh
