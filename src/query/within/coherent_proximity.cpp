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

// CoherentProximity: isNearer for one pair of meshes, step after step. "Near" means within the
// distance of the call. A near pair proves that the meshes are near. A lower bound of the distance,
// less the motion since, proves that they are not: docs/bounds.md, 7.
namespace adaptive_bvh {
namespace {

/// The index of each triangle of a mesh in the order of the tree's leaves.
class LeafIndices {
 public:
  /// Computes the indices, unless they are those of this mesh already.
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

/// The triangles around a pair: up to 64 before and after each in the order of the leaves. While
/// two bodies stay in touch, the place where they touch moves, but rarely far.
class Surroundings {
 public:
  Surroundings(const PairOfMeshes& meshes, const LeafIndexPair& around)
      : first_(meshes.first, around.first),
        second_(meshes.second, around.second),
        radii_(meshes.first.bounds().aabb_radius + meshes.second.bounds().aabb_radius) {
    for (auto& t : second_.triangles)
      for (fcl::Vector3d& x : t.corners) x = meshes.to_first(x);
    for (Side* side : {&first_, &second_}) side->bound();
  }

  /// Whether any two of the triangles are within `distance`. Sets `found` to the first such pair.
  bool find(double distance, LeafIndexPair& found) {
    second_.keep(distance, first_.box);
    first_.keep(distance, second_.box);
    const ExactNearness nearness(distance, radii_);
    for (const auto& a : first_.triangles)
      for (const auto& b : second_.triangles)
        if (a.box.distance(b.box) <= distance &&
            !areSurelyFarther(a.corners, b.corners, distance) &&
            nearness.areNear(gapOf(a.corners, b.corners).distance, a.corners, b.corners)) {
          found = {a.leaf_index, b.leaf_index};
          return true;
        }
    return false;
  }

 private:
  /// The triangles of one mesh.
  struct Side {
    struct Triangle {
      unsigned leaf_index;
      TrianglePoints corners;  ///< in the first mesh's frame
      fcl::AABBd box;
    };

    Side(const PlacedMesh& mesh, unsigned around) {
      constexpr unsigned kBeside = 64;
      const auto size = static_cast<unsigned>(mesh.mesh.numTriangles());
      const unsigned end = std::min(around + kBeside, size);
      triangles.reserve(2 * kBeside);
      for (unsigned i = around > kBeside ? around - kBeside : 0; i < end; ++i)
        triangles.push_back({i, mesh.pointsAt(i), {}});
    }
    /// Sets the boxes.
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
    fcl::AABBd box;  ///< of all triangles
  };

  Side first_, second_;
  const double radii_;
};

/// What is known about the distance of two meshes from call to call.
struct KnownProximity {
  using Meshes = PairOfMeshes;

  RigidMotion rigid;
  double moved = 0;                ///< total motion of the meshes up to the last call, rounded up
  double moved_at_bound = 0;       ///< `moved` when the bound was set
  double step = 0, last_step = 0;  ///< motion between the last two calls, and between those before
  int calls = 0;
  double bound = -1;  ///< lower bound of the distance when it was set; negative if there is none
  std::size_t searches = 0;    ///< number of calls that had to search
  TrianglePair witness{0, 0};  ///< two triangles that are probably close
  /// Indices in the order of the leaves of the last pair that was near; none if it no longer is.
  std::optional<LeafIndexPair> near;
  LeafIndices leaf_indices[2];
  /// MeshState::lineage and MeshState::travel of each mesh at the last call.
  std::uint64_t lineages[2] = {0, 0};
  double travels[2] = {0, 0};

  /// Records a near pair of triangles. Returns true, the answer of a call with a near pair.
  bool setNear(const Meshes& meshes, const TrianglePair& pair) {
    witness = pair;
    leaf_indices[0].assign(meshes.first.mesh);
    leaf_indices[1].assign(meshes.second.mesh);
    near = LeafIndexPair{leaf_indices[0][pair.first], leaf_indices[1][pair.second]};
    return true;
  }
  /// Whether there is a near pair among the triangles around the recorded pair.
  bool isStillNear(const Meshes& meshes, double distance) {
    if (near && Surroundings(meshes, *near).find(distance, *near)) return true;
    near.reset();
    return false;
  }

