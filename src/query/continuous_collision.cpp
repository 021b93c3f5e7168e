#include "adaptive_bvh/continuous_collision.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "geometry/rigid.h"
#include "geometry/rounding.h"
#include "model_state.h"
#include "query/continuous_search.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {
namespace {

[[noreturn]] void refuseMotion(const std::string& what) {
  throw std::invalid_argument("adaptive_bvh, continuous collision: " + what);
}

void requireSeparation(double separation) {
  if (!(separation >= 0) || !std::isfinite(separation))
    refuseMotion("the separation is " + std::to_string(separation) +
                 "; 0 or a positive length is needed");
}

/// Positions in the world, in double precision; returns how far they may be from the exact ones.
template <typename S>
double place(const fcl::Vector3<S>* positions, std::size_t count, const fcl::Transform3<S>& tf,
             std::vector<fcl::Vector3d>& world) {
  world.resize(count);
  const fcl::Matrix3d R = tf.linear().template cast<double>();
  const fcl::Vector3d T = tf.translation().template cast<double>();
  const bool is_still = R == fcl::Matrix3d::Identity() && T.isZero(0);
  double largest = 0, sum = 0;  // of a body coordinate; not a number where one is not
  for (std::size_t i = 0; i < count; ++i) {
    const fcl::Vector3d x = positions[i].template cast<double>();
    world[i] = is_still ? x : fcl::Vector3d(R * x + T);
    sum += world[i].lpNorm<1>() * 0;
    largest = std::max({largest, x.lpNorm<1>(), world[i].lpNorm<1>()});
  }
  if (!(sum == 0) || !(largest <= 6 * rounding::largestCoordinate<double>()))
    refuseMotion("a position is not finite, or too large");
  if (is_still) return 0;
  return 8 * std::numeric_limits<double>::epsilon() *
         (R.cwiseAbs().maxCoeff() * largest + T.lpNorm<1>());
}

/// A model's part in a query.
template <typename BV>
class MovingModel {
 public:
  struct Memory {
    std::vector<fcl::Vector3d> start, end;
  };

  MovingModel(const Motion<BV>& motion, Memory& memory) : tree_(treeOf(*motion.model)) {
    const auto& model = *motion.model;
    const auto count = static_cast<std::size_t>(model.num_vertices);
    requireRigid(motion.start_tf);
    requireRigid(motion.end_tf);
    const double at_start = place(motion.start, count, motion.start_tf, memory.start);
    const double at_end = place(motion.end, count, motion.end_tf, memory.end);
    const auto& wide = tree_.wide.topology(model, tree_);
    mesh_ = {wide.nodes(),
             &wide.vertices(0),
             &tree_.topology.slots,
             &tree_.owners.current(model, tree_.topology_number),
             &tree_.features.leaves(model, tree_),
             memory.start.data(),
             memory.end.data(),
             model.tri_indices,
             static_cast<unsigned>(model.num_vertices),
             static_cast<unsigned>(model.num_tris),
             wide.size(),
             wide.depth(),
             std::max(at_start, at_end)};
  }

  const MovingMesh& mesh() const { return mesh_; }
  int threads() const { return tree_.query_threads; }

 private:
  static const AdaptiveTree<BV>& treeOf(const AdaptiveBVHModel<BV>& model) {
    detail::ModelAccess<BV>::repairedType(model);  // repairs what was changed without our update
    requireTriangles<BV>(model);
    return detail::ModelAccess<BV>::tree(model);
  }

