#pragma once

#include <cstdint>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "base/float4.h"
#include "base/leased.h"
#include "query/within/pair_numbers.h"

namespace adaptive_bvh {

/// Small numbers ("ids") for those of many elements that are in use: id i is elements[i]. The map
/// back is in memory of the thread, so that it takes no memory between two uses.
class SmallIds {
 public:
  /// `size`: number of all elements. `elements` must outlive this object, which appends to it.
  SmallIds(std::size_t size, std::vector<unsigned>& elements);
  ~SmallIds() {
    for (const unsigned element : elements_) map()[element] = kNone;
  }
  SmallIds(const SmallIds&) = delete;
  SmallIds& operator=(const SmallIds&) = delete;

  std::size_t count() const { return elements_.size(); }  ///< number of ids
  /// The id of an element, a new one if it has none.
  unsigned operator()(unsigned element) {
    const unsigned id = map()[element];
    return id != kNone ? id : append(element);
  }

 private:
  static constexpr unsigned kNone = ~0u;
  struct Map {
    std::vector<unsigned> ids;  ///< by element; kNone for all, between two uses
  };

  std::vector<unsigned>& map() { return map_->ids; }
  unsigned append(unsigned element);

  const Leased<Map> map_;
  std::vector<unsigned>& elements_;
};

/// The candidates of a ContactSet: pairs of triangles that are near, or a little farther apart.
/// Each triangle of the first mesh has a row of those of the second. Triangles are given by ids
/// (TrackedTriangles). Rows lie in blocks of four candidates, for tests of four at once.
class CandidateRows {
 public:
  /// The pairs of a candidate that are near, a bit for each.
  using Bits = std::uint16_t;

  /// Reserve of a candidate (CandidateTester) whose distance is not known: it must be tested.
  static constexpr float kUnknown = -2;
  /// That of a candidate whose distance is so near the limit that each motion may decide.
  static constexpr float kUndecided = -1;

  struct Row {
    unsigned begin = 0, count = 0, room = 0;
    bool is_new = false;  ///< whether there are candidates with the reserve kUnknown
  };
  /// A candidate that is no longer one.
  struct Dropped {
    PairLink pairs;
    Bits bits;
  };

  const std::vector<Row>& rows() const { return rows_; }
  /// For how many candidates there is memory.
  std::size_t capacity() const { return second_.size(); }
  std::size_t size() const { return size_; }  ///< number of candidates

  unsigned second(unsigned at) const { return second_[at]; }
  Bits bits(unsigned at) const { return bits_[at]; }
  /// How far the parts of a pair may still move, in the form that PairReserve describes.
  Float4& reserve(unsigned at) { return reserves_[at]; }
  PairLink& pairs(unsigned at) { return pairs_[at]; }
  void setBits(unsigned at, Bits bits) { bits_[at] = bits; }
  /// Says that the candidates of a row with the reserve kUnknown are tested.
  void setTested(unsigned row) { rows_[row].is_new = false; }
  const unsigned* seconds() const { return second_.data(); }
  const Bits* allBits() const { return bits_.data(); }
  const Float4* reserves() const { return reserves_.data(); }

  /// Adds the pairs of ids of a search that are not candidates yet, with the reserve kUnknown.
  /// After an exception, further calls are possible.
  void merge(const std::vector<FeaturePair>& found, std::size_t num_first, std::size_t num_second);
  /// Replaces the candidates by the pairs of a search, whose triangles get ids. Candidates of
  /// `last` keep their pairs and reserves; `dropped` gets the candidates with pairs that the search
  /// has not found. `has_reserves`: whether reserves are needed.
  void assign(std::vector<FeaturePair>& found, SmallIds& first, SmallIds& second,
              const CandidateRows& last, bool has_reserves, std::vector<Dropped>& dropped);
  /// Removes a candidate of a row. The last one of the row takes its place.
  void erase(unsigned number, unsigned at);
  /// Allocates as much memory as `other` has. For two lists that are filled in turns.
  void reserveAs(const CandidateRows& other);
  /// Sets all reserves to kUnknown; from now on they are needed.
  void forgetReserves();

 private:
  void mergeRow(unsigned number, unsigned* found, unsigned count, unsigned* marks);
  void layOut(std::vector<FeaturePair>& found, SmallIds& first, SmallIds& second);
  void matchRow(Row& row, const Row& before, const CandidateRows& last, unsigned* marks,
                std::vector<Dropped>& dropped);
  void enlarge(std::size_t size);
  void copy(const CandidateRows& from, unsigned at, unsigned to);
  void setNew(unsigned at, unsigned second);
  void append(Row& row, const unsigned* seconds, unsigned count);
  void moveRow(Row& row, unsigned count);
  void closeGaps();

  std::vector<Row> rows_;  ///< by id of the first triangle
  // By place in a row.
  std::vector<unsigned> second_;  ///< id of the second triangle
  std::vector<Bits> bits_;
  std::vector<PairLink> pairs_;
  std::vector<Float4> reserves_;  ///< empty if they are not needed
  bool has_reserves_ = true;
  unsigned end_ = 0;  ///< of the last row
  std::size_t size_ = 0;
  std::size_t used_ = 0;  ///< sum of the rooms of all rows
};

}  // namespace adaptive_bvh