  /// Whether both meshes continue the sequence of updates of the last call: neither was replaced by
  /// another mesh, or by an older snapshot of itself. Records both sequences for the next call.
  bool continuesUpdates(const Meshes& meshes) {
    bool continues = true;
    for (int i = 0; i < 2; ++i) {
      const MeshState& mesh = (i == 0 ? meshes.first : meshes.second).mesh;
      continues = continues && mesh.lineage == lineages[i] && mesh.travel >= travels[i];
      lineages[i] = mesh.lineage;
      travels[i] = mesh.travel;
    }
    if (!continues) near.reset();
    return continues;
  }
  /// Records how far the meshes have moved since the last call. If unknown, discards the bound.
  void move(const Meshes& meshes) {
    const bool continues_updates = continuesUpdates(meshes);
    const bool continues_sum = rigid.moveTo(meshes.first, meshes.second);
    const double before = moved;
    moved = rounding::sum(rounding::sum(rigid.sum(), travels[0]), travels[1]);
    const bool is_known = continues_updates && continues_sum;
    if (!is_known) bound = -1;
    last_step = step;
    step = is_known && calls > 0 ? moved - before : 0;
    ++calls;
  }
  /// Whether the bound proves that no pair is within `distance`: pairs have come nearer by at most
  /// the motion since. The last term exceeds the rounding of the sum and difference of motions.
  bool isSurelyFarther(double distance) const {
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return bound >= 0 && bound > distance + (moved - moved_at_bound) + kRounding * (moved + bound);
  }

  /// Whether computing a bound is worthwhile, because it may last for kSteps steps: the distance of
  /// the witness, which no bound can exceed, leaves room for their motion. Otherwise it is faster
  /// to search for near pairs. Before the first step, compares bounding spheres.
  bool isBoundWorth(const Meshes& meshes, double distance) const {
    const double room = meshes.gap(witness).distance - distance;
    const bool may_last =
        calls > 1 ? !(room <= kSteps * recentStep())
                  : areBallsFarther(meshes.first, meshes.second, meshes.to_first, distance);
    return may_last || !isFewEdges(meshes, distance);
  }

  /// Returns whether there is a near pair: the witness, that of closeTriangles, or any other.
  bool searchNear(const Meshes& meshes, double distance) {
    if (meshes.isNear(witness, distance)) return setNear(meshes, witness);
    ++searches;
    const TrianglePair close = closeTriangles(meshes);
    if (meshes.isNear(close, distance)) return setNear(meshes, close);
    TrianglePair found{0, 0};
    if (searchAny(meshes, distance, found)) return setNear(meshes, found);
    if (meshes.gap(close).distance < meshes.gap(witness).distance) witness = close;
    return false;
  }
  /// Returns whether there is a near pair. If not, mostly sets a bound larger than `distance`: by
  /// the motion of several steps like the last ones, or by a part of the witness's gap.
  bool searchBound(const Meshes& meshes, double distance) {
    const double useful = distance + (isFewEdges(meshes, distance) ? kSteps * recentStep() : 0);
    return canCompare(meshes, useful) ? searchByDistance(meshes, distance, useful)
                                      : searchByBoxes(meshes, distance);
  }

 private:
  static constexpr double kSteps = 8;  ///< number of steps for which a bound should last

  double recentStep() const { return std::max(step, last_step); }
  void setBound(double lower_bound) {
    bound = lower_bound;
    moved_at_bound = moved;
  }
  /// searchBound by `compare`. Stops at a pair within `useful`, because a bound below that would
  /// not last, and then only searches for a near pair.
  bool searchByDistance(const Meshes& meshes, double distance, double useful) {
    if (meshes.isNear(witness, distance)) return setNear(meshes, witness);
    const double room = std::max(meshes.gap(witness).distance - distance, 0.);
    double lower_bound = distance + std::max(2 * kSteps * recentStep(), room / 2);
    if (!compare(meshes, useful, witness, lower_bound)) {
      ++searches;
      setBound(lower_bound);
      return false;
    }
    if (!meshes.isNear(witness, distance)) return searchNear(meshes, distance);
    ++searches;
    return setNear(meshes, witness);
  }
  /// searchBound by searchAny. The bound is a larger distance if no pair is within it.
  bool searchByBoxes(const Meshes& meshes, double distance) {
    if (meshes.isNear(witness, distance)) return setNear(meshes, witness);
    ++searches;
    const double room = std::max(meshes.gap(witness).distance - distance, 0.);
    double lower_bound = distance + std::clamp(2 * kSteps * recentStep(), room / 64, room / 2);
    if (searchAny(meshes, lower_bound, witness)) {
      if (meshes.isNear(witness, distance) || searchAny(meshes, distance, witness))
        return setNear(meshes, witness);
      lower_bound = distance;
    }
    setBound(lower_bound);
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

struct CoherentProximity::State {
  State(const DeformableMesh& one, const DeformableMesh& other) : first(one), second(other) {}

  const DeformableMesh &first, &second;
  KnownProximity known;
};

CoherentProximity::CoherentProximity(const DeformableMesh& first, const DeformableMesh& second)
    : state_(std::make_unique<State>(first, second)) {}
CoherentProximity::~CoherentProximity() = default;
CoherentProximity::CoherentProximity(CoherentProximity&&) noexcept = default;
std::size_t CoherentProximity::searches() const { return state_->known.searches; }

bool CoherentProximity::isNearer(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2,
                                 double distance) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  const PairOfMeshes meshes(state_->first, tf1, state_->second, tf2);
  return areWithin(meshes, distance, state_->known);
}

}  // namespace adaptive_bvh