  const AdaptiveTree<BV>& tree_;
  MovingMesh mesh_;
};

/// Calls ask(query) for two models, or one with itself.
template <typename BV, typename Ask>
auto withQuery(const Motion<BV>& first, const Motion<BV>* second, double separation, Ask&& ask) {
  static thread_local typename MovingModel<BV>::Memory memory[2];
  requireSeparation(separation);
  const MovingModel<BV> a(first, memory[0]);
  if (!second) return ask(ContinuousQuery{a.mesh(), a.mesh(), separation, a.threads()});
  const MovingModel<BV> b(*second, memory[1]);
  return ask(ContinuousQuery{a.mesh(), b.mesh(), separation, std::max(a.threads(), b.threads())});
}

void requirePair(const ContinuousQuery& query, FeatureKind kind, const FeaturePair& pair) {
  const auto count = [](const MovingMesh& mesh, FeatureKind k, FeatureKind vertex) {
    return k == vertex                  ? mesh.num_vertices
           : k == FeatureKind::EdgeEdge ? 3 * mesh.num_triangles
                                        : mesh.num_triangles;
  };
  if (query.isSelf() && kind == FeatureKind::FaceVertex)
    refuseMotion("within one mesh a pair of a vertex and a face is a VertexFace");
  if (pair.first >= count(query.first, kind, FeatureKind::VertexFace) ||
      pair.second >= count(query.second, kind, FeatureKind::FaceVertex))
    refuseMotion("a pair names a feature that is not there");
}

template <typename BV>
double timeOf(const Motion<BV>& first, const Motion<BV>* second, FeatureKind kind,
              const FeaturePair& pair, double separation) {
  return withQuery(first, second, separation, [&](const ContinuousQuery& query) {
    requirePair(query, kind, pair);
    return movingFeatures(query.first, query.second, kind, pair).timeOfImpact(separation);
  });
}

template <typename BV>
void timesOf(const Motion<BV>& first, const Motion<BV>* second, const FeaturePairs& pairs,
             double separation, ImpactTimes& times) {
  withQuery(first, second, separation, [&](const ContinuousQuery& query) {
    const auto require = [&](FeatureKind kind, const std::vector<FeaturePair>& of) {
      for (const FeaturePair& pair : of) requirePair(query, kind, pair);
    };
    require(FeatureKind::VertexFace, pairs.vertex_face);
    require(FeatureKind::FaceVertex, pairs.face_vertex);
    require(FeatureKind::EdgeEdge, pairs.edge_edge);
    findTimes(query, pairs, times);
  });
}

}  // namespace

template <typename BV>
Motion<BV>::Motion(const Model& moving, const Transform& from_tf, const Transform& to_tf)
    : model(&moving),
      start(moving.prev_vertices),
      end(moving.vertices),
      start_tf(from_tf),
      end_tf(to_tf) {
  if (!start)
    refuseMotion(
        "the model has no positions of the step before: make a two-frame update "
        "(beginUpdateModel), or give both positions");
}

template <typename BV>
Motion<BV>::Motion(const Model& moving, const Point* from, const Point* to, std::size_t count,
                   const Transform& from_tf, const Transform& to_tf)
    : model(&moving), start(from), end(to), start_tf(from_tf), end_tf(to_tf) {
  if (count != static_cast<std::size_t>(moving.num_vertices))
    refuseMotion(std::to_string(count) + " positions for " + std::to_string(moving.num_vertices) +
                 " vertices");
  if (count > 0 && (!from || !to)) refuseMotion("a null pointer for positions");
}

template <typename BV>
Motion<BV>::Motion(const Model& moving, const std::vector<Point>& from,
                   const std::vector<Point>& to, const Transform& from_tf, const Transform& to_tf)
    : Motion(moving, from.data(), to.data(), from.size(), from_tf, to_tf) {
  if (to.size() != from.size())
    refuseMotion(std::to_string(from.size()) + " positions at the start, " +
                 std::to_string(to.size()) + " at the end");
}

template <typename BV>
void candidates(const Motion<BV>& first, const Motion<BV>& second, double separation,
                FeaturePairs& pairs) {
  withQuery(first, &second, separation,
            [&](const ContinuousQuery& query) { findCandidates(query, pairs); });
}
template <typename BV>
void candidates(const Motion<BV>& mesh, double separation, FeaturePairs& pairs) {
  withQuery<BV>(mesh, nullptr, separation,
                [&](const ContinuousQuery& query) { findCandidates(query, pairs); });
}

