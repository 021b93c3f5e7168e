#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "adaptive_bvh/proximity.h"
#include "base/scratch.h"
#include "base/shortcut.h"
#include "query/nearest/close_triangles.h"
#include "query/tree_pair.h"
#include "query/within/near_search.h"
#include "query/within/rigid_motion.h"

namespace adaptive_bvh {
namespace {

/// The index of each triangle of a mesh in the order of the tree's leaves.
class LeafIndices {
 public:
  void assign(const MeshState& mesh) {
    if (topology_ == mesh.topology) return;
    topology_.reset();  // until the indices are those of the new topology
    indices_.resize(mesh.topology->triangles.size());
    for (unsigned i = 0; i < indices_.size(); ++i)
      indices_[static_cast<std::size_t>(mesh.tree.triangle(i))] = i;
    topology_ = mesh.topology;
  }
  unsigned operator[](unsigned triangle) const { return indices_[triangle]; }

 private:
  std::shared_ptr<const MeshTopology> topology_;
  std::vector<unsigned> indices_;
};

/// The triangles around a pair of leaves: some before and after each in the order of the tree.
/// While two bodies stay in touch, the place where they touch moves, but rarely far.
class Surroundings {
 public:
  Surroundings(const PairOfMeshes& meshes, const LeafIndexPair& around)
      : first_(meshes.first, around.first), second_(meshes.second, around.second) {
    for (auto& t : second_.triangles)
      for (fcl::Vector3d& x : t.corners) x = meshes.to_first(x);
    for (Side* side : {&first_, &second_}) side->bound();
  }

  /// Whether any two of the triangles are within `distance`; `found` is set to the first two.
  bool find(double distance, LeafIndexPair& found) {
    second_.keep(distance, first_.box);
    first_.keep(distance, second_.box);
    for (const auto& a : first_.triangles)
      for (const auto& b : second_.triangles)
        if (a.box.distance(b.box) <= distance &&
            !areSurelyFarther(a.corners, b.corners, distance) &&
            gapOf(a.corners, b.corners).distance <= distance) {
          found = {a.leaf, b.leaf};
          return true;
        }
    return false;
  }

 private:
  struct Side {
    struct Triangle {
      unsigned leaf;
      TrianglePoints<double> corners;
      fcl::AABBd box;
    };

    Side(const PlacedMesh& mesh, unsigned around) {
      constexpr unsigned kBeside = 64;
      const auto size = static_cast<unsigned>(mesh.mesh.numTriangles());
      const unsigned end = std::min(around + kBeside, size);
      triangles.reserve(2 * kBeside);
      for (unsigned i = around > kBeside ? around - kBeside : 0; i < end; ++i) {
        triangles.push_back({i, mesh.pointsAt(i), {}});
      }
    }
    void bound() {
      for (Triangle& t : triangles) {
        t.box = fcl::AABBd(t.corners[0], t.corners[1], t.corners[2]);
        box += t.box;
      }
    }
    /// Keeps the triangles that may be at most `distance` from a box.
    void keep(double distance, const fcl::AABBd& other) {
      box = fcl::AABBd();
      const auto far = [&](const Triangle& t) { return t.box.distance(other) > distance; };
      triangles.erase(std::remove_if(triangles.begin(), triangles.end(), far), triangles.end());
      for (const Triangle& t : triangles) box += t.box;
    }

    Scratch<Triangle> triangles;
    fcl::AABBd box;
  };

  Side first_, second_;
};

/// What is known of two meshes from call to call.
struct KnownProximity {
  using Meshes = PairOfMeshes;

  RigidMotion rigid;
  /// Total motion of the meshes when the bound was found, and at the last call.
  double moved_then = 0, moved = 0;
  double step = 0, last_step = 0;  ///< motion before each of the last two calls
  int calls = 0;
  double bound = -1;  ///< lower bound of the distance when it was found; negative if there is none
  std::size_t searches = 0;
  TrianglePair witness{0, 0};
  /// Leaves of the pair that the last successful search found.
  std::optional<LeafIndexPair> near;
  LeafIndices leaf_indices[2];
  /// Values of each mesh at the last call.
  std::uint64_t lineages[2] = {0, 0};
  double travels[2] = {0, 0};

  /// Records a pair of triangles that are near. Returns true.
  bool setNear(const Meshes& meshes, const TrianglePair& pair) {
    witness = pair;
    leaf_indices[0].assign(meshes.first.mesh);
    leaf_indices[1].assign(meshes.second.mesh);
    near = LeafIndexPair{leaf_indices[0][pair.first], leaf_indices[1][pair.second]};
    return true;
  }
  /// Whether there is a near pair around the recorded leaves.
  bool isStillNear(const Meshes& meshes, double distance) {
    if (near && Surroundings(meshes, *near).find(distance, *near)) return true;
    near.reset();
    return false;
  }

