#include "query/within/pair_numbers.h"

#include <algorithm>
#include <stdexcept>

namespace adaptive_bvh {
namespace {

constexpr FeaturePair kFreePair{NumberedPairs::kNone, NumberedPairs::kNone};

/// Allocates room for this many elements, and in advance for as many again.
template <typename T>
void reserveSize(std::vector<T>& values, std::size_t size) {
  if (size > values.capacity()) values.reserve(std::max(size, 2 * values.capacity()));
}

}  // namespace

void PairNumbers::begin(const PairCounts& counts) {
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    Kind& kind = kinds_[k];
    NumberedPairs& list = kind.list;
    constexpr std::size_t kMost = 1u << 29;
    const std::size_t size = list.pairs.size() + counts.added[k];
    if (size > kMost)
      throw std::length_error("adaptive_bvh: a ContactSet has room for 2^29 pairs of a kind");
    reserveSize(list.pairs, size);
    reserveSize(kind.next, size);
    if (has_bodies_) reserveSize(list.bodies, size);
    reserveSize(kind.free, size);
    reserveSize(list.added, counts.added[k]);
    reserveSize(list.removed, counts.removed[k]);
    reserveSize(list.removed_pairs, counts.removed[k]);
  }
  // Numbers are used again in the order in which they were removed: neighbours in memory stay so.
  for (Kind& kind : kinds_) {
    kind.free.insert(kind.free.end(), kind.list.removed.rbegin(), kind.list.removed.rend());
    kind.list.added.clear();
    kind.list.removed.clear();
    kind.list.removed_pairs.clear();
  }
}

PairLink PairNumbers::add(unsigned k, const FeaturePair& pair, const BodyPair& bodies,
                          PairLink front) {
  Kind& kind = kinds_[k];
  NumberedPairs& list = kind.list;
  auto number = static_cast<unsigned>(list.pairs.size());
  if (kind.free.empty()) {
    list.pairs.push_back(pair);
    kind.next.push_back(front);
    if (has_bodies_) list.bodies.push_back(bodies);
  } else {
    number = kind.free.back();
    kind.free.pop_back();
    list.pairs[number] = pair;
    kind.next[number] = front;
    if (has_bodies_) list.bodies[number] = bodies;
  }
  list.added.push_back(number);
  ++list.count;
  return {k, number};
}

PairLink PairNumbers::remove(unsigned k, const FeaturePair& pair, PairLink front) {
  PairLink first = front;
  PairLink* link = &first;
  while (link->kind() != k || kinds_[k].list.pairs[link->number()] != pair) link = &next(*link);
  *link = free(*link);
  return first;
}

/// Frees a number. Returns the next pair of its list.
PairLink PairNumbers::free(PairLink link) {
  NumberedPairs& list = kinds_[link.kind()].list;
  list.removed.push_back(link.number());
  list.removed_pairs.push_back(list.pairs[link.number()]);
  list.pairs[link.number()] = kFreePair;
  --list.count;
  return next(link);
}

void PairNumbers::compact(std::array<std::vector<unsigned>, 3>& moved) {
  for (std::size_t k = 0; k < kinds_.size(); ++k) moved[k].resize(kinds_[k].list.pairs.size());
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    unsigned count = 0;
    for (unsigned n = 0; n < moved[k].size(); ++n)
      moved[k][n] = kinds_[k].list.contains(n) ? count++ : NumberedPairs::kNone;
  }
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    Kind& kind = kinds_[k];
    for (PairLink& link : kind.next)
      if (link.exists()) link = {link.kind(), moved[link.kind()][link.number()]};
    Renumbering::apply(moved[k], kind.list.pairs);
    Renumbering::apply(moved[k], kind.next);
    if (has_bodies_) Renumbering::apply(moved[k], kind.list.bodies);
    kind.free.clear();
    kind.list.added.clear();
    kind.list.removed.clear();
    kind.list.removed_pairs.clear();
  }
}

}  // namespace adaptive_bvh
