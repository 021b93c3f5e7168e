#include "query/within/candidate_tester.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "query/pair_filter.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {
namespace {

using Bits = CandidateRows::Bits;

/// Reserve of pairs that no motion brings to the limit.
constexpr float kForever = 1e18f;
constexpr float kLargestLimit = 1e30f;
constexpr double kLimitRounding = 1. / (1 << 20);

/// Turns the centre of a triangle into minus the centre.
constexpr Float4 kMinusCentre = {-1, -1, -1, 1};

float limitOf(double distance, double factor) {
  return static_cast<float>(std::min(distance * factor, double(kLargestLimit)));
}

}  // namespace

FeatureTests::Pair CandidateTester::pair(unsigned number, unsigned leaf1, unsigned leaf2) const {
  const WideTree &tree1 = meshes_.first.tree(), &tree2 = meshes_.second.tree();
  if (request_.has_features)
    return features_.pair(number, meshes_.first.mesh.topology->owners[leaf1], tree1.corners(leaf1),
                          meshes_.second.mesh.topology->owners[leaf2], tree2.corners(leaf2));
  const auto first = static_cast<unsigned>(tree1.triangle(leaf1)),
             second = static_cast<unsigned>(tree2.triangle(leaf2));
  const bool swaps = meshes_.is_self && first > second;
  return {FeatureKind::VertexFace, {swaps ? second : first, swaps ? first : second}};
}

bool CandidateTester::isIgnored(const FeatureTests::Pair& pair) const {
  const FeaturePair& of = pair.features;
  if (!request_.has_features)
    return adaptive_bvh::isIgnored(request_.ignored.triangles, of.first, of.second);
  const IgnoredPairs& ignored = pair.kind == FeatureKind::VertexFace ? request_.ignored.vertex_face
                                : pair.kind == FeatureKind::FaceVertex
                                    ? request_.ignored.face_vertex
                                    : request_.ignored.edge_edge;
  return adaptive_bvh::isIgnored(ignored, of.first, of.second);
}

/// Leaves out the pairs to ignore among those that were not in the set before.
Bits CandidateTester::admitted(Bits bits, Bits before, unsigned leaf1, unsigned leaf2) const {
  if (!request_.ignores_some) return bits;
  for (unsigned added = bits & ~unsigned(before); added; added &= added - 1) {
    const auto number = static_cast<unsigned>(__builtin_ctz(added));
    if (isIgnored(pair(number, leaf1, leaf2))) bits = Bits(bits & ~(1u << number));
  }
  return bits;
}

FeatureTests::Triangle CandidateTester::triangle(int side, unsigned leaf,
                                                 const TrianglePoints& points) const {
  const MeshState& mesh = meshes_.mesh(side);
  return {mesh.tree.corners(leaf), mesh.topology->owners[leaf], points};
}

/// Records a change.
void CandidateTester::change(const CandidateChange& change, Bits before,
                             CandidateChanges& result) const {
  result.changes.push_back(change);
  const unsigned added = change.bits & ~unsigned(before), removed = before & ~unsigned(change.bits);
  if (added) result.counts.countAdded(request_.kindsOf(added, meshes_.is_self));
  if (removed) result.counts.countRemoved(request_.kindsOf(removed, meshes_.is_self));
}

/// Tests of candidates whose reserves are used up, four at a time.
class CandidateTester::UsedUp {
 public:
  UsedUp(const CandidateTester& tester, CandidateRows& candidates, const TrackedMeshes& tracked,
         double drop_distance, CandidateChanges& result)
      : tester_(tester),
        rows_(candidates),
        first_(tracked[0]),
        second_(tracked[1]),
        scale_(tracked.unit().scale),
        distance_(tester.request_.distance),
        rounding_(tracked.rounding()),
        near_limit_(limitOf(distance_ * scale_, 1 - kLimitRounding)),
        far_limit_(limitOf(distance_ * scale_, 1 + kLimitRounding)),
        drop_limit_(limitOf(drop_distance * scale_, 1 + kLimitRounding)),
        result_(result) {}

  void run(unsigned row, unsigned end_row) {
    for (; row < end_row; ++row) scan(row);
    if (open_count_ > 0) testOpen();
  }

 private:
  /// A candidate to test. Changes are recorded in the order of rows and places (KeptPairs::commit).
  struct Open {
    unsigned row, at;
  };

