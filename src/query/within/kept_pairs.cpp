#include "query/within/kept_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/shortcut.h"
#include "base/task_pool.h"
#include "query/within/collect_pairs.h"
#include "query/within/search_margin.h"

namespace adaptive_bvh {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// A sink of WithinTests: pairs of leaf indices. `kTakesAll`: also pairs that corners alone do not
/// prove to be apart.
template <bool kTakesAll>
class LeafPairSink {
 public:
  using Result = std::vector<FeaturePair>;
  static constexpr int kBatch = 256;
  static constexpr bool kStopsAtFirst = false, kTakesUndecided = kTakesAll;

  LeafPairSink(bool is_self, Result& result) : is_self_(is_self), result_(result) {}

  void clear() { result_.clear(); }
  static bool needsGap() { return false; }
  static bool isDone() { return false; }
  ADAPTIVE_BVH_INLINE void add(const LeafIndexPair& pair, const TriangleGap*) {
    const bool swaps = is_self_ && pair.first > pair.second;
    appendPair(swaps ? pair.second : pair.first, swaps ? pair.first : pair.second, result_);
  }

  LeafPairSink another(Result& result) const { return {is_self_, result}; }
  using Mark = std::size_t;
  Mark mark() const { return result_.size(); }
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    joinParts(tasks, pool, result_, [](const Found& task) {
      return VectorPart(task.worker->sink().result_, task.from, task.to);
    });
  }

 private:
  const bool is_self_;
  Result& result_;
};

/// Finds the pairs of triangles within a distance: near ones, or with kTakesAll perhaps some
/// others.
template <bool kTakesAll>
void findLeafPairs(const KeptMeshes& meshes, const KeptRequest& request, double distance,
                   const MarkedNodes& marked, std::vector<FeaturePair>& found) {
  const auto makeSink = [&](const PairInput&) -> LeafPairSink<kTakesAll> {
    return {meshes.is_self, found};
  };
  if (!meshes.is_self)
    return collectPairs({meshes.first, meshes.second}, distance, makeSink, marked);
  const NeighbourFilter filter = request.has_features ? NeighbourFilter::None : request.filter;
  const bool skips_flat = request.has_features || filter == NeighbourFilter::SharedVertex;
  collectOwnPairs(meshes.first, distance, filter, skips_flat, makeSink, marked);
}

double radiiOf(const KeptMeshes& meshes) {
  return meshes.first.bounds().aabb_radius + meshes.second.bounds().aabb_radius;
}

/// A ball around both meshes, in the frame of the first.
struct EnclosingBall {
  fcl::Vector3d centre;
  double radius;
};
EnclosingBall ballAround(const KeptMeshes& meshes) {
  const LocalBounds<double>&a = meshes.first.bounds(), &b = meshes.second.bounds();
  if (meshes.is_self) return {a.aabb_center, a.aabb_radius};
  const fcl::Vector3d first = a.aabb_center, second = meshes.to_first(b.aabb_center);
  return {(first + second) / 2,
          (first - second).norm() / 2 + std::max(a.aabb_radius, b.aabb_radius)};
}
MotionUnit unitOf(const KeptMeshes& meshes) {
  constexpr int kMost = 999;
  const EnclosingBall ball = ballAround(meshes);
  MotionUnit unit;
  unit.origin = ball.centre;
  if (ball.radius > 0)
    unit.scale = std::ldexp(1., -std::clamp(std::ilogb(ball.radius), -kMost, kMost) - 1);
  return unit;
}

/// The share of a margin that vertices may use: the rest covers all rounding.
constexpr double kUsable = 1 - 1. / (1 << 10);

/// A search also visits vertices that have used this part of it, so that searches are rarer.
constexpr double kSoon = 0.5;

/// Whether that rest exceeds the rounding of positions and distances.
bool isPreciseMargin(const KeptMeshes& meshes, double distance, double margin) {
  constexpr double kRounding = 0x1p-34, kFloat = 0x1p-14, kSmallest = 1e-140, kLargest = 1e140;
  const EnclosingBall ball = ballAround(meshes);
  const double size = ball.centre.lpNorm<1>() + ball.radius + meshes.to_first.T.lpNorm<1>();
  return margin > kSmallest && size < kLargest && margin > kFloat * ball.radius &&
         margin > kRounding * (size + (distance < kUnlimited ? distance : 0));
}

