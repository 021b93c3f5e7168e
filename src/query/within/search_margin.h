#pragma once

namespace adaptive_bvh {

/// What a margin of a ContactSet costs: how much farther than its distance candidates may be apart.
/// A wide margin lasts for more steps, but makes more candidates. Costs are in new queries. Lengths
/// are relative to L, the distance and an edge, because boxes within a distance D overlap in
/// proportion to (D + edge)^2; the pairs of triangles within D are in proportion to D^2.
class SearchMargin {
 public:
  static constexpr double kUsual = 0.1;  ///< share of the candidates that a step tests

  SearchMargin(double distance, double edge)
      : length_(distance + edge), distance_(distance / length_) {}

  /// Of a search of everything within a margin, and of making candidates of what it finds.
  double ofSearch(double margin) const {
    const double x = margin / length_, boxes = 1 + x, apart = distance_ + x;
    return kSearch * boxes * boxes + kMerge * apart * apart;
  }
  /// Of going through all candidates once, and testing a share of them.
  double ofTests(double margin, double tested) const {
    const double apart = distance_ + margin / length_;
    return (kScan + kTest * tested) * apart * apart;
  }
  /// The cheapest margin if a search is due whenever two points have moved by the margin relative
  /// to each other, which they do by twice `speed` in each step, and each step tests a share of the
  /// candidates. Returns 0 if all cost more than `enough` a step.
  double choose(double speed, double tested, double enough) const {
    double best = 0, least = enough;
    for (double x = kNarrowest; x < 1; x *= 1.25) {
      const double margin = x * length_;
      const double cost = ofSearch(margin) * 2 * speed / margin + ofTests(margin, tested);
      if (!(cost < least)) continue;
      least = cost;
      best = margin;
    }
    return best;
  }

 private:
  static constexpr double kSearch = 1.3, kMerge = 3.4, kScan = 0.25, kTest = 4.5;
  static constexpr double kNarrowest = 0.04;
  double length_, distance_;
};

}  // namespace adaptive_bvh
