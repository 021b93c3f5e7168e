// Continuous collision queries: trees of swept boxes, and a visitor of the pairs of features found.
#include "ccd/continuous_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/leased.h"
#include "ccd/earliest_impact.h"
#include "ccd/feature_search.h"

namespace adaptive_bvh {
namespace {

/// A visitor of FeatureFinder that computes safe displacements of vertices. They begin with the
/// lengths of the motions. For each pair of features, the distance at the start, less the
/// separation, is divided in proportion to both motions; the displacements of their vertices are
/// lowered to these shares. No point of a feature moves farther than one of its vertices.
template <bool kIsSelf>
class SafeDisplacements {
 public:
  SafeDisplacements(const SweptPair& pair, double separation, std::vector<double>& of_first,
                    std::vector<double>& of_second)
      : pair_(pair), separation_(separation), first_(of_first), second_(of_second) {}

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
  Corner second(int v) const { return corner(pair_.second, kIsSelf ? first_ : second_, v); }
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

/// The trees of swept boxes of a query, in memory of the calling thread.
class SweptBoxes {
 public:
  explicit SweptBoxes(const ContinuousQuery& query)
      : query_(query), frame_(query.first, query.second) {}

  /// Boxes around the motion in an interval, padded by half of the separation.
  SweptPair overInterval(const TimeInterval& interval) {
    return pairAfter([&](SweptTree& tree, const MovingMesh& mesh) {
      tree.refit(mesh, frame_, interval, query_.separation / 2);
    });
  }
  /// Boxes around the balls of radius min(displacement, most) around the vertices' starts.
  SweptPair aroundStarts(const std::vector<double>& of_first, const std::vector<double>& of_second,
                         double most) {
    return pairAfter([&](SweptTree& tree, const MovingMesh& mesh) {
      const std::vector<double>& radii = &mesh == &query_.first ? of_first : of_second;
      tree.refitAroundStarts(mesh, frame_, radii, most, query_.separation / 2);
    });
  }
  const SweptFrame& frame() const { return frame_; }

 private:
  /// Refits the trees by refit(tree, mesh), and returns them.
  template <typename Refit>
  SweptPair pairAfter(Refit&& refit) {
    std::array<SweptTree, 2>& trees = *trees_;
    refit(trees[0], query_.first);
    if (!query_.isSelf()) refit(trees[1], query_.second);
    return {query_.first, trees[0], query_.second, trees[query_.isSelf() ? 0 : 1]};
  }

  const ContinuousQuery& query_;
  const SweptFrame frame_;
  const Leased<std::array<SweptTree, 2>> trees_;
};

/// Mean lengths of motions of vertices and of edges, from a sample of the triangles.
struct MeanLengths {
  double motion = 0, edge = 0;

