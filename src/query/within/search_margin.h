#pragma once

namespace adaptive_bvh {

/// Chooses the margin of a ContactSet: how much farther than its distance candidates may be apart.
/// A wide margin lasts for more steps, but makes more candidates. Lengths are in units of L, the
/// distance and an edge, because boxes within a distance D overlap in proportion to (D + edge)^2;
/// the pairs of triangles within D are in proportion to D^2. Times are in units of a new query.
///
/// Let a vertex move by v in a step. Then a search within a margin x, which takes kSearch (1 +
/// x)^2, is due every x / 2 v steps, and each step goes through all candidates, which takes kScan
/// (d + x)^2 for the distance d.
class SearchMargin {
 public:
  /// `speed`: mean motion of a vertex in a step. Returns 0 if all margins cost more than `enough`.
  static double choose(double speed, double distance, double edge, double enough) {
    const double length = distance + edge;
    double best = 0, least = enough;
    for (double x = kNarrowest; x < 1; x *= 1.25) {
      const double search = kSearch * (1 + x) * (1 + x) * 2 * speed / length / x;
      const double apart = distance / length + x, cost = search + kScan * apart * apart;
      if (!(cost < least)) continue;
      least = cost;
      best = x * length;
    }
    return best;
  }

 private:
  static constexpr double kSearch = 1.3, kScan = 0.45, kNarrowest = 0.04;
};

}  // namespace adaptive_bvh