  /// Whether both meshes have continued the sequence of updates of the last call: neither was
  /// replaced by another mesh, or by an older snapshot of itself.
  bool haveGoneOn(const Meshes& meshes) {
    bool have_gone_on = true;
    for (int i = 0; i < 2; ++i) {
      const MeshState& mesh = (i == 0 ? meshes.first : meshes.second).mesh;
      have_gone_on = have_gone_on && mesh.lineage == lineages[i] && mesh.travel >= travels[i];
      lineages[i] = mesh.lineage;
      travels[i] = mesh.travel;
    }
    if (!have_gone_on) near.reset();
    return have_gone_on;
  }
  /// Records how far the meshes have moved since the last call.
  void move(const Meshes& meshes) {
    const bool have_gone_on = haveGoneOn(meshes);
    const bool moves_on = rigid.moveTo(meshes.first, meshes.second);
    const double before = moved;
    moved = rounding::sum(rounding::sum(rigid.sum(), travels[0]), travels[1]);
    const bool goes_on = have_gone_on && moves_on;
    if (!goes_on) bound = -1;
    last_step = step;
    step = goes_on && calls > 0 ? moved - before : 0;
    ++calls;
  }
  /// Whether the bound proves that no pair is within `distance`. The sums of motion are rounded up;
  /// the last term exceeds the rounding of their sum and difference.
  bool isSurelyFarther(double distance) const {
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return bound >= 0 && bound > distance + (moved - moved_then) + kRounding * (moved + bound);
  }

  /// Whether computing a bound is worthwhile, because it may last for some steps. Otherwise it is
  /// faster to search for near pairs. Before the first step, compares bounding spheres.
  bool isBoundWorth(const Meshes& meshes, double distance) const {
    const double room = meshes.gap(witness).distance - distance;
    const bool may_last =
        calls > 1 ? !(room <= kSteps * usualStep())
                  : areBallsFarther(meshes.first, meshes.second, meshes.to_first, distance);
    return may_last || !isFewEdges(meshes, distance);
  }

  /// Searches for a near pair, after tests of the known pair and of two triangles that are
  /// probably close.
  bool searchNear(const Meshes& meshes, double distance) {
    const double known = meshes.gap(witness).distance;
    if (known <= distance) return setNear(meshes, witness);
    ++searches;
    const TrianglePair close = closeTriangles(meshes);
    const double apart = meshes.gap(close).distance;
    if (apart <= distance) return setNear(meshes, close);
    TrianglePair found{0, 0};
    if (searchAny(meshes, distance, found)) return setNear(meshes, found);
    if (apart < known) witness = close;
    return false;
  }
  /// Like searchNear, but also finds a bound: `distance` plus the motion of several steps like the
  /// last ones, or plus a part of the gap of two known triangles.
  bool searchBound(const Meshes& meshes, double distance) {
    const double least = distance + (isFewEdges(meshes, distance) ? kSteps * usualStep() : 0);
    return canCompare(meshes, least) ? searchByDistance(meshes, distance, least)
                                     : searchByBoxes(meshes, distance);
  }

 private:
  static constexpr double kSteps = 8;  ///< number of steps for which a bound should last

  double usualStep() const { return std::max(step, last_step); }
  void setBound(double farther_than) {
    bound = farther_than;
    moved_then = moved;
  }
  /// Returns early if a pair is within `least`, because a bound would not last.
  bool searchByDistance(const Meshes& meshes, double distance, double least) {
    const double room = meshes.gap(witness).distance - distance;
    if (room <= 0) return setNear(meshes, witness);
    double farther = distance + std::max(2 * kSteps * usualStep(), room / 2);
    if (!compare(meshes, least, witness, farther)) {
      ++searches;
      setBound(static_cast<double>(farther));
      return false;
    }
    if (meshes.gap(witness).distance > distance) return searchNear(meshes, distance);
    ++searches;
    return setNear(meshes, witness);
  }
  /// Searches for a near pair. If there is none, sets a bound: a larger distance if no pair is
  /// within that, else `distance`.
  bool searchByBoxes(const Meshes& meshes, double distance) {
    const double known = meshes.gap(witness).distance;
    if (known <= distance) return setNear(meshes, witness);
    ++searches;
    const double room = known - distance;
    double farther = distance + std::clamp(2 * kSteps * usualStep(), room / 64, room / 2);
    if (searchAny(meshes, farther, witness)) {
      if (meshes.gap(witness).distance <= distance || searchAny(meshes, distance, witness))
        return setNear(meshes, witness);
      farther = distance;
    }
    setBound(farther);
    return false;
  }
};

/// Whether two meshes are at most `distance` apart.
bool areWithin(const PairOfMeshes& meshes, double distance, KnownProximity& known) {
  if (!isTaken(Shortcut::Coherence)) known = KnownProximity();
  known.move(meshes);
  if (known.isStillNear(meshes, distance)) return true;
  if (known.isSurelyFarther(distance)) return false;
  if (!known.isBoundWorth(meshes, distance)) return known.searchNear(meshes, distance);
  return known.searchBound(meshes, distance);
}

}  // namespace

template <typename S>
struct CoherentProximity<S>::State {
  State(const DeformableMesh<S>& one, const DeformableMesh<S>& other) : first(one), second(other) {}

  const DeformableMesh<S>&first, &second;
  KnownProximity known;
};

template <typename S>
CoherentProximity<S>::CoherentProximity(const DeformableMesh<S>& first,
                                        const DeformableMesh<S>& second)
    : state_(std::make_unique<State>(first, second)) {}
template <typename S>
CoherentProximity<S>::~CoherentProximity() = default;
template <typename S>
CoherentProximity<S>::CoherentProximity(CoherentProximity&&) noexcept = default;
template <typename S>
std::size_t CoherentProximity<S>::searches() const {
  return state_->known.searches;
}

template <typename S>
bool CoherentProximity<S>::isNearer(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
                                    S distance) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  const PairOfMeshes meshes(state_->first, tf1, state_->second, tf2);
  return areWithin(meshes, static_cast<double>(distance), state_->known);
}

template class CoherentProximity<float>;
template class CoherentProximity<double>;

}  // namespace adaptive_bvh
