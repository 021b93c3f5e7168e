#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace adaptive_bvh {

/// Chooses the margin of a ContactSet: how much farther than its distance candidates may be apart. A
/// wide margin lasts for more steps, but makes more candidates. In units of a length L, the distance
/// and an edge, a margin x makes about (1 + x)^2 times as many pairs as the query finds. Let a
/// vertex move by v in a step. Then a search, which costs 1 for each pair, is due every x / 2 v
/// steps, and each step goes through the candidates, which costs kScan for each. So a step costs
/// (1 + x)^2 (2 v / x + kScan); a new query costs 1.
class SearchMargin {
 public:
  /// `speed`: mean motion of a vertex in a step. Returns 0 if a new query in each step costs less
  /// than `enough` times as much.
  static double choose(double speed, double length, double enough) {
    static const double kScan = getenv("SCAN")? 1/atof(getenv("SCAN")) : 1./30, kLeast = getenv("LEAST")? atof(getenv("LEAST")) : 0.1, kSearch = getenv("SEARCH")? atof(getenv("SEARCH")) : 1.3;
    const double k = 2 * kSearch * speed / length;
    if (!(k < 1)) return 0;
    const double best = (std::sqrt(k * k + 8 * kScan * k) - k) / (4 * kScan);
    const double x = std::max(best, kLeast);
    return (1 + x) * (1 + x) * (k / x + kScan) < enough ? x * length : 0;
  }
  /// Before the motion is known.
  static double atFirst(double length) { return length / 4; }

 private:

};

}  // namespace adaptive_bvh