template <typename BV>
double timeOfImpact(const Motion<BV>& first, const Motion<BV>& second, FeatureKind kind,
                    const FeaturePair& pair, double separation) {
  return timeOf(first, &second, kind, pair, separation);
}
template <typename BV>
double timeOfImpact(const Motion<BV>& mesh, FeatureKind kind, const FeaturePair& pair,
                    double separation) {
  return timeOf<BV>(mesh, nullptr, kind, pair, separation);
}

template <typename BV>
void timesOfImpact(const Motion<BV>& first, const Motion<BV>& second, const FeaturePairs& pairs,
                   double separation, ImpactTimes& times) {
  timesOf(first, &second, pairs, separation, times);
}
template <typename BV>
void timesOfImpact(const Motion<BV>& mesh, const FeaturePairs& pairs, double separation,
                   ImpactTimes& times) {
  timesOf<BV>(mesh, nullptr, pairs, separation, times);
}

template <typename BV>
Impact earliestImpact(const Motion<BV>& first, const Motion<BV>& second, double separation) {
  return withQuery(first, &second, separation,
                   [](const ContinuousQuery& query) { return findEarliestImpact(query); });
}
template <typename BV>
Impact earliestImpact(const Motion<BV>& mesh, double separation) {
  return withQuery<BV>(mesh, nullptr, separation,
                       [](const ContinuousQuery& query) { return findEarliestImpact(query); });
}

template <typename BV>
Impact earliestImpact(const Motion<BV>& first, const Motion<BV>& second, double separation,
                      FeaturePairs& pairs) {
  return withQuery(first, &second, separation,
                   [&](const ContinuousQuery& query) { return findEarliestImpact(query, pairs); });
}
template <typename BV>
Impact earliestImpact(const Motion<BV>& mesh, double separation, FeaturePairs& pairs) {
  return withQuery<BV>(mesh, nullptr, separation, [&](const ContinuousQuery& query) {
    return findEarliestImpact(query, pairs);
  });
}

template <typename BV>
void safeDisplacements(const Motion<BV>& first, const Motion<BV>& second, double separation,
                       std::vector<double>& of_first, std::vector<double>& of_second) {
  withQuery(first, &second, separation, [&](const ContinuousQuery& query) {
    findSafeDisplacements(query, of_first, of_second);
  });
}
template <typename BV>
void safeDisplacements(const Motion<BV>& mesh, double separation,
                       std::vector<double>& of_vertices) {
  withQuery<BV>(mesh, nullptr, separation, [&](const ContinuousQuery& query) {
    findSafeDisplacements(query, of_vertices, of_vertices);
  });
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                             \
  template struct Motion<BV>;                                                                    \
  template void candidates(const Motion<BV>&, const Motion<BV>&, double, FeaturePairs&);         \
  template void candidates(const Motion<BV>&, double, FeaturePairs&);                            \
  template double timeOfImpact(const Motion<BV>&, const Motion<BV>&, FeatureKind,                \
                               const FeaturePair&, double);                                      \
  template double timeOfImpact(const Motion<BV>&, FeatureKind, const FeaturePair&, double);      \
  template void timesOfImpact(const Motion<BV>&, const Motion<BV>&, const FeaturePairs&, double, \
                              ImpactTimes&);                                                     \
  template void timesOfImpact(const Motion<BV>&, const FeaturePairs&, double, ImpactTimes&);     \
  template Impact earliestImpact(const Motion<BV>&, const Motion<BV>&, double);                  \
  template Impact earliestImpact(const Motion<BV>&, double);                                     \
  template Impact earliestImpact(const Motion<BV>&, const Motion<BV>&, double, FeaturePairs&);   \
  template Impact earliestImpact(const Motion<BV>&, double, FeaturePairs&);                      \
  template void safeDisplacements(const Motion<BV>&, const Motion<BV>&, double,                  \
                                  std::vector<double>&, std::vector<double>&);                   \
  template void safeDisplacements(const Motion<BV>&, double, std::vector<double>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
