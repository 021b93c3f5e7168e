#pragma once

#include <algorithm>
#include <vector>

#include "ccd/clearance_search.h"
#include "ccd/pair_in_time.h"

namespace adaptive_bvh {

/// Whether a pair of parts does not count.
bool isLeftOut(const ClearanceQuery& query, unsigned i, unsigned j);

/// The goal of MotionWalk that finds when two bodies are nearer than a clearance. It collects the
/// pairs of parts that may be so near, and divides the motion: a part of it ends as one in which
/// all pairs are at least the clearance apart, or in which one pair is at most the clearance and
/// the tolerance apart.
template <typename Pair>
class IntervalsBelow {
 public:
  IntervalsBelow(const ClearanceQuery& query, double clearance)
      : query_(query), clearance_(clearance) {}

  double limit() const { return clearance_; }
  static fcl::Vector3d direction() { return fcl::Vector3d::Zero(); }
  static bool admits(double) { return true; }
  static bool isDone() { return false; }
  void leaf(unsigned i, unsigned j, double begin, double end) {
    if (isLeftOut(query_, i, j)) return;
    const Pair pair(query_.first.body, query_.second.body, {i, j});
    const typename Pair::At a = pair.at(begin), b = pair.at(end);
    if (!isApartByGuess(pair, a, b, clearance_)) candidates_.push_back({pair, begin, end});
  }

  /// Divides the motion.
  void finish(std::vector<MotionInterval>& intervals) {
    intervals.clear();
    std::vector<unsigned> near(candidates_.size());
    for (unsigned i = 0; i < near.size(); ++i) near[i] = i;
    divide({0, 1}, near, intervals);
  }

 private:
  /// A pair of parts that may be too near in a part of the motion.
  struct Candidate {
    Pair pair;
    double begin, end;
  };
  enum class Verdict { Apart, Near, Unknown };

  /// Appends the parts of an interval in which candidates are too near. `near`: the candidates that
  /// may be.
  void divide(const MotionInterval& time, const std::vector<unsigned>& near,
              std::vector<MotionInterval>& intervals) const {
    std::vector<unsigned> unknown;
    for (const unsigned i : near) {
      const Verdict verdict = judge(candidates_[i], time);
      if (verdict == Verdict::Near) return append(time, intervals);
      if (verdict == Verdict::Unknown) unknown.push_back(i);
    }
    if (unknown.empty()) return;
    if (time.end - time.begin < kShortestTime) return append(time, intervals);
    const double middle = (time.begin + time.end) / 2;
    divide({time.begin, middle}, unknown, intervals);
    divide({middle, time.end}, unknown, intervals);
  }
  /// Appends an interval, or extends the last one.
  static void append(const MotionInterval& time, std::vector<MotionInterval>& intervals) {
    if (!intervals.empty() && intervals.back().end == time.begin)
      intervals.back().end = time.end;
    else
      intervals.push_back(time);
  }
  Verdict judge(const Candidate& candidate, const MotionInterval& time) const {
    const double begin = std::max(time.begin, candidate.begin),
                 end = std::min(time.end, candidate.end);
    if (!(begin < end)) return Verdict::Apart;
    const Pair& pair = candidate.pair;
    const typename Pair::At a = pair.at(begin), b = pair.at(end);
    const PairSample<Pair> middle(pair, pair.at((begin + end) / 2));
    if (isApart(pair, a, b, middle)) return Verdict::Apart;
    const bool is_whole = begin == time.begin && end == time.end;
    return is_whole && isNear(pair, a, b, middle) ? Verdict::Near : Verdict::Unknown;
  }
  bool isApart(const Pair& pair, const typename Pair::At& a, const typename Pair::At& b,
               const PairSample<Pair>& middle) const {
    constexpr double kBlurred = 0x1p24;  // errors; the direction of shorter gaps has few digits
    if (isApartAlong(pair, a, b, middle.normal, clearance_)) return true;
    if (!(middle.gap.distance < kBlurred * pair.gapError(0))) return false;
    const auto directions = pair.manyGuesses(middle.at, middle.normal);
    return std::any_of(directions.begin(), directions.end(), [&](const fcl::Vector3d& n) {
      return isApartAlong(pair, a, b, n, clearance_);
    });
  }
  /// Whether a pair is near all the time: two points that are nearest in the middle, or two that go
  /// from the nearest points at the begin to those at the end. The latter stay together in parts
  /// that meet, where others part at once.
  bool isNear(const Pair& pair, const typename Pair::At& a, const typename Pair::At& b,
              const PairSample<Pair>& middle) const {
    const double most = clearance_ + query_.tolerance;
    if (!(middle.gap.distance <= most)) return false;
    return pair.farthest(a, b, middle, middle) <= most ||
           pair.farthest(a, b, PairSample<Pair>(pair, a), PairSample<Pair>(pair, b)) <= most;
  }

  const ClearanceQuery& query_;
  const double clearance_;
  std::vector<Candidate> candidates_;
};

}  // namespace adaptive_bvh
