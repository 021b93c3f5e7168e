// Tests of boxes that move, and the steps of the walk over them.
#include "ccd/motion_walk.h"

#include <cmath>

#include "ccd/moving_pairs.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

/// Four boxes at a share of a part of the motion.
ADAPTIVE_BVH_INLINE Boxes4 boxesAt(const MovingNode& node, float share) {
  if (share == 0) return node.at[0];
  if (share == 1) return node.at[1];
  Boxes4 boxes;
  const Boxes4 &from = node.at[0], &until = node.at[1];
  const Float4 to = float4::all(share);
  for (int k = 0; k < 3; ++k) {
    boxes.low[k] = from.low[k] + to * (until.low[k] - from.low[k]);
    boxes.high[k] = from.high[k] + to * (until.high[k] - from.high[k]);
  }
  return boxes;
}

/// The squared gaps of the boxes `a` and box `kLane` of `b` in the time between both ends. Each gap
/// of two sides is linear in time. `offset`: from the first to the second origin, at both ends.
template <int kLane>
ADAPTIVE_BVH_INLINE Float4 movingGaps(const Boxes4 (&a)[2], const Boxes4 (&b)[2],
                                      const Float4 (&offset)[2][3], const Float4& error) {
  using float4::broadcast;
  using float4::lower;
  using float4::upper;
  Float4 sum = float4::all(0);
  for (int k = 0; k < 3; ++k) {
    const Float4 above = lower<Float4>(broadcast<kLane>(b[0].low[k]) - a[0].high[k] + offset[0][k],
                                       broadcast<kLane>(b[1].low[k]) - a[1].high[k] + offset[1][k]);
    const Float4 below = lower<Float4>(a[0].low[k] - broadcast<kLane>(b[0].high[k]) - offset[0][k],
                                       a[1].low[k] - broadcast<kLane>(b[1].high[k]) - offset[1][k]);
    const Float4 gap = upper<Float4>(upper<Float4>(above, below) - error, float4::all(0));
    sum += gap * gap;
  }
  return sum;
}

}  // namespace

void NodePairTest::begin(const BoxedBody& first, const BoxedBody& second, double scale,
                         double begin, double end) {
  scale_ = scale;
  arcs_ = first.body.arc(end - begin) + second.body.arc(end - begin);
  sizes_ = first.boxes().size() + second.boxes().size();
  double largest = 0;
  for (int e = 0; e < 2; ++e) {
    origins_[e] = first.boxes().origin(e);
    offsets_[e] = scale * (second.boxes().origin(e) - origins_[e]);
    largest = std::max(largest, offsets_[e].lpNorm<Eigen::Infinity>());
  }
  gap_error_ = static_cast<float>(std::min(8 * kFloatUnit * (largest + sizes_), 1e20));
  plane_ = second.body.flat() ? &second.body : nullptr;
  if (plane_) beginPlane(first.body, begin, end);
}

void NodePairTest::setLimit(double limit) {
  distance_ = std::max(limit + arcs_ * (1 + 1e-9), 0.) * scale_;
  key_limit_ = squaredGapOf(distance_);
}

void NodePairTest::setEnds(const MovingNode& a, const MovingNode& b, const Share& share) {
  first_[0] = boxesAt(a, share.begin);
  first_[1] = boxesAt(a, share.end);
  second_[0] = boxesAt(b, share.begin);
  second_[1] = boxesAt(b, share.end);
}

unsigned NodePairTest::near(const MovingNode& a, const MovingNode& b, const Share& share,
                            Gaps4x4& keys) {
  setEnds(a, b, share);
  Float4 offset[2][3];
  for (int e = 0; e < 2; ++e) {
    const double at = double(e == 0 ? share.begin : share.end);
    for (int k = 0; k < 3; ++k)
      offset[e][k] =
          float4::all(static_cast<float>((1 - at) * offsets_[0][k] + at * offsets_[1][k]));
  }
  const Float4 error = float4::all(gap_error_);
  keys.row[0] = movingGaps<0>(first_, second_, offset, error);
  keys.row[1] = movingGaps<1>(first_, second_, offset, error);
  keys.row[2] = movingGaps<2>(first_, second_, offset, error);
  keys.row[3] = movingGaps<3>(first_, second_, offset, error);
  unsigned pairs = 0;
  for (int j = 0; j < 4; ++j)
    pairs |= float4::bits(keys.row[j] <= float4::all(key_limit_)) << (4 * j);
  return pairs;
}

