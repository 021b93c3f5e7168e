#include "query/within/candidate_rows.h"

#include <algorithm>
#include <stdexcept>

namespace adaptive_bvh {
namespace {

/// Memory of a merge.
struct MergeMemory {
  std::vector<unsigned> begins, seconds;  ///< found pairs by row: where each begins; second ids
  std::vector<unsigned> marks;            ///< by second id: kUnmarked, except during a row
};

constexpr unsigned kUnmarked = ~0u, kMatched = ~0u - 1;
constexpr Float4 kUnknownReserve = {0, 0, 0, CandidateRows::kUnknown};

unsigned upToFour(unsigned count) { return (count + 3) & ~3u; }

/// Sorts found pairs by row, in their order.
void sortByRow(const std::vector<FeaturePair>& found, std::size_t rows, MergeMemory& memory) {
  std::vector<unsigned>& begins = memory.begins;
  begins.assign(rows + 2, 0);  // shifted by one while the ids are filled in
  for (const FeaturePair& pair : found) ++begins[pair.first + 2];
  for (std::size_t i = 2; i < begins.size(); ++i) begins[i] += begins[i - 1];
  memory.seconds.resize(found.size());
  for (const FeaturePair& pair : found) memory.seconds[begins[pair.first + 1]++] = pair.second;
}

}  // namespace

SmallIds::SmallIds(std::size_t size, std::vector<unsigned>& elements) : elements_(elements) {
  if (map().size() < size) map().resize(size, kNone);
  for (unsigned i = 0; i < elements.size(); ++i) map()[elements[i]] = i;
}

unsigned SmallIds::append(unsigned element) {
  const auto id = static_cast<unsigned>(elements_.size());
  elements_.push_back(element);
  return map()[element] = id;
}

void CandidateRows::merge(const std::vector<FeaturePair>& found, bool is_all, std::size_t num_first,
                          std::size_t num_second) {
  const Leased<MergeMemory> memory;
  rows_.resize(num_first);
  if (second_.size() > 2 * used_ + 1024) closeGaps();
  sortByRow(found, num_first, *memory);
  if (memory->marks.size() < num_second) memory->marks.resize(num_second, kUnmarked);
  for (unsigned i = 0; i < num_first; ++i) {
    const unsigned begin = memory->begins[i], count = memory->begins[i + 1] - begin;
    if (count > 0 || (is_all && rows_[i].count > 0))
      mergeRow(i, memory->seconds.data() + begin, count, is_all, memory->marks.data());
  }
}

/// Merges the ids found in a row, which are overwritten.
void CandidateRows::mergeRow(unsigned number, unsigned* found, unsigned count, bool is_all,
                             unsigned* marks) {
  Row& row = rows_[number];
  const unsigned end = row.begin + row.count;
  for (unsigned at = row.begin; at < end; ++at) marks[second_[at]] = at;
  unsigned added = 0;
  for (unsigned i = 0; i < count; ++i) {
    const unsigned at = marks[found[i]];
    if (at == kUnmarked) {
      found[added++] = found[i];
    } else if (at != kMatched) {
      marks[found[i]] = kMatched;
      bits_[at] &= Bits(~kAbsent);
    }
  }
  for (unsigned at = row.begin; at < end; ++at) {
    unsigned& mark = marks[second_[at]];
    if (is_all && mark != kMatched) {
      bits_[at] |= kAbsent;
      reserves_[at] = kUnknownReserve;
    }
    mark = kUnmarked;
  }
  if (added > 0) append(row, found, added);
}

void CandidateRows::append(Row& row, const unsigned* seconds, unsigned count) {
  if (row.count + count > row.room) moveRow(row, row.count + count);
  const unsigned end = row.begin + row.count;
  for (unsigned i = 0; i < count; ++i) {
    second_[end + i] = seconds[i];
    bits_[end + i] = 0;
    pairs_[end + i] = PairLink();
    reserves_[end + i] = kUnknownReserve;
  }
  row.count += count;
  size_ += count;
}

/// Moves a row to the end, with room for `count` candidates and some more.
void CandidateRows::moveRow(Row& row, unsigned count) {
  const unsigned room = upToFour(count + count / 4);
  const std::size_t begin = second_.size();
  if (begin + room >= kMatched) throw std::length_error("adaptive_bvh: a ContactSet is too large");
  const auto reserveFor = [&](auto& values) {
    if (begin + room > values.capacity())
      values.reserve(std::max(begin + room, 2 * values.capacity()));
  };
  reserveFor(second_);
  reserveFor(bits_);
  reserveFor(pairs_);
  reserveFor(reserves_);
  second_.resize(begin + room);
  bits_.resize(begin + room);
  pairs_.resize(begin + room);
  reserves_.resize(begin + room);
  const auto copy = [&](auto& values) {
    std::copy_n(values.data() + row.begin, row.count, values.data() + begin);
  };
  copy(second_);
  copy(bits_);
  copy(pairs_);
  copy(reserves_);
  used_ += room - row.room;
  row.begin = static_cast<unsigned>(begin);
  row.room = room;
}

/// Copies all rows one after the other, without gaps between them.
void CandidateRows::closeGaps() {
  CandidateRows dense;
  dense.rows_.resize(rows_.size());
  const auto reserveFor = [&](auto& values) { values.reserve(used_ + used_ / 4); };
  reserveFor(dense.second_);
  reserveFor(dense.bits_);
  reserveFor(dense.pairs_);
  reserveFor(dense.reserves_);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& from = rows_[i];
    Row& to = dense.rows_[i];
    if (from.count == 0) continue;
    dense.moveRow(to, from.count);
    to.count = from.count;
    std::copy_n(second_.data() + from.begin, from.count, dense.second_.data() + to.begin);
    std::copy_n(bits_.data() + from.begin, from.count, dense.bits_.data() + to.begin);
    std::copy_n(pairs_.data() + from.begin, from.count, dense.pairs_.data() + to.begin);
    std::copy_n(reserves_.data() + from.begin, from.count, dense.reserves_.data() + to.begin);
  }
  dense.size_ = size_;
  *this = std::move(dense);
}

void CandidateRows::erase(unsigned number, unsigned at) {
  Row& row = rows_[number];
  const unsigned last = row.begin + --row.count;
  second_[at] = second_[last];
  bits_[at] = bits_[last];
  pairs_[at] = pairs_[last];
  reserves_[at] = reserves_[last];
  --size_;
}

void CandidateRows::forgetReserves() {
  std::fill(reserves_.begin(), reserves_.end(), kUnknownReserve);
}

}  // namespace adaptive_bvh
