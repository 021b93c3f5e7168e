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

inline void CandidateRows::copy(const CandidateRows& from, unsigned at, unsigned to) {
  second_[to] = from.second_[at];
  bits_[to] = from.bits_[at];
  pairs_[to] = from.pairs_[at];
  if (has_reserves_) reserves_[to] = from.reserves_[at];
}
inline void CandidateRows::setNew(unsigned at, unsigned second) {
  second_[at] = second;
  bits_[at] = 0;
  pairs_[at] = PairLink();
  if (has_reserves_) reserves_[at] = kUnknownReserve;
}

void CandidateRows::merge(const std::vector<FeaturePair>& found, std::size_t num_first,
                          std::size_t num_second) {
  const Leased<MergeMemory> memory;
  rows_.resize(num_first);
  if (end_ > 2 * used_ + 1024) closeGaps();
  sortByRow(found, num_first, *memory);
  if (memory->marks.size() < num_second) memory->marks.resize(num_second, kUnmarked);
  for (unsigned i = 0; i < num_first; ++i) {
    const unsigned begin = memory->begins[i], count = memory->begins[i + 1] - begin;
    if (count > 0) mergeRow(i, memory->seconds.data() + begin, count, memory->marks.data());
  }
}

/// Merges the ids found in a row, which are overwritten.
void CandidateRows::mergeRow(unsigned number, unsigned* found, unsigned count, unsigned* marks) {
  Row& row = rows_[number];
  const unsigned end = row.begin + row.count;
  for (unsigned at = row.begin; at < end; ++at) marks[second_[at]] = kMatched;
  unsigned added = 0;
  for (unsigned i = 0; i < count; ++i)
    if (marks[found[i]] == kUnmarked) found[added++] = found[i];
  for (unsigned at = row.begin; at < end; ++at) marks[second_[at]] = kUnmarked;
  if (added > 0) append(row, found, added);
}

void CandidateRows::append(Row& row, const unsigned* seconds, unsigned count) {
  if (row.count + count > row.room) moveRow(row, row.count + count);
  row.is_new = true;
  for (unsigned i = 0; i < count; ++i) setNew(row.begin + row.count + i, seconds[i]);
  row.count += count;
  size_ += count;
}

void CandidateRows::assign(std::vector<FeaturePair>& found, SmallIds& first, SmallIds& second,
                           const CandidateRows& last, bool has_reserves,
                           std::vector<Dropped>& dropped) {
  const Leased<MergeMemory> memory;
  std::vector<unsigned>& marks = memory->marks;
  has_reserves_ = has_reserves && last.has_reserves_;
  layOut(found, first, second);
  if (marks.size() < second.count()) marks.resize(second.count(), kUnmarked);
  dropped.clear();
  dropped.reserve(last.capacity());  // matchRow must not throw, as it changes the marks
  for (std::size_t i = 0; i < rows_.size(); ++i)
    matchRow(rows_[i], i < last.rows_.size() ? last.rows_[i] : Row(), last, marks.data(), dropped);
}

/// Fills the rows with the second ids of pairs, in their order. Overwrites the first ones by ids.
void CandidateRows::layOut(std::vector<FeaturePair>& found, SmallIds& first, SmallIds& second) {
  rows_.assign(first.count(), Row());
  for (FeaturePair& pair : found) {
    pair.first = first(pair.first);
    if (pair.first == rows_.size()) rows_.emplace_back();
    ++rows_[pair.first].room;
  }
  std::size_t end = 0;
  for (Row& row : rows_) {
    row.begin = static_cast<unsigned>(end);
    row.room = upToFour(row.room);
    end += row.room;
  }
  enlarge(end);
  end_ = static_cast<unsigned>(end);
  for (const FeaturePair& pair : found) {
    Row& row = rows_[pair.first];
    second_[row.begin + row.count++] = second(pair.second);
  }
  for (const Row& row : rows_)
    for (unsigned i = row.count; i < row.room; ++i) second_[row.begin + i] = 0;
  size_ = found.size();
  used_ = end_;
}

/// Copies what a row of `last` has of the same candidates.
void CandidateRows::matchRow(Row& row, const Row& before, const CandidateRows& last,
                             unsigned* marks, std::vector<Dropped>& dropped) {
  for (unsigned at = before.begin; at < before.begin + before.count; ++at)
    marks[last.second_[at]] = at;
  row.is_new = before.is_new;
  for (unsigned at = row.begin; at < row.begin + row.count; ++at) {
    unsigned& mark = marks[second_[at]];
    if (mark == kUnmarked) {
      setNew(at, second_[at]);
      row.is_new = true;
    } else {
      copy(last, mark, at);
      mark = kMatched;
    }
  }
  for (unsigned at = before.begin; at < before.begin + before.count; ++at) {
    unsigned& mark = marks[last.second_[at]];
    if (mark != kMatched && last.bits_[at]) dropped.push_back({last.pairs_[at], last.bits_[at]});
    mark = kUnmarked;
  }
}

void CandidateRows::reserveAs(const CandidateRows& other) {
  rows_.reserve(other.rows_.size());
  enlarge(other.capacity());
}

/// Enlarges the arrays to at least this size.
void CandidateRows::enlarge(std::size_t size) {
  if (size >= kMatched) throw std::length_error("adaptive_bvh: a ContactSet is too large");
  const auto enlargeTo = [&](auto& values) {
    if (size > values.capacity()) values.reserve(std::max(size, values.size() + values.size() / 2));
    if (size > values.size()) values.resize(size);
  };
  enlargeTo(bits_);
  enlargeTo(pairs_);
  if (has_reserves_) enlargeTo(reserves_);
  enlargeTo(second_);
}

/// Moves a row to the end, with room for `count` candidates and some more.
void CandidateRows::moveRow(Row& row, unsigned count) {
  const unsigned room = upToFour(count + count / 4), begin = end_;
  enlarge(std::size_t(begin) + room);
  for (unsigned i = 0; i < row.count; ++i) copy(*this, row.begin + i, begin + i);
  for (unsigned i = row.count; i < room; ++i) second_[begin + i] = 0;
  end_ += room;
  used_ += room - row.room;
  row.begin = begin;
  row.room = room;
}

/// Copies all rows one after the other, without gaps between them.
void CandidateRows::closeGaps() {
  CandidateRows dense;
  dense.has_reserves_ = has_reserves_;
  dense.rows_ = rows_;
  dense.enlarge(used_ + used_ / 4);
  for (Row& row : dense.rows_) {
    const unsigned from = row.begin;
    row.begin = dense.end_;
    for (unsigned i = 0; i < row.room; ++i) dense.copy(*this, from + i, row.begin + i);
    dense.end_ += row.room;
  }
  dense.used_ = used_;
  dense.size_ = size_;
  *this = std::move(dense);
}

void CandidateRows::erase(unsigned number, unsigned at) {
  Row& row = rows_[number];
  copy(*this, row.begin + --row.count, at);
  --size_;
}

void CandidateRows::forgetReserves() {
  has_reserves_ = true;
  enlarge(end_);
  std::fill(reserves_.begin(), reserves_.end(), kUnknownReserve);
  for (Row& row : rows_) row.is_new = true;
}

}  // namespace adaptive_bvh
