// ContactTracker: regions keep the identity of the last step's region that shares most triangles.
#include <algorithm>
#include <tuple>

#include "adaptive_bvh/contact_regions.h"

namespace adaptive_bvh {

void ContactTracker::begin(std::size_t regions) {
  next_ids_.assign(regions, 0);
  next_uses_.clear();
}

void ContactTracker::addSide(unsigned side, const std::vector<unsigned>& triangles,
                             const std::vector<std::size_t>& begins) {
  for (std::size_t r = 0; r < next_ids_.size(); ++r)
    for (std::size_t i = begins[r]; i < begins[r + 1]; ++i)
      next_uses_.push_back({2 * std::uint64_t(triangles[i]) + side, r});
}

void ContactTracker::finish() {
  std::sort(next_uses_.begin(), next_uses_.end(), [](const Use& a, const Use& b) {
    return std::make_pair(a.triangle, a.region) < std::make_pair(b.triangle, b.region);
  });
  countShares();
  is_continued_.assign(ids_.size(), 0);
  next_events_.clear();
  next_events_.reserve(next_ids_.size() + ids_.size());
  // Nothing is thrown from here on.
  matchRegions();
  reportRegions();
  reportEnded();
  ids_.swap(next_ids_);
  uses_.swap(next_uses_);
  events_.swap(next_events_);
}

/// Counts the triangles common to each old and new region; both lists are sorted by triangle. Sorts
/// the counts: largest first, then by the old region's identity.
void ContactTracker::countShares() {
  shares_.clear();
  auto old = uses_.cbegin();
  for (const Use& use : next_uses_) {
    while (old != uses_.cend() && old->triangle < use.triangle) ++old;
    for (auto i = old; i != uses_.cend() && i->triangle == use.triangle; ++i)
      shares_.push_back({i->region, use.region, 1});
  }
  std::sort(shares_.begin(), shares_.end(), [](const Share& a, const Share& b) {
    return std::make_pair(a.before, a.now) < std::make_pair(b.before, b.now);
  });
  std::size_t kept = 0;
  for (const Share& share : shares_) {
    Share* const last = kept > 0 ? &shares_[kept - 1] : nullptr;
    if (last && last->before == share.before && last->now == share.now)
      ++last->count;
    else
      shares_[kept++] = share;
  }
  shares_.resize(kept);
  std::sort(shares_.begin(), shares_.end(), [&](const Share& a, const Share& b) {
    const auto rank = [&](const Share& s) {
      return std::make_tuple(~s.count, ids_[s.before], s.now);
    };
    return rank(a) < rank(b);
  });
}

/// Matches old and new regions, starting with the pair that shares the most triangles.
void ContactTracker::matchRegions() {
  for (const Share& share : shares_) {
    if (is_continued_[share.before] || next_ids_[share.now] != 0) continue;
    is_continued_[share.before] = 1;
    next_ids_[share.now] = ids_[share.before];
  }
}

/// Reports each new region as persisting, born or split, and gives new identities.
void ContactTracker::reportRegions() {
  for (std::size_t r = 0; r < next_ids_.size(); ++r) {
    if (next_ids_[r] != 0) {
      next_events_.push_back({ContactChange::Persisting, next_ids_[r], next_ids_[r]});
      continue;
    }
    const auto from = std::find_if(shares_.begin(), shares_.end(),
                                   [&](const Share& share) { return share.now == r; });
    next_ids_[r] = ++last_id_;
    if (from == shares_.end())
      next_events_.push_back({ContactChange::Born, next_ids_[r], next_ids_[r]});
    else
      next_events_.push_back({ContactChange::Split, next_ids_[r], ids_[from->before]});
  }
}

/// Reports each old region that no new region continues, as gone or merged.
void ContactTracker::reportEnded() {
  const std::size_t begin = next_events_.size();
  for (std::size_t r = 0; r < ids_.size(); ++r) {
    if (is_continued_[r]) continue;
    const auto into = std::find_if(shares_.begin(), shares_.end(),
                                   [&](const Share& share) { return share.before == r; });
    if (into == shares_.end())
      next_events_.push_back({ContactChange::Gone, ids_[r], ids_[r]});
    else
      next_events_.push_back({ContactChange::Merged, ids_[r], next_ids_[into->now]});
  }
  std::sort(next_events_.begin() + static_cast<std::ptrdiff_t>(begin), next_events_.end(),
            [](const ContactEvent& a, const ContactEvent& b) { return a.id < b.id; });
}

}  // namespace adaptive_bvh
