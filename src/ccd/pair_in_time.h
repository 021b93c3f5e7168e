#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "ccd/moving_pairs.h"

// Pairs of moving parts, followed in time. `Pair` is a type of moving_pairs.h.
namespace adaptive_bvh {

/// Shorter parts of the motion are not divided.
constexpr double kShortestTime = 0x1p-42;

/// A lower bound of the distance in a part of the motion, and a time at which to divide it.
struct TimeBound {
  double lower, time;
};

/// The distance between the times of two samples. Along the normal of each sample, a line bounds it
/// from below; the larger of both lines is least at an end or where they intersect.
template <typename Pair>
TimeBound boundBetween(const Pair& pair, const PairSample<Pair>& a, const PairSample<Pair>& b) {
  const double a0 = pair.separation(a.at, a.normal), a1 = pair.separation(b.at, a.normal),
               b0 = pair.separation(a.at, b.normal), b1 = pair.separation(b.at, b.normal);
  double lower = std::min(std::max(a0, b0), std::max(a1, b1)), share = 0.5;
  const double at_begin = a0 - b0, at_end = a1 - b1;
  if (at_begin > 0 && at_end < 0) {
    const double cross = at_begin / (at_begin - at_end), there = a0 + cross * (a1 - a0);
    if (there < lower) {
      lower = there;
      share = std::clamp(cross, 0.1, 0.9);
    }
  }
  const double rounding = 0x1p-48 * (std::fabs(a0) + std::fabs(a1) + std::fabs(b0) + std::fabs(b1));
  return {std::max(lower - rounding - pair.slack(a.at, b.at), 0.),
          a.at.t + share * (b.at.t - a.at.t)};
}

/// Whether a pair is at least `distance` apart between two times, along one direction. False if the
/// direction is zero, unless the distance is less than zero.
template <typename Pair>
ADAPTIVE_BVH_INLINE bool isApartAlong(const Pair& pair, const typename Pair::At& a,
                                      const typename Pair::At& b, const fcl::Vector3d& n,
                                      double distance) {
  const double first = pair.separation(a, n);
  return first - distance >= 0 &&
         std::min(first, pair.separation(b, n)) - pair.slack(a, b) >= distance;
}

/// The same along any of the pair's guesses.
template <typename Pair>
bool isApartByGuess(const Pair& pair, const typename Pair::At& a, const typename Pair::At& b,
                    double distance) {
  for (int i = 0; i < Pair::kGuesses; ++i)
    if (isApartAlong(pair, a, b, pair.guess(a, i), distance)) return true;
  return false;
}

/// The time until which a pair is certainly more than `distance` apart along one direction, from
/// the time of a sample to that of `end`; the former if that is not known.
template <typename Pair>
double apartUntil(const Pair& pair, const typename Pair::At& now, const typename Pair::At& end,
                  const fcl::Vector3d& n, double distance) {
  const double needed = pair.slack(now, end) + distance;
  const double first = pair.separation(now, n) - needed, last = pair.separation(end, n) - needed;
  if (!(first > 0)) return now.t;
  if (last > 0) return end.t;
  return now.t + (end.t - now.t) * (first / (first - last)) * (1 - 0x1p-40);
}
/// The same along the best of several directions.
template <typename Pair>
double apartUntil(const Pair& pair, const PairSample<Pair>& now, const typename Pair::At& end,
                  double distance) {
  const double along = apartUntil(pair, now.at, end, now.normal, distance);
  if (along > now.at.t) return along;
  double best = now.at.t;
  for (const fcl::Vector3d& n : pair.manyGuesses(now.at, now.normal))
    best = std::max(best, apartUntil(pair, now.at, end, n, distance));
  return best;
}

/// Calls found(sample) at the first time from `begin` to `end` at which a pair is at most
/// `separation` apart, or nearly so: at a time before which it is farther apart. Conservative
/// advancement; parts of the motion that are too long for the bound are shortened.
template <typename Pair, typename Found>
void findFirstImpact(const Pair& pair, double begin, double end, double separation,
                     const Found& found) {
  constexpr int kMostSteps = 5000;
  constexpr double kContact = 64;  // gaps of so many times the error count as contact
  const double contact = separation + kContact * pair.gapError(separation);
  double t = begin, length = end - begin;
  for (int step = 0;; ++step) {
    const PairSample<Pair> now(pair, pair.at(t));
    const bool is_contact = !(now.gap.distance > contact);
    if (is_contact || length < kShortestTime || step == kMostSteps) return found(now);
    double next = t, until = t;
    for (; !(next > t) && length >= kShortestTime; length /= 4) {
      until = std::min(t + length, end);
      next = apartUntil(pair, now, pair.at(until), separation);
    }
    if (next >= end) return;
    length =
        next == until ? 8 * length : 4 * (next - t);  // a chord that ends far is low in between
    t = next;
  }
}

}  // namespace adaptive_bvh