bool NodePairTest::isFast(const MovingNode& a, const MovingNode& b, const Share& share) const {
  double motion = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const auto change = [&](const MovingNode& node) -> double {
      return double(node.at[1].low[k][0]) - double(node.at[0].low[k][0]);
    };
    motion = std::max(motion, std::fabs(change(b) - change(a) + offsets_[1][k] - offsets_[0][k]));
    for (const MovingNode* node : {&a, &b})
      size = std::max(size, double(node->at[0].high[k][0]) - double(node->at[0].low[k][0]));
  }
  motion *= double(share.end - share.begin);
  return motion > 2 * size && motion > distance_ / 4;
}

/// A lower bound of the distance of box `lane` and the plane, scaled. The height of a point of the
/// box, times the normal's length, is quadratic in time.
double NodePairTest::planeGap(const Boxes4 (&ends)[2], int lane, const Share& share) const {
  double lows[2], highs[2], lengths[2];
  Vector normals[2], middles[2], half;
  for (int e = 0; e < 2; ++e) {
    const double at = double(e == 0 ? share.begin : share.end);
    normals[e] = (1 - at) * normals_[0] + at * normals_[1];
    const Vector origin = (1 - at) * origins_[0] + at * origins_[1];
    Vector low, high;
    for (int k = 0; k < 3; ++k) {
      low[k] = double(ends[e].low[k][lane]);
      high[k] = double(ends[e].high[k][lane]);
    }
    middles[e] = origin * scale_ + (low + high) / 2;
    half = (high - low) / 2;
    const double height = normals[e].dot(middles[e]) -
                          scale_ * ((1 - at) * plane_offsets_[0] + at * plane_offsets_[1]);
    const double reach = normals[e].cwiseAbs().dot(half);
    lows[e] = height - reach;
    highs[e] = height + reach;
    lengths[e] = normals[e].norm();
  }
  const double motion = (middles[1] - middles[0]).norm() + 2 * half.norm();
  const double curve = (normals[1] - normals[0]).norm() * motion / 4 + plane_arcs_;
  const double least = std::min(lows[0], lows[1]), most = std::max(highs[0], highs[1]);
  const double gap = plane_->flat()->isSolid() ? least : std::max(least, -most);
  return (gap - curve) / std::max(lengths[0], lengths[1]) * (1 - 1e-9);
}

unsigned NodePairTest::nearPlane(const MovingNode& a, int count, const Share& share,
                                 Gaps4x4& keys) const {
  const Boxes4 ends[2] = {boxesAt(a, share.begin), boxesAt(a, share.end)};
  unsigned pairs = 0;
  for (auto& row : keys.row) row = float4::all(0);
  for (int i = 0; i < count; ++i) {
    const double gap = std::max(planeGap(ends, i, share), 0.);
    keys.row[0][i] = static_cast<float>(std::min(gap * gap, 1e30));
    if (keys.row[0][i] <= key_limit_) pairs |= 1u << i;
  }
  return pairs;
}

/// Sets the plane at both ends of a part of the motion.
void NodePairTest::beginPlane(const MovingBody& first, double begin, double end) {
  const FrameMotion& frame = plane_->frame();
  const PlaneAt from(*plane_, begin), to(*plane_, end);
  normals_[0] = from.normal, normals_[1] = to.normal;
  plane_offsets_[0] = from.offset, plane_offsets_[1] = to.offset;
  const double arm = std::max(frame.angleTimesArm(origins_[0]), frame.angleTimesArm(origins_[1])) +
                     frame.angle() * (first.radius() + first.arc(end - begin));
  const double rounding = 8 * (first.error() + plane_->error());
  plane_arcs_ = scale_ * (frame.angle() * arm * (end - begin) * (end - begin) / 8 + rounding);
}

