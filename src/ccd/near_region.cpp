// Pairs of features near their references, and planes between them.
#include "ccd/near_region.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "ccd/pair_batches.h"
#include "ccd/swept_boxes.h"
#include "triangles/feature_truncation.h"

namespace adaptive_bvh {
namespace {

/// The share, at most 1, of the way from `from` to `to` within a ball around the origin.
double shareInBall(const fcl::Vector3d& from, const fcl::Vector3d& to, double radius) {
  if (to.squaredNorm() <= radius * radius) return 1;
  const fcl::Vector3d way = to - from;
  const double square = way.squaredNorm(), along = from.dot(way),
               free = radius * radius - from.squaredNorm();
  const double discriminant = along * along + square * free;
  if (!(discriminant > 0)) return 0;
  const double root = std::sqrt(discriminant);
  const double share = along > 0 ? free / (along + root) : (root - along) / square;
  return std::min(std::max(share * (1 - 1e-12), 0.), 1.);
}

/// Floats that are at least x >= 0, and at most x.
float upward(double x) { return static_cast<float>(x) * (1 + 1.f / (1 << 20)); }
float downward(double x) { return static_cast<float>(x - std::abs(x) / (1 << 20)); }

}  // namespace

/// A visitor of FeatureFinder that appends the pairs whose gap may be below twice the radius.
class NearRegion::Search : public PairBatches<NearRegion::Search> {
 public:
  /// `lost`: what the separation and rounding take from a distance. `first_of_second`: number of
  /// the first vertex of the second mesh.
  Search(const SweptPair& pair, const SweptFrame& frame, double lost, double most_gap,
         unsigned first_of_second, Pairs& pairs)
      : PairBatches<Search>(pair),
        scale_(frame.scale),
        lost_(lost),
        most_distance_(float4::all(frame.lengthUp(lost + most_gap))),
        position_error_(std::max(pair.tree1.positionError(), pair.tree2.positionError())),
        first_of_second_(first_of_second),
        pairs_(pairs) {}

 private:
  friend PairBatches<Search>;

  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE unsigned decided(const MovingPairs4& four) {
    distances_ = leastDistances<kNumFirst>(four, position_error_);
    return float4::bits(distances_ > most_distance_);
  }
  template <int kNumFirst>
  void test(const PairRef& ref, unsigned k) {
    const auto of = verticesOf<kNumFirst>(ref);
    Pair pair{{}, downward(double(distances_[k]) / scale_ - lost_)};
    for (int i = 0; i < 4; ++i)
      pair.corners[std::size_t(i)] =
          of.vertices[i] + ((i < kNumFirst) == of.swapped ? first_of_second_ : 0);
    (kNumFirst == 2 ? pairs_.edge_edge : pairs_.vertex_face).push_back(pair);
  }