  /// Whether a second triangle of a row has moved: most have not while few vertices move.
  bool hasAnyMoved(const CandidateRows::Row& row) const {
    const unsigned* const seconds = rows_.seconds() + row.begin;
    unsigned moved = 0;
    for (unsigned i = 0; i < row.count; ++i) moved |= unsigned(second_.hasMoved(seconds[i]));
    return moved != 0;
  }

  /// Finds the candidates of a row whose reserves are used up. Leaves out those of which no corner
  /// has moved.
  void scan(unsigned number) {
    const CandidateRows::Row& row = rows_.rows()[number];
    if (row.count == 0) return;
    const bool is_whole = row.is_new || first_.hasMoved(number);
    if (!is_whole && !hasAnyMoved(row)) return;
    rows_.setTested(number);
    const Float4 minus_centre = first_.motions()[number] * kMinusCentre;
    const Float4* const others = second_.motions();
    const Float4* const reserves = rows_.reserves() + row.begin;
    const unsigned* const seconds = rows_.seconds() + row.begin;
    for (unsigned i = 0; i < row.count; i += 4) {
      if (!is_whole && !second_.hasAnyMoved(seconds + i)) continue;
      const float4::Rows left =
          float4::transposed(reserves[i] - (minus_centre + others[seconds[i]]),
                             reserves[i + 1] - (minus_centre + others[seconds[i + 1]]),
                             reserves[i + 2] - (minus_centre + others[seconds[i + 2]]),
                             reserves[i + 3] - (minus_centre + others[seconds[i + 3]]));
      constexpr float kSquareUp = 1 + 1.f / (1 << 20);
      const Float4 square = left.x * left.x + left.y * left.y + left.z * left.z;
      unsigned used_up = 15 ^ float4::bits((left.w > float4::all(0)) &
                                           (square * float4::all(kSquareUp) < left.w * left.w));
      if (row.count - i < 4) used_up &= 15u >> (4 - (row.count - i));
      for (; used_up; used_up &= used_up - 1)
        add(number, row.begin + i + unsigned(__builtin_ctz(used_up)));
    }
  }

  void add(unsigned row, unsigned at) {
    const float reserve = rows_.reserves()[at][3];
    if (reserve == CandidateRows::kUndecided && !first_.hasMoved(row) &&
        !second_.hasMoved(rows_.second(at)))
      return;
    open_[open_count_++] = {row, at};
    if (open_count_ == 4) testOpen();
  }

  void testOpen() {
    Vector4x3 p[3], q[3];
    std::array<unsigned, 4> ids1, ids2;
    for (unsigned i = 0; i < 4; ++i) {
      const Open& open = open_[i < open_count_ ? i : 0];
      ids1[i] = open.row;
      ids2[i] = rows_.second(open.at);
    }
    for (int k = 0; k < 3; ++k) {
      p[k] = float4::columns(first_.corner(ids1[0], k), first_.corner(ids1[1], k),
                             first_.corner(ids1[2], k), first_.corner(ids1[3], k));
      q[k] = float4::columns(second_.corner(ids2[0], k), second_.corner(ids2[1], k),
                             second_.corner(ids2[2], k), second_.corner(ids2[3], k));
    }
    const DistanceBounds4 bounds =
        TriangleDistances4(TriangleDistances4::Seen(p), q, MotionUnit::kError).bounds();
    for (unsigned i = 0; i < open_count_; ++i)
      settle(open_[i], bounds.lower[int(i)], bounds.upper[int(i)]);
    result_.tested += open_count_;
    open_count_ = 0;
  }

  /// Decides about a candidate, whose triangles are between `lower` and `upper` apart.
  void settle(const Open& open, float lower, float upper) {
    const Bits before = rows_.bits(open.at);
    const unsigned second = rows_.second(open.at);
    if (lower > drop_limit_) return tester_.change({open.row, open.at, 0, true}, before, result_);
    float reserve = 0;
    Bits bits = 0;
    if (lower > far_limit_)
      reserve = lower - far_limit_;
    else if (tester_.request_.has_features)
      bits = testFeatures(open.row, second, reserve);
    else
      bits = testTriangles(open.row, second, upper, reserve);
    bits = tester_.admitted(bits, before, first_.leaf(open.row), second_.leaf(second));
    setReserve(open, second, reserve - MotionUnit::kMotionError);
    if (bits != before) tester_.change({open.row, open.at, bits, false}, before, result_);
  }