/// Whether candidates can be tracked, and nodes compared, in single precision.
bool canTrack(const KeptMeshes& meshes) {
  return isTaken(Shortcut::Coherence) &&
         (meshes.is_self ||
          RelativeFrame(meshes.first.tree(), meshes.second.tree(), meshes.to_first).isPrecise());
}

double largerEdge(const KeptMeshes& meshes) {
  return std::max(meanEdge(meshes.first.mesh), meanEdge(meshes.second.mesh));
}

}  // namespace

bool KeptPairs::isCurrent(const KeptMeshes& meshes) const {
  if (!is_known_) return false;
  for (int i = 0; i < 2; ++i)
    if (meshes.mesh(i).version != versions_[std::size_t(i)] ||
        meshes.mesh(i).topology != topologies_[std::size_t(i)])
      return false;
  return meshes.is_self ||
         (meshes.first.tf.matrix() == tf1_.matrix() && meshes.second.tf.matrix() == tf2_.matrix());
}

bool KeptPairs::prepare(const KeptMeshes& meshes, const KeptRequest& request) {
  tested_ = 0;
  if (isCurrent(meshes)) return false;
  const bool was_known = is_known_;
  is_known_ = has_next_ = false;
  num_changes_ = 0;
  const bool are_same =
      topologies_[0] == meshes.first.mesh.topology && topologies_[1] == meshes.second.mesh.topology;
  if (!are_same) replaceMeshes(meshes, request);
  motion_.moveTo(meshes);
  const double margin = margin_;
  const Search kind = nextSearch(meshes, request, was_known && are_same);
  used_ = margin_ / 2;  // unless a search is made
  if (kind != Search::None) search(meshes, request, kind);
  const bool takes_all = kind == Search::Anew;
  if (!takes_all) track(meshes, request, !was_known || !are_same || margin == 0);
  test(meshes, request, takes_all);
  return true;
}

/// Discards all candidates, because the meshes have other triangles than before.
void KeptPairs::replaceMeshes(const KeptMeshes& meshes, const KeptRequest& request) {
  prepareRemoval(request);
  tracked_ = {};
  leaves_ = {};
  for (SearchedVertices& side : searched_) side.clear();
  margin_ = 0;
  is_self_ = meshes.is_self;
  topologies_ = {meshes.first.mesh.topology, meshes.second.mesh.topology};
}

void KeptPairs::prepareRemoval(const KeptRequest& request) {
  is_known_ = has_next_ = false;
  num_changes_ = 0;
  PairCounts counts = discarded_counts_;
  std::vector<PairLink> links = discarded_;
  for (const CandidateRows::Row& row : rows_.rows())
    for (unsigned at = row.begin; at < row.begin + row.count; ++at) {
      if (rows_.pairs(at).exists()) links.push_back(rows_.pairs(at));
      counts.countRemoved(request.kindsOf(rows_.bits(at), is_self_));
    }
  discarded_ = std::move(links);
  discarded_counts_ = counts_ = counts;
  rows_ = CandidateRows();
}

KeptPairs::Search KeptPairs::nextSearch(const KeptMeshes& meshes, const KeptRequest& request,
                                        bool was_known) {
  constexpr double kEnter = 0.6, kStay = 0.9;  // largest cost, in queries, to use a margin
  ++steps_;
  if (!canTrack(meshes)) return searchWithin(meshes, request, 0);
  constexpr double kFar = 8;  // edges; margins need not grow with the distance beyond that
  const auto choose = [&](double speed, double enough) {
    const double edge = largerEdge(meshes);
    return SearchMargin::choose(speed, std::min(request.distance, kFar * edge), edge, enough);
  };
  if (!was_known) return searchWithin(meshes, request, margin_ > 0 ? margin_ : choose(0, 1));
  if (margin_ == 0) {
    if (!searched_[0].isEmpty()) measureVertices(meshes, largerEdge(meshes));
    const double speed = searched_[0].isEmpty() ? motion_.lastStep() / 2 : moved_.mean();
    return searchWithin(meshes, request, choose(speed, kEnter));
  }
  const double used = motion_.sinceRestart();
  if (used <= allowance_) return Search::None;
  double speed = used / 2 / steps_;
  if (!searched_[0].isEmpty()) {
    constexpr double kPart = 0.25;  // beyond it, a search of everything takes as long
    measureVertices(meshes, margin_ / 2 * kUsable);
    if (moved_.beyond == 0) {
      allowMotion();
      return Search::None;
    }
    if (moved_.share() < kPart) return Search::Marked;
    speed = (searched_share_ * kSoon * margin_ / 2 + moved_.mean()) / steps_;
  }
  if (used == kUnlimited) return searchWithin(meshes, request, margin_);
  return searchWithin(meshes, request, choose(speed, kStay));
}