/// Computes supports, if the direction has changed. The next time is due after twice as many tests.
void MotionWalk::setSupports(const Vector& direction) {
  next_supports_ = 2 * box_tests_;
  const bool is_new = !supports_.isSet() || direction != direction_;
  if (!is_new || direction.isZero(0) || second_.body.flat()) return;
  direction_ = direction;
  supports_.assign(first_.body, second_.body, direction, begin_, begin_ + length_);
}

/// A power of two. Arcs are then at most as long as the tolerance, where 256 parts suffice.
int MotionWalk::numParts() const {
  constexpr double kMost = 256;
  double acceleration = std::max(first_.body.acceleration(), second_.body.acceleration());
  const FrameMotion& frame = second_.body.frame();
  if (second_.body.flat() && frame.isScrew()) {
    const fcl::Vector3d middle = first_.body.at(0).frame(first_.body.middle());
    acceleration = std::max(acceleration, frame.acceleration(middle, first_.body.radius(), 0));
  }
  const double parts = std::sqrt(acceleration / 8 / longest_arc_);
  return 1 << static_cast<int>(std::ceil(std::log2(std::clamp(parts, 1., kMost))));
}

int MotionWalk::nearestOf(unsigned pairs, const Gaps4x4& keys) {
  int nearest = __builtin_ctz(pairs);
  for (unsigned rest = pairs & (pairs - 1); rest; rest &= rest - 1) {
    const int bit = __builtin_ctz(rest);
    if (keys(bit & 3, bit >> 2) < keys(nearest & 3, nearest >> 2)) nearest = bit;
  }
  return nearest;
}

/// Divides a pair in time if it moves fast. Returns whether it did.
bool MotionWalk::isSplitInTime(const Entry& entry, const MovingNode& a, const MovingNode& b) {
  constexpr float kShortest = 1.f / (1 << 20);
  if (entry.share.end - entry.share.begin < kShortest || !test_.isFast(a, b, entry.share))
    return false;
  const float middle = (entry.share.begin + entry.share.end) / 2;
  open_.push_back({entry.first, entry.second, entry.key, {middle, entry.share.end}});
  open_.push_back({entry.first, entry.second, entry.key, {entry.share.begin, middle}});
  return true;
}

/// Removes pairs that are left out. Of a node with itself, keeps each pair once.
unsigned MotionWalk::withoutNeighbours(const Entry& entry, unsigned pairs) const {
  const WideNode &a = first_.boxes().links()[entry.first],
                 &b = first_.boxes().links()[entry.second];
  constexpr unsigned kEachPairOnce = 0x7310, kDiagonal = 0x8421;  // i < j; i == j
  if (entry.first == entry.second) pairs &= a.isLeaf() ? kEachPairOnce : kEachPairOnce | kDiagonal;
  for (unsigned rest = pairs; rest; rest &= rest - 1) {
    const int bit = __builtin_ctz(rest), i = bit & 3, j = bit >> 2;
    const bool is_out = a.isLeaf() && b.isLeaf()
                            ? left_out_->areNeighbours(unsigned(a.first + i), unsigned(b.first + j))
                            : left_out_->areAllNeighbours(a.isLeaf() ? entry.first : a.below[i],
                                                          b.isLeaf() ? entry.second : b.below[j]);
    if (is_out) pairs &= ~(1u << bit);
  }
  return pairs;
}

/// Pushes the pairs of children, the nearest one last. A leaf stays as it is.
void MotionWalk::push(const Entry& entry, const WideNode& a, const WideNode& b, unsigned pairs,
                      const Gaps4x4& keys) {
  const auto from = open_.size();
  for (; pairs; pairs &= pairs - 1) {
    const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
    const Entry below = {a.isLeaf() ? entry.first : a.below[i],
                         b.isLeaf() ? entry.second : b.below[j], keys(i, j), entry.share};
    const auto same =
        std::find_if(open_.begin() + std::ptrdiff_t(from), open_.end(), [&](const Entry& other) {
          return other.first == below.first && other.second == below.second;
        });
    if (same == open_.end())
      open_.push_back(below);
    else
      same->key = std::min(same->key, below.key);
  }
  std::sort(open_.begin() + std::ptrdiff_t(from), open_.end(),
            [](const Entry& x, const Entry& y) { return x.key > y.key; });
}

}  // namespace adaptive_bvh