  explicit MeanLengths(const MovingMesh& mesh) {
    constexpr unsigned kSamples = 1024;
    const unsigned step = mesh.num_triangles / kSamples + 1;
    unsigned count = 0;
    for (unsigned t = 0; t < mesh.num_triangles; t += step, ++count) {
      const auto ends = edgeVertices(mesh.triangles, 3 * t);
      motion += (mesh.end[ends[0]] - mesh.start[ends[0]]).norm();
      edge += (mesh.start[ends[1]] - mesh.start[ends[0]]).norm();
    }
    motion /= count;
    edge /= count;
  }
  /// The mean motion, relative to the mean edge.
  double motionInEdges() const { return motion / std::max(edge, 1e-300); }
};

/// The end of the interval that is searched first: vertices move by about half an edge in it, so
/// that swept boxes are small.
double firstPart(const ContinuousQuery& query) {
  const double motion =
      std::max(MeanLengths(query.first).motionInEdges(), MeanLengths(query.second).motionInEdges());
  return motion < 1 ? 1 : std::max(1 / (2 * motion), 1. / 64);
}

/// Finds the earliest impact: searches intervals in turn, up to the first one with an impact.
template <bool kIsSelf>
Impact earliestImpact(const ContinuousQuery& query) {
  SweptBoxes boxes(query);
  std::atomic<double> best{1};
  TimeInterval part{0, firstPart(query)};
  for (;;) {
    const SweptPair pair = boxes.overInterval(part);
    EarliestImpact<kIsSelf> visitor(pair, boxes.frame(), part, query.separation, best);
    searchFeatures<kIsSelf>(pair, visitor, query.threads);
    if (visitor.impact().happens() || part.end == 1) return visitor.impact();
    part = {part.end, part.end > 0.2 ? 1 : 4 * part.end};
  }
}

/// Lists all candidates and returns the earliest impact, by one traversal if motions are short.
template <bool kIsSelf>
Impact listAndFind(const ContinuousQuery& query, FeaturePairs& pairs) {
  if (firstPart(query) < 1) {
    findCandidates(query, pairs);
    return earliestImpact<kIsSelf>(query);
  }
  SweptBoxes boxes(query);
  std::atomic<double> best{1};
  const SweptPair pair = boxes.overInterval({});
  const FeatureLists<kIsSelf> lists(query.first, query.second, pairs);
  ListsAndImpact<kIsSelf> visitor(lists, {pair, boxes.frame(), {}, query.separation, best});
  searchFeatures<kIsSelf>(pair, visitor, query.threads);
  return visitor.impact();
}

}  // namespace

MovingFeatures movingFeatures(const MovingMesh& first, const MovingMesh& second, FeatureKind kind,
                              const FeaturePair& pair) {
  using Corners = std::array<fcl::Vector3d, 4>;
  const double error = std::max(first.error, second.error);
  if (kind == FeatureKind::EdgeEdge) {
    const auto a = edgeVertices(first.triangles, pair.first);
    const auto b = edgeVertices(second.triangles, pair.second);
    const auto corners = [&](const fcl::Vector3d* x, const fcl::Vector3d* y) -> Corners {
      return {x[a[0]], x[a[1]], y[b[0]], y[b[1]]};
    };
    return {kind, corners(first.start, second.start), corners(first.end, second.end), error};
  }
  const bool swapped = kind == FeatureKind::FaceVertex;
  const MovingMesh &points = swapped ? second : first, &faces = swapped ? first : second;
  const unsigned vertex = swapped ? pair.second : pair.first;
  const fcl::Triangle& t = faces.triangles[swapped ? pair.first : pair.second];
  const auto corners = [&](const fcl::Vector3d* x, const fcl::Vector3d* y) -> Corners {
    return {x[vertex], y[t[0]], y[t[1]], y[t[2]]};
  };
  return {kind, corners(points.start, faces.start), corners(points.end, faces.end), error};
}

void findCandidates(const ContinuousQuery& query, FeaturePairs& pairs) {
  SweptBoxes boxes(query);
  const SweptPair pair = boxes.overInterval({});
  const auto search = [&](auto is_self) {
    constexpr bool kIsSelf = decltype(is_self)::value;
    FeatureLists<kIsSelf> lists(query.first, query.second, pairs);
    searchFeatures<kIsSelf>(pair, lists, query.threads);
  };
  query.isSelf() ? search(std::true_type()) : search(std::false_type());
}

void findTimes(const ContinuousQuery& query, const FeaturePairs& pairs, ImpactTimes& times) {
  const TaskPool pool(query.threads);
  const auto find = [&](FeatureKind kind, const std::vector<FeaturePair>& list,
                        std::vector<double>& list_times) {
    constexpr int kPart = 256;  // pairs of a task
    const int size = static_cast<int>(list.size());
    list_times.resize(list.size());
    pool.forEach((size + kPart - 1) / kPart, [&](int part, int) {
      for (int i = part * kPart; i < std::min(size, (part + 1) * kPart); ++i) {
        const auto k = static_cast<std::size_t>(i);
        list_times[k] =
            movingFeatures(query.first, query.second, kind, list[k]).timeOfImpact(query.separation);
      }
    });
  };
  find(FeatureKind::VertexFace, pairs.vertex_face, times.vertex_face);
  find(FeatureKind::FaceVertex, pairs.face_vertex, times.face_vertex);
  find(FeatureKind::EdgeEdge, pairs.edge_edge, times.edge_edge);
}

Impact findEarliestImpact(const ContinuousQuery& query) {
  return query.isSelf() ? earliestImpact<true>(query) : earliestImpact<false>(query);
}

Impact findEarliestImpact(const ContinuousQuery& query, FeaturePairs& pairs) {
  return query.isSelf() ? listAndFind<true>(query, pairs) : listAndFind<false>(query, pairs);
}

/// Searches several times, with boxes around min(displacement, limit) and a growing limit. Near
/// pairs lower most displacements, so that the last search, without a limit, finds few pairs.
void findSafeDisplacements(const ContinuousQuery& query, std::vector<double>& of_first,
                           std::vector<double>& of_second) {
  SafeDisplacements<false>::setToMotion(query.first, of_first);
  if (!query.isSelf()) SafeDisplacements<false>::setToMotion(query.second, of_second);
  SweptBoxes boxes(query);
  const auto search = [&](auto is_self, const SweptPair& pair) {
    constexpr bool kIsSelf = decltype(is_self)::value;
    SafeDisplacements<kIsSelf> displacements(pair, query.separation, of_first, of_second);
    // On one thread, because the result depends on the order of the pairs.
    TriangleSearch<FeatureFinder<kIsSelf, SafeDisplacements<kIsSelf>>>(pair.trees(), displacements,
                                                                       pair)
        .runFromRoots();
  };
  const auto largest = [](const std::vector<double>& lengths) {
    return lengths.empty() ? 0. : *std::max_element(lengths.begin(), lengths.end());
  };
  constexpr double kGrowth = 4;
  double limit = std::max(MeanLengths(query.first).edge, MeanLengths(query.second).edge);
  for (bool is_last = false; !is_last; limit *= kGrowth) {
    is_last = !(limit < std::max(largest(of_first), largest(of_second)) && limit > 0);
    const SweptPair pair = boxes.aroundStarts(
        of_first, of_second, is_last ? std::numeric_limits<double>::infinity() : limit);
    query.isSelf() ? search(std::true_type(), pair) : search(std::false_type(), pair);
  }
}

}  // namespace adaptive_bvh