/// Chooses a search of everything: within a margin, or anew in each step if that is 0 or smaller
/// than what single precision can measure.
KeptPairs::Search KeptPairs::searchWithin(const KeptMeshes& meshes, const KeptRequest& request,
                                          double margin) {
  margin_ = isPreciseMargin(meshes, request.distance, margin) ? margin : 0;
  steps_ = searched_share_ = 0;
  return margin_ > 0 ? Search::All : Search::Anew;
}

/// Measures how far vertices have moved since a search visited them. If many have, it takes off
/// their mean motion where that makes the motions shorter.
void KeptPairs::measureVertices(const KeptMeshes& meshes, double limit) {
  constexpr double kMany = 0.1;
  const auto measure = [&] {
    moved_ = VertexMotion(limit, kSoon * limit);
    for (int side = 0; side < meshes.sides(); ++side) {
      const auto at = static_cast<std::size_t>(side);
      moved_vertices_[at].clear();
      meshes.withMap(side, [&](const auto& map) {
        searched_[at].measure(meshes.mesh(side), map, translation_, moved_, moved_vertices_[at]);
      });
    }
  };
  measure();
  if (moved_.share() < kMany) return;
  fcl::Vector3d sum = fcl::Vector3d::Zero();
  double squares = 0;
  for (int side = 0; side < meshes.sides(); ++side)
    meshes.withMap(side, [&](const auto& map) {
      searched_[std::size_t(side)].addSums(meshes.mesh(side), map, translation_, sum, squares);
    });
  const fcl::Vector3d mean = sum / double(moved_.vertices);
  if (!(mean.squaredNorm() * double(moved_.vertices) > squares / 2)) return;
  translation_ += mean;
  measure();
}

/// After a search, or when all vertices were measured: how far they may move until the next time.
void KeptPairs::allowMotion() {
  motion_.restart();
  allowance_ = margin_ * kUsable - 2 * std::max(moved_.most, moved_.beyond ? 0 : moved_.largest);
}

void KeptPairs::search(const KeptMeshes& meshes, const KeptRequest& request, Search kind) {
  const Leased<std::vector<FeaturePair>> found;
  double reach = request.distance;
  MarkedNodes marked{};
  if (kind == Search::Marked) {
    markMoved(meshes);
    marked = {marks_[0].data(), marks_[meshes.is_self ? 0 : 1].data()};
    reach += moved_.most;
  }
  if (kind == Search::Anew)
    findLeafPairs<false>(meshes, request, reach, marked, *found);
  else
    findLeafPairs<true>(meshes, request, reach + margin_, marked, *found);
  ++searches_;
  merge(meshes, *found, kind != Search::Marked);
  recordSearch(meshes, kind);
}

/// Marks the nodes with moved vertices below, and in leaves the triangles that have one.
void KeptPairs::markMoved(const KeptMeshes& meshes) {
  const Leased<std::vector<std::uint8_t>> leased;
  std::vector<std::uint8_t>& is_moved = *leased;  // by vertex
  for (int side = 0; side < meshes.sides(); ++side) {
    const auto at = static_cast<std::size_t>(side);
    const MeshState& mesh = meshes.mesh(side);
    MovedLeaves& leaves = leaves_[at];
    std::vector<std::uint8_t>& marks = marks_[at];
    if (leaves.isEmpty()) leaves = MovedLeaves(mesh.tree, mesh.vertices.size());
    marks.assign(static_cast<std::size_t>(mesh.tree.size()), 0);
    is_moved.assign(mesh.vertices.size(), 0);
    for (const unsigned v : moved_vertices_[at]) {
      leaves.add(v);
      is_moved[v] = 1;
    }
    leaves.refitAll([&](int number) {
      const WideNode& node = mesh.tree.nodes()[number];
      unsigned mark = !node.isLeaf();
      for (int i = 0; node.isLeaf() && i < int(node.count); ++i) {
        const Int4& v = mesh.tree.corners(unsigned(node.first + i));
        mark |= unsigned(is_moved[std::size_t(v[0])] | is_moved[std::size_t(v[1])] |
                         is_moved[std::size_t(v[2])])
                << i;
      }
      marks[std::size_t(number)] = static_cast<std::uint8_t>(mark);
    });
  }
}