  void setReserve(const Open& open, unsigned second, float reserve) {
    const Float4 now = first_.motions()[open.row] * kMinusCentre + second_.motions()[second];
    rows_.reserve(open.at) =
        Float4{now[0], now[1], now[2],
               reserve > 0 ? std::min(reserve, kForever) + now[3] : CandidateRows::kUndecided};
  }

  /// How far a computed distance may change until it reaches the limit, less its rounding.
  double reserveOf(double distance) const { return std::fabs(distance - distance_) - rounding_; }
  /// In a MotionUnit, rounded down.
  float inUnit(double length) const {
    return static_cast<float>(std::min(length * scale_, double(kForever)) * (1 - kLimitRounding));
  }

  /// Whether two triangles are near. Sets the reserve, in a MotionUnit.
  Bits testTriangles(unsigned first, unsigned second, float upper, float& reserve) const {
    if (upper < near_limit_) {
      reserve = near_limit_ - upper;
      return 1;
    }
    const TrianglePoints p = first_.points(first), q = second_.points(second);
    const double distance = gapOf(p, q).distance;
    reserve = inUnit(reserveOf(distance));
    return tester_.features_.nearness().areNear(distance, p, q) ? 1 : 0;
  }

  /// Tests the features of two triangles. Sets the reserve, in a MotionUnit.
  Bits testFeatures(unsigned first, unsigned second, float& reserve) const {
    const FeatureTests::Triangle a = tester_.triangle(0, first_.leaf(first), first_.points(first)),
                                 b = tester_.triangle(1, second_.leaf(second),
                                                      second_.points(second));
    double least = std::numeric_limits<double>::infinity();
    unsigned bits = 0;
    tester_.features_.forEach(a, b, [&](unsigned number, double distance, bool is_near) {
      const double left = distance_ < std::numeric_limits<double>::infinity()
                              ? reserveOf(distance)
                              : std::numeric_limits<double>::infinity();
      least = std::min(least, left);
      bits |= unsigned(is_near) << number;
    });
    reserve = inUnit(least);
    return Bits(bits);
  }

  const CandidateTester& tester_;
  CandidateRows& rows_;
  const TrackedTriangles &first_, &second_;
  const double scale_, distance_, rounding_;
  const float near_limit_, far_limit_, drop_limit_;
  CandidateChanges& result_;
  std::array<Open, 4> open_;
  unsigned open_count_ = 0;
};

void CandidateTester::testUsedUp(CandidateRows& candidates, const TrackedMeshes& tracked,
                                 double drop_distance, unsigned row, unsigned end_row,
                                 CandidateChanges& result) const {
  UsedUp(*this, candidates, tracked, drop_distance, result).run(row, end_row);
}

void CandidateTester::takeAll(const CandidateRows& candidates, const TrackedMeshes& tracked,
                              unsigned row, unsigned end_row, CandidateChanges& result) const {
  for (; row < end_row; ++row) {
    const CandidateRows::Row& in = candidates.rows()[row];
    for (unsigned at = in.begin; at < in.begin + in.count; ++at) {
      const Bits before = candidates.bits(at);
      if (!request_.has_features && before == 1) continue;
      const unsigned leaf1 = tracked[0].leaf(row), leaf2 = tracked[1].leaf(candidates.second(at));
      const Bits bits = request_.has_features ? nearFeatures(leaf1, leaf2) : Bits(1);
      result.tested += request_.has_features;
      const Bits now = admitted(bits, before, leaf1, leaf2);
      if (now != before) change({row, at, now, false}, before, result);
    }
  }
}

/// The features of two near triangles that are near.
Bits CandidateTester::nearFeatures(unsigned leaf1, unsigned leaf2) const {
  TrianglePoints q = meshes_.second.pointsAt(leaf2);
  if (!meshes_.is_self)
    for (fcl::Vector3d& x : q) x = meshes_.to_first(x);
  unsigned bits = 0;
  features_.forEach(
      triangle(0, leaf1, meshes_.first.pointsAt(leaf1)), triangle(1, leaf2, q),
      [&](unsigned number, double, bool is_near) { bits |= unsigned(is_near) << number; });
  return Bits(bits);
}

}  // namespace adaptive_bvh
