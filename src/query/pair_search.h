#pragma once

#include <optional>

#include "query/distance_visitor.h"
#include "query/near_distance.h"

namespace adaptive_bvh {

/// The search of one distance query of two meshes: on the boxes beside FCL's volumes, and on
/// four-wide trees where so many boxes are tested that it is worth to bring these up to date.
template <typename BV>
class PairSearch {
 public:
  static constexpr long kFew = 1024;  ///< tests of boxes

  /// Both meshes must have boxes. `rigid_motion`: RigidMotion::sum, of a query with a front.
  PairSearch(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second, NearestPair<BV>& nearest,
             double rigid_motion)
      : first_(first),
        second_(second),
        nearest_(nearest),
        stops_(first, second, nearest, rigid_motion),
        boxes_(first, second, nearest, stops_),
        enough_tests_(NearDistance<BV>::worthAfter(first, second)) {}

  /// False when the objects are so far apart, for their sizes, that single precision will not do.
  bool isPossible() const { return boxes_.isPossible(); }
  SearchStops<BV>& stops() { return stops_; }
  const SearchStops<BV>& stops() const { return stops_; }
  bool isDone() const { return nearest_.isDone(); }

  /// Everything. `are_near`: whether the last search of the two took many tests; then whether this
  /// one did.
  void fromRoots(bool& are_near) {
    if (!are_near && boxes_.search(0, 0, enough_tests_)) return;
    if (!useWideTrees()) {
      if (are_near)
        boxes_.search(0, 0);
      else
        boxes_.resume();
      are_near = false;
      return;
    }
    stops_.restart();
    near_->search();
    are_near = near_->boxTests() > enough_tests_;
  }
  /// False where that would take many tests; then not all was searched.
  bool briefly() { return boxes_.search(0, 0, std::min(kFew, enough_tests_)); }
  /// To be called before `below` where searches take many tests. False where it has no effect.
  bool useWideTrees() {
    if (!NearDistance<BV>::canBe(first_, second_, nearest_)) return false;
    near_.emplace(first_, second_, nearest_, stops_, boxes_.separation());
    if (!near_->isPossible()) near_.reset();
    return near_.has_value();
  }
  /// Searches everything below two nodes. The pairs where it stops cover that, each once.
  void below(int node1, int node2) {
    if (!near_ || !near_->search(node1, node2)) boxes_.search(node1, node2);
  }
  /// To be called in the end.
  void record() const {
    if (near_) near_->record();
    statisticsOf(first_, second_).recordQuery(work());
  }

  /// Of the search so far, in tests of boxes.
  double cost() const {
    constexpr double kNearTest = 0.55;  // of one of the other boxes; each tree, of enough of those
    const double near = near_ ? kNearTest * double(near_->boxTests()) + double(enough_tests_) : 0.;
    const QueryWork so_far = work();
    const double others = double(so_far.box_tests) - (near_ ? double(near_->boxTests()) : 0.);
    return others + near + 12 * double(so_far.separation_tests) + 40 * double(so_far.leaf_tests) +
           0.1 * double(boxes_.separation().read());
  }
  QueryWork work() const {
    QueryWork work;
    work.box_tests = boxes_.boxTests() + (near_ ? near_->boxTests() : 0);
    work.separation_tests = boxes_.separation().tests();
    work.leaf_tests = nearest_.tests();
    return work;
  }

 private:
  const PlacedMesh<BV>&first_, &second_;
  NearestPair<BV>& nearest_;
  SearchStops<BV> stops_;
  DistanceVisitor<BV> boxes_;
  std::optional<NearDistance<BV>> near_;
  const long enough_tests_;
};

}  // namespace adaptive_bvh
