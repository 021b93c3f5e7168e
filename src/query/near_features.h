#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "geometry/feature_distance.h"
#include "mesh/feature_owners.h"
#include "query/append_pair.h"
#include "query/found_parts.h"
#include "query/within_tests.h"

namespace adaptive_bvh {

/// Writes the near features of near pairs of triangles into a result: those that the triangles own,
/// so each pair comes once.
template <typename S>
class FeatureSink {
 public:
  using Result = FeaturePairs;
  static constexpr int kBatch = 256;
  static constexpr bool kFewAreNear = false;

  /// `is_self`: features with a vertex in common are left out.
  FeatureSink(const WithinInput<S>& input, bool is_self, Result& result)
      : in_(input),
        owners1_(input.first.mesh.topology->owners),
        owners2_(input.second.mesh.topology->owners),
        is_self_(is_self),
        result_(result) {}

  static bool needsGap() { return false; }
  static bool isDone() { return false; }
  void clear() { result_.clear(); }

  void add(const LeafPair& pair, const TriangleGap*) {
    const Side a{in_.tree1.corners(pair.first), owners1_[pair.first],
                 in_.pointsOfFirst(pair.first)};
    const Side b{in_.tree2.corners(pair.second), owners2_[pair.second],
                 in_.pointsOfSecond(pair.second)};
    addVertices(a, b, [&](unsigned v, unsigned t) { appendPair(v, t, result_.vertex_face); });
    addVertices(b, a, [&](unsigned v, unsigned t) {
      if (is_self_)
        appendPair(v, t, result_.vertex_face);
      else
        appendPair(t, v, result_.face_vertex);
    });
    addEdges(a, b);
  }

  /// For another thread.
  FeatureSink another(Result& result) const { return {in_, is_self_, result}; }
  using Mark = FeatureMark;
  Mark mark() const { return markOf(result_); }
  /// In place of what the result held: what other sinks were given in tasks, in their order.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    joinFeatures(
        tasks, pool, result_,
        [](const Found& task) -> auto& { return task.worker->sink().result_; });
  }

 private:
  struct Side {
    const Int4& vertices;
    const FeatureOwner& owner;
    TrianglePoints<double> points;
  };

  bool isNear(double distance) const { return distance <= in_.distance; }
  bool areSame(int vertex1, int vertex2) const { return is_self_ && vertex1 == vertex2; }

  template <typename Add>
  void addVertices(const Side& of, const Side& face, const Add& add) const {
    for (unsigned k = 0; k < 3; ++k) {
      const int v = of.vertices[k];
      if (!of.owner.ownsVertex(k) || areSame(v, face.vertices[0]) || areSame(v, face.vertices[1]) ||
          areSame(v, face.vertices[2]))
        continue;
      if (isNear(vertexFaceDistance<double>(of.points[k], face.points).distance))
        add(static_cast<unsigned>(v), face.owner.triangle);
    }
  }
  void addEdges(const Side& a, const Side& b) const {
    for (unsigned i = 0; i < 3; ++i)
      for (unsigned j = 0; j < 3; ++j)
        if (a.owner.ownsEdge(i) && b.owner.ownsEdge(j)) addEdges(a, i, b, j);
  }
  void addEdges(const Side& a, unsigned i, const Side& b, unsigned j) const {
    const unsigned i1 = (i + 1) % 3, j1 = (j + 1) % 3;
    for (const unsigned end : {i, i1})
      if (areSame(a.vertices[end], b.vertices[j]) || areSame(a.vertices[end], b.vertices[j1]))
        return;
    if (!isNear(edgeEdgeDistance<double>({a.points[i], a.points[i1]}, {b.points[j], b.points[j1]})
                    .distance))
      return;
    const unsigned first = 3 * a.owner.triangle + i, second = 3 * b.owner.triangle + j;
    const bool swaps = is_self_ && first > second;
    appendPair(swaps ? second : first, swaps ? first : second, result_.edge_edge);
  }

  const WithinInput<S>& in_;
  const FeatureOwners &owners1_, &owners2_;
  const bool is_self_;
  Result& result_;
};

}  // namespace adaptive_bvh