/// Adds the pairs of leaf indices that were found, which become ids.
void KeptPairs::merge(const KeptMeshes& meshes, std::vector<FeaturePair>& found, bool is_all) {
  const auto numTriangles = [&](int side) {
    return static_cast<std::size_t>(meshes.mesh(side).numTriangles());
  };
  std::vector<unsigned>& first = tracked_[0].leaves();
  if (meshes.is_self) {
    SmallIds ids(numTriangles(0), first);
    for (FeaturePair& pair : found) pair = {ids(pair.first), ids(pair.second)};
  } else {
    SmallIds ids1(numTriangles(0), first), ids2(numTriangles(1), tracked_[1].leaves());
    for (FeaturePair& pair : found) pair = {ids1(pair.first), ids2(pair.second)};
  }
  if (is_all) {
    next_.assign(found, first.size(), tracked(1).size(), rows_, margin_ > 0, dropped_);
    has_next_ = true;
  } else {
    rows_.merge(found, first.size(), tracked(1).size());
  }
  // Both lists are filled in turns: a search of everything may come after many others.
  rows_.reserveAs(next_);
  next_.reserveAs(rows_);
  dropped_.reserve(rows_.capacity());
}

/// Records where the vertices are that the search has visited. Where the meshes have many more
/// vertices than there are candidates, measuring them would take longer than a search.
void KeptPairs::recordSearch(const KeptMeshes& meshes, Search kind) {
  constexpr std::size_t kVerticesPerCandidate = 4;
  const bool is_marked = kind == Search::Marked;
  std::size_t vertices = 0;
  for (int side = 0; side < meshes.sides(); ++side) vertices += meshes.mesh(side).vertices.size();
  const bool is_measured = vertices <= kVerticesPerCandidate * candidates().size();
  if (!is_marked) {
    translation_.setZero();
    moved_ = VertexMotion();
  }
  searched_share_ += moved_.share();
  used_ = moved_.most;
  for (int side = 0; side < meshes.sides(); ++side) {
    const auto at = static_cast<std::size_t>(side);
    const MeshState& mesh = meshes.mesh(side);
    if (!is_marked && !is_measured) searched_[at].clear();
    if (!is_marked && is_measured)
      meshes.withMap(side, [&](const auto& map) { searched_[at].assign(mesh, map); });
    if (is_marked)
      meshes.withMap(side, [&](const auto& map) {
        for (const unsigned v : moved_vertices_[at])
          searched_[at].visit(v, mesh, map, translation_);
      });
  }
  allowMotion();
}

/// Brings positions and motion of the candidates' triangles up to date.
void KeptPairs::track(const KeptMeshes& meshes, const KeptRequest& request, bool is_new) {
  constexpr float kLargestDeformation = 1;  // in the unit, so that sums of two stay precise
  if (is_new || radiiOf(meshes) > 2 * radii_) restartTracking(meshes, request);
  bool fits = readPositions(meshes);
  if (!fits) {
    const MotionUnit unit = unitOf(meshes);
    unit_.origin = unit.origin;
    fits = true;
    for (int side = 0; side < meshes.sides(); ++side) fits = tracked(side).convert(unit_) && fits;
    if (!fits) {
      restartTracking(meshes, request);
      readPositions(meshes);
    }
  }
  float deformation = 0;
  for (int side = 0; side < meshes.sides(); ++side)
    deformation = std::max(deformation, tracked(side).measure());
  if (!(deformation > kLargestDeformation)) return;
  restartTracking(meshes, request);
  readPositions(meshes);
  for (int side = 0; side < meshes.sides(); ++side) tracked(side).measure();
}

bool KeptPairs::readPositions(const KeptMeshes& meshes) {
  bool fits = true;
  for (int side = 0; side < meshes.sides(); ++side)
    meshes.withMap(side, [&](const auto& map) {
      fits = tracked(side).read(meshes.mesh(side), map, unit_) && fits;
    });
  return fits;
}

/// Begins with a unit for the present size of the meshes; all candidates are to be tested.
void KeptPairs::restartTracking(const KeptMeshes& meshes, const KeptRequest& request) {
  constexpr double kRounding = 0x1p-41;  // docs/bounds.md, 21
  unit_ = unitOf(meshes);
  radii_ = radiiOf(meshes);
  rounding_ = kRounding * (radii_ + (request.distance < kUnlimited ? request.distance : 0));
  for (TrackedTriangles& side : tracked_) side.forgetMotion();
  candidates().forgetReserves();
}

