#include <algorithm>
#include <tuple>

#include "adaptive_bvh/contact_regions.h"

namespace adaptive_bvh {

void ContactTracker::begin(std::size_t regions) {
  std::swap(ids_, old_ids_);
  std::swap(uses_, old_uses_);
  ids_.assign(regions, 0);
  uses_.clear();
}

void ContactTracker::addSide(unsigned side, const std::vector<unsigned>& triangles,
                             const std::vector<std::size_t>& begins) {
  for (std::size_t r = 0; r < ids_.size(); ++r)
    for (std::size_t i = begins[r]; i < begins[r + 1]; ++i)
      uses_.push_back({2 * std::uint64_t(triangles[i]) + side, r});
}

void ContactTracker::finish() {
  std::sort(uses_.begin(), uses_.end(), [](const Use& a, const Use& b) {
    return std::make_pair(a.triangle, a.region) < std::make_pair(b.triangle, b.region);
  });
  countShares();
  matchRegions();
  reportRegions();
  reportEnded();
}

/// Both lists are sorted by triangle.
void ContactTracker::countShares() {
  shares_.clear();
  auto old = old_uses_.cbegin();
  for (const Use& use : uses_) {
    while (old != old_uses_.cend() && old->triangle < use.triangle) ++old;
    for (auto i = old; i != old_uses_.cend() && i->triangle == use.triangle; ++i)
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
      return std::make_tuple(~s.count, old_ids_[s.before], s.now);
    };
    return rank(a) < rank(b);
  });
}

/// Matches old and new regions, beginning with the pair that shares most triangles.
void ContactTracker::matchRegions() {
  is_continued_.assign(old_ids_.size(), 0);
  for (const Share& share : shares_) {
    if (is_continued_[share.before] || ids_[share.now] != 0) continue;
    is_continued_[share.before] = 1;
    ids_[share.now] = old_ids_[share.before];
  }
}

void ContactTracker::reportRegions() {
  events_.clear();
  for (std::size_t r = 0; r < ids_.size(); ++r) {
    if (ids_[r] != 0) {
      events_.push_back({ContactChange::Persisting, ids_[r], ids_[r]});
      continue;
    }
    const auto from = std::find_if(shares_.begin(), shares_.end(),
                                   [&](const Share& share) { return share.now == r; });
    ids_[r] = ++last_id_;
    if (from == shares_.end())
      events_.push_back({ContactChange::Born, ids_[r], ids_[r]});
    else
      events_.push_back({ContactChange::Split, ids_[r], old_ids_[from->before]});
  }
}

void ContactTracker::reportEnded() {
  const std::size_t begin = events_.size();
  for (std::size_t r = 0; r < old_ids_.size(); ++r) {
    if (is_continued_[r]) continue;
    const auto into = std::find_if(shares_.begin(), shares_.end(),
                                   [&](const Share& share) { return share.before == r; });
    if (into == shares_.end())
      events_.push_back({ContactChange::Gone, old_ids_[r], old_ids_[r]});
    else
      events_.push_back({ContactChange::Merged, old_ids_[r], ids_[into->now]});
  }
  std::sort(events_.begin() + static_cast<std::ptrdiff_t>(begin), events_.end(),
            [](const ContactEvent& a, const ContactEvent& b) { return a.id < b.id; });
}

}  // namespace adaptive_bvh
