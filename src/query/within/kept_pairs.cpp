#include "query/within/kept_pairs.h"

#include <algorithm>
#include <limits>

#include "base/task_pool.h"
#include "query/within/leaf_pairs.h"

namespace adaptive_bvh {
namespace {

/// Calls act(i) for each bit i that is set.
template <typename Act>
void forEachBit(unsigned bits, const Act& act) {
  for (; bits; bits &= bits - 1) act(unsigned(__builtin_ctz(bits)));
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
  const bool are_same =
      topologies_[0] == meshes.first.mesh.topology && topologies_[1] == meshes.second.mesh.topology;
  const bool is_known = is_known_ && are_same, had_margin = schedule_.margin() > 0;
  is_known_ = has_next_ = false;
  num_changes_ = 0;
  if (!are_same) replaceMeshes(meshes, request);
  const SetSearch kind = schedule_.next(meshes, request.distance, is_known);
  if (kind != SetSearch::None) search(meshes, request, kind);
  const bool takes_all = kind == SetSearch::Anew;
  if (!takes_all && !tracked_.update(meshes, request.distance, !is_known || !had_margin))
    candidates().forgetReserves();
  test(meshes, request, takes_all);
  schedule_.recordTests(double(tested_) / double(candidates().size() + 1));
  return true;
}

/// Discards all candidates, because the meshes have other triangles than before.
void KeptPairs::replaceMeshes(const KeptMeshes& meshes, const KeptRequest& request) {
  prepareRemoval(request);
  is_self_ = meshes.is_self;
  tracked_ = TrackedMeshes(is_self_);
  schedule_.forget();
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

void KeptPairs::search(const KeptMeshes& meshes, const KeptRequest& request, SetSearch kind) {
  const Leased<std::vector<FeaturePair>> found;
  LeafPairRange range{request.distance, kind == SetSearch::Anew};
  if (kind == SetSearch::Moved)
    range.moved = schedule_.moved();
  else
    range.distance += schedule_.margin();
  findLeafPairs(meshes, request, range, *found);
  ++searches_;
  merge(meshes, *found, kind != SetSearch::Moved);
  schedule_.record(meshes, kind, found->size(), candidates().size());
}

/// Adds the pairs of leaf indices that were found, which become ids.
void KeptPairs::merge(const KeptMeshes& meshes, std::vector<FeaturePair>& found, bool is_all) {
  const auto mergeBy = [&](SmallIds& first, SmallIds& second) {
    if (is_all) {
      next_.assign(found, first, second, rows_, schedule_.margin() > 0, dropped_);
      has_next_ = true;
      return;
    }
    for (FeaturePair& pair : found) pair = {first(pair.first), second(pair.second)};
    rows_.merge(found, first.count(), second.count());
  };
  const auto numTriangles = [&](int side) {
    return static_cast<std::size_t>(meshes.mesh(side).numTriangles());
  };
  SmallIds first(numTriangles(0), tracked_[0].leaves());
  if (meshes.is_self) {
    mergeBy(first, first);
  } else {
    SmallIds second(numTriangles(1), tracked_[1].leaves());
    mergeBy(first, second);
  }
  // Both lists are filled in turns: a search of everything may come after many others.
  rows_.reserveAs(next_);
  next_.reserveAs(rows_);
  dropped_.reserve(rows_.capacity());
}

/// Tests candidates, on several threads, and counts the changes.
void KeptPairs::test(const KeptMeshes& meshes, const KeptRequest& request, bool takes_all) {
  constexpr std::size_t kFewCandidates = 4096;  // one thread is faster
  CandidateRows& rows = candidates();
  const int threads = queryThreads(meshes.first.mesh, meshes.second.mesh);
  const TaskPool pool(rows.size() > kFewCandidates ? threads : 1);
  const auto parts = static_cast<std::size_t>(pool.parts());
  if (changes_.size() < parts) changes_.resize(parts);
  for (CandidateChanges& part : changes_) part.clear();
  const CandidateTester tester(meshes, request, meshes.radii());
  const int size = static_cast<int>(rows.rows().size());
  // A search of everything also finds some pairs that are farther apart than was asked for.
  const double drop_distance =
      has_next_ ? request.distance + schedule_.margin() : std::numeric_limits<double>::infinity();
  pool.forEach(pool.parts(), [&](int part, int) {
    const auto begin = unsigned(partBegin(size, pool.parts(), part)),
               end = unsigned(partBegin(size, pool.parts(), part + 1));
    CandidateChanges& changes = changes_[std::size_t(part)];
    if (takes_all)
      tester.takeAll(rows, tracked_, begin, end, changes);
    else
      tester.testUsedUp(rows, tracked_, drop_distance, begin, end, changes);
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
  addPairs(tester, bodies, numbers);
  commitRemoval(numbers);
  if (has_next_)
    for (const CandidateRows::Dropped& candidate : dropped_) numbers.removeAll(candidate.pairs);
  removePairs(tester, numbers);
  num_changes_ = 0;
  has_next_ = false;
  versions_ = {meshes.first.mesh.version, meshes.second.mesh.version};
  tf1_ = meshes.first.tf;
  tf2_ = meshes.second.tf;
  is_known_ = true;
}

FeatureTests::Pair KeptPairs::pairOf(const CandidateTester& tester, const CandidateChange& change,
                                     unsigned number) const {
  return tester.pair(number, tracked_[0].leaf(change.row),
                     tracked_[1].leaf(rows_.second(change.at)));
}

/// Adds the pairs that are near now.
void KeptPairs::addPairs(const CandidateTester& tester, const BodyPair& bodies,
                         PairNumbers& numbers) {
  for (std::size_t part = 0; part < num_changes_; ++part)
    for (const CandidateChange& change : changes_[part].changes)
      forEachBit(change.bits & ~unsigned(rows_.bits(change.at)), [&](unsigned number) {
        const FeatureTests::Pair pair = pairOf(tester, change, number);
        PairLink& front = rows_.pairs(change.at);
        front = numbers.add(unsigned(pair.kind), pair.features, bodies, front);
      });
}

/// Removes the pairs that are not near any more, and candidates that are dropped: from the last one
/// on, so that a candidate that takes the place of an erased one is done.
void KeptPairs::removePairs(const CandidateTester& tester, PairNumbers& numbers) {
  for (std::size_t part = num_changes_; part-- > 0;)
    for (std::size_t i = changes_[part].changes.size(); i-- > 0;) {
      const CandidateChange& change = changes_[part].changes[i];
      forEachBit(rows_.bits(change.at) & ~unsigned(change.bits), [&](unsigned number) {
        const FeatureTests::Pair pair = pairOf(tester, change, number);
        PairLink& front = rows_.pairs(change.at);
        front = numbers.remove(unsigned(pair.kind), pair.features, front);
      });
      if (change.is_dropped)
        rows_.erase(change.row, change.at);
      else
        rows_.setBits(change.at, change.bits);
    }
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