/// Tests candidates, on several threads, and counts the changes.
void KeptPairs::test(const KeptMeshes& meshes, const KeptRequest& request, bool takes_all) {
  constexpr std::size_t kFewCandidates = 4096;  // one thread is faster
  CandidateRows& rows = candidates();
  const int threads = std::max(meshes.first.mesh.query_threads, meshes.second.mesh.query_threads);
  const TaskPool pool(rows.size() > kFewCandidates ? threads : 1);
  const auto parts = static_cast<std::size_t>(pool.parts());
  if (changes_.size() < parts) changes_.resize(parts);
  for (CandidateChanges& part : changes_) part.clear();
  const CandidateTester tester(meshes, request, radiiOf(meshes));
  const int size = static_cast<int>(rows.rows().size());
  const double drop_distance = request.distance + margin_ + 2 * used_;
  pool.forEach(pool.parts(), [&](int part, int) {
    const auto begin = unsigned(partBegin(size, pool.parts(), part)),
               end = unsigned(partBegin(size, pool.parts(), part + 1));
    CandidateChanges& changes = changes_[std::size_t(part)];
    if (takes_all)
      tester.takeAll(rows, tracked_[0].leaves(), tracked(1).leaves(), begin, end, changes);
    else
      tester.testUsedUp({rows, tracked_[0], tracked(1), unit_}, drop_distance, rounding_, begin,
                        end, changes);
  });
  counts_ = discarded_counts_;
  if (has_next_)
    for (const CandidateRows::Dropped& candidate : dropped_)
      counts_.countRemoved(request.kindsOf(candidate.bits, is_self_));
  for (const CandidateChanges& part : changes_) {
    counts_.add(part.counts);
    tested_ += part.tested;
  }
  num_changes_ = parts;
}

void KeptPairs::commit(const KeptMeshes& meshes, const KeptRequest& request, const BodyPair& bodies,
                       PairNumbers& numbers) noexcept {
  if (has_next_) std::swap(rows_, next_);
  const CandidateTester tester(meshes, request, 0);
  const auto pairOf = [&](const CandidateChange& change, unsigned number) {
    return tester.pair(number, tracked_[0].leaf(change.row),
                       tracked(1).leaf(rows_.second(change.at)));
  };
  const auto forEachBit = [](unsigned bits, const auto& act) {
    for (; bits; bits &= bits - 1) act(unsigned(__builtin_ctz(bits)));
  };
  for (std::size_t part = 0; part < num_changes_; ++part)
    for (const CandidateChange& change : changes_[part].changes)
      forEachBit(change.bits & ~unsigned(rows_.bits(change.at)), [&](unsigned number) {
        const FeatureTests::Pair pair = pairOf(change, number);
        PairLink& front = rows_.pairs(change.at);
        front = numbers.add(unsigned(pair.kind), pair.features, bodies, front);
      });
  commitRemoval(numbers);
  if (has_next_)
    for (const CandidateRows::Dropped& candidate : dropped_) numbers.removeAll(candidate.pairs);
  // From the last one on: a candidate that takes the place of an erased one is done.
  for (std::size_t part = num_changes_; part-- > 0;)
    for (std::size_t i = changes_[part].changes.size(); i-- > 0;) {
      const CandidateChange& change = changes_[part].changes[i];
      forEachBit(rows_.bits(change.at) & ~unsigned(change.bits), [&](unsigned number) {
        const FeatureTests::Pair pair = pairOf(change, number);
        PairLink& front = rows_.pairs(change.at);
        front = numbers.remove(unsigned(pair.kind), pair.features, front);
      });
      if (change.is_dropped)
        rows_.erase(change.row, change.at);
      else
        rows_.setBits(change.at, change.bits);
    }
  num_changes_ = 0;
  has_next_ = false;
  versions_ = {meshes.first.mesh.version, meshes.second.mesh.version};
  tf1_ = meshes.first.tf;
  tf2_ = meshes.second.tf;
  is_known_ = true;
}

void KeptPairs::commitRemoval(PairNumbers& numbers) noexcept {
  for (const PairLink front : discarded_) numbers.removeAll(front);
  discarded_.clear();
  discarded_counts_ = {};
}

void KeptPairs::renumber(const std::array<std::vector<unsigned>, 3>& moved) noexcept {
  for (const CandidateRows::Row& row : rows_.rows())
    for (unsigned at = row.begin; at < row.begin + row.count; ++at) {
      PairLink& link = rows_.pairs(at);
      if (link.exists()) link = {link.kind(), moved[link.kind()][link.number()]};
    }
}

}  // namespace adaptive_bvh