  const double scale_, lost_;
  const Float4 most_distance_;  ///< in the frame, as distances_
  const float position_error_;
  const unsigned first_of_second_;
  Pairs& pairs_;
  Float4 distances_;  ///< lower bounds of the four pairs that were tested last
};

/// Takes positions as references, and discards what was found around others.
void NearRegion::Found::begin(const std::vector<PlacedMotion>& bodies, double radius) {
  for (auto* list : {&pairs.vertex_face, &pairs.edge_edge}) list->clear();
  references.clear();
  error = 0;
  Eigen::AlignedBox3d box;
  for (const PlacedMotion& body : bodies) {
    const MovingMesh& mesh = body.mesh();
    references.insert(references.end(), mesh.start, mesh.start + mesh.num_vertices);
    error = std::max(error, mesh.error);
  }
  for (const fcl::Vector3d& x : references) box.extend(x);
  const double largest =
      std::max(box.min().lpNorm<Eigen::Infinity>(), box.max().lpNorm<Eigen::Infinity>());
  // A position on a way differs from the exact one by 4 u of its coordinates and of the way.
  rounding = 16 * rounding::epsilon<double>() * (largest + radius) + error;
  const fcl::Vector3d reach = fcl::Vector3d::Constant(radius);
  frame = SweptFrame(box.min() - reach, box.max() + reach);
  position_error = SweptTree::kPositionError + frame.lengthUp(rounding);
}

void NearRegion::search(const std::vector<PlacedMotion>& bodies) {
  spare_.begin(bodies, radius_);
  std::size_t first = 0;
  for (const PlacedMotion& body : bodies) {
    addPairs(bodies[0].with(body, separation_), static_cast<unsigned>(first));
    first += body.mesh().num_vertices;
  }
  const std::size_t size = spare_.references.size();
  now_.reserve(size);
  shares_.resize(size, 1);
  in_radius_.resize(size, 1);
  reach_.resize(size, 0);
  begins_.resize(size);
  ends_.resize(size);
  std::swap(found_, spare_);
  now_ = found_.references;
  for (std::size_t v = 0; v < size; ++v) begins_[v] = ends_[v] = found_.frame(now_[v]);
}

/// Appends the pairs of two bodies to those of this search.
void NearRegion::addPairs(const ContinuousQuery& query, unsigned first_of_second) {
  SweptBoxes boxes(query);
  const double lost = separation_ + 4 * spare_.rounding;
  const SweptPair pair =  // obstacles do not move
      boxes.overInterval({}, radius_ + spare_.rounding, spare_.rounding);
  Search search(pair, boxes.frame(), lost, 2 * radius_, first_of_second, spare_.pairs);
  TriangleSearch<FeatureFinder<Search>>(pair.trees(), search, pair).runFromRoots();
}

std::size_t NearRegion::truncate(const Points& proposed) {
  limitToRadius(proposed);
  limitToPlanes<1>(found_.pairs.vertex_face, proposed);
  limitToPlanes<2>(found_.pairs.edge_edge, proposed);
  std::size_t count = 0;
  for (std::size_t v = 0; v < proposed.size(); ++v)
    count += shares_[v] == in_radius_[v] && in_radius_[v] < 1;
  return count;
}

/// Obstacles do not move: their reach stays 0.
void NearRegion::limitToRadius(const Points& proposed) {
  for (std::size_t v = 0; v < proposed.size(); ++v) {
    const fcl::Vector3d from = now_[v] - found_.references[v],
                        to = proposed[v] - found_.references[v];
    const double share = in_radius_[v] = shares_[v] = shareInBall(from, to, radius_);
    const fcl::Vector3d end = share == 1 ? to : fcl::Vector3d(from + share * (to - from));
    reach_[v] = upward(std::sqrt(std::max(from.squaredNorm(), end.squaredNorm())));
    begins_[v] = found_.frame(now_[v]);
    ends_[v] = found_.frame(found_.references[v] + end);
  }
}

/// Lowers the shares of all pairs that the motion can bring together.
template <int kNumFirst>
void NearRegion::limitToPlanes(const std::vector<Pair>& pairs, const Points& proposed) {
  std::array<const Pair*, 4> four;
  std::size_t count = 0;
  for (const Pair& pair : pairs) {
    float reach[2] = {0, 0};
    for (int i = 0; i < 4; ++i)
      reach[i >= kNumFirst] = std::max(reach[i >= kNumFirst], reach_[pair.corners[std::size_t(i)]]);
    if (reach[0] + reach[1] < pair.gap) continue;
    four[count++] = &pair;
    if (count == 4) limitFour<kNumFirst>(four, std::exchange(count, 0), proposed);
  }
  if (count > 0) {
    std::fill(four.begin() + std::ptrdiff_t(count), four.end(), four[0]);
    limitFour<kNumFirst>(four, count, proposed);
  }
}

/// Lowers the shares of the first `count` of four pairs. Leaves out pairs that a plane separates
/// all the way.
template <int kNumFirst>
void NearRegion::limitFour(const std::array<const Pair*, 4>& four, std::size_t count,
                           const Points& proposed) {
  MovingPairs4 all;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto columns = [&](const std::vector<Float4>& x) -> Vector4x3 {
      return float4::columns(x[four[0]->corners[i]], x[four[1]->corners[i]], x[four[2]->corners[i]],
                             x[four[3]->corners[i]]);
    };
    all.begin[i] = columns(begins_);
    all.end[i] = columns(ends_);
  }
  const unsigned apart = haveFixedPlane<kNumFirst>(
      all, {found_.frame.lengthUp(separation_), found_.position_error, 1});
  for (std::size_t k = 0; k < count; ++k)
    if (!(apart >> k & 1)) limit(kNumFirst, *four[k], proposed);
}

void NearRegion::limit(int firsts, const Pair& pair, const Points& proposed) {
  std::array<FeatureTruncation::Corner, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t v = pair.corners[i];
    corners[i] = {&now_[v], v < proposed.size() ? &proposed[v] : &now_[v], &shares_[v],
                  found_.error};
  }
  FeatureTruncation(firsts, corners, separation_).lowerShares();
}

}  // namespace adaptive_bvh
