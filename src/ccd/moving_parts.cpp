// Times of contact of moving triangles and shapes, by conservative advancement.
#include "ccd/moving_parts.h"

#include <algorithm>
#include <cmath>

#include "adaptive_bvh/continuous_collision.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

// Relative to the coordinates: the rounding error of a gap, and a gap that counts as contact.
constexpr double kRounding = 1e-14, kTolerance = 1e-12;

/// A part at one time, as a convex set.
class PartAt final : public ConvexSet {
 public:
  PartAt(const MovingPart& part, double t) : part_(part), t_(t) {}
  Vector support(const Vector& direction) const override { return part_.support(t_, direction); }

 private:
  const MovingPart& part_;
  const double t_;
};

/// Returns a time between `from` and `latest`, as late as bisection finds, up to which a gap is
/// above `needed`. gap(t): the gap at time t, above `needed` at `from`. `curvature`: bound of its
/// second derivative; between two times dt apart it falls at most curvature dt^2 / 8 below the
/// smaller of both values. (It does not fall below it if the gap is concave: curvature 0.)
template <typename Gap>
double lastAbove(const Gap& gap, double curvature, double needed, double from, double latest) {
  constexpr int kBisections = 40;
  const double at_start = gap(from);
  const auto isAbove = [&](double t) {
    return std::min(at_start, gap(t)) - curvature * (t - from) * (t - from) / 8 > needed;
  };
  if (isAbove(latest)) return latest;
  double above = from, below = latest;
  for (int step = 0; step < kBisections; ++step) {
    const double middle = (above + below) / 2;
    (isAbove(middle) ? above : below) = middle;
  }
  return above;
}

constexpr int kMostSteps = 200;  // of conservative advancement; then the time so far is returned

/// timeOfContact for bounded parts. Each step goes as far as the gap along the present normal stays
/// above the separation. Along a fixed direction, the gap of two points is linear in time, and the
/// gap of two parts is the smallest over their points: a concave function of time.
double timeOfConvexContact(const MovingPart& first, const MovingPart& second, double separation,
                           double latest) {
  const double extent = std::max(first.extent(), second.extent());
  const double rounding = kRounding * extent, contact_gap = separation + kTolerance * extent;
  double t = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    const ConvexGap found = convexGap(PartAt(first, t), PartAt(second, t));
    const Vector& n = found.normal;
    const auto gap = [&](double time) {
      return n.dot(first.support(time, -n) - second.support(time, n)) - rounding;
    };
    if (found.distance <= 0 || !(gap(t) > contact_gap)) return t;
    const double next = lastAbove(gap, 0, separation, t, latest);
    if (next == latest) return Impact::kNever;
    if (!(next > t)) return t;
    t = next;
  }
  return t;
}

/// The plane n x = d of a flat shape in the world.
struct Plane {
  Vector n;
  double d;

  explicit Plane(const PlacedSolid& placed) {
    const FlatSolid& flat = *placed.solid.flat();
    n = placed.tf.linear() * flat.normal();
    d = n.dot(placed.tf * Vector(flat.offset() * flat.normal()));
  }
};

/// timeOfContact for a part and a plane or half-space. The height n x - d of a point is quadratic
/// in time; its second derivative is at most twice the product of the lengths of the motions of n
/// and x. The interpolated n is not longer than 1, so the height is a lower bound of the distance.
double timeOfFlatContact(const MovingPart& part, const MovingPart& flat, double separation,
                         double latest) {
  Plane from(flat.placed(false)), to(flat.placed(true));
  const bool is_solid = flat.flat()->isSolid();
  if (!is_solid && from.n.dot(part.support(0, from.n)) < from.d)  // the part is behind the plane
    for (Plane* plane : {&from, &to}) plane->n = -plane->n, plane->d = -plane->d;
  const double extent = std::max({part.extent(), std::fabs(from.d), std::fabs(to.d)});
  const double rounding = kRounding * extent, contact_gap = separation + kTolerance * extent;
  const double curvature = 2 * (to.n - from.n).norm() * part.largestMotion();
  const auto height = [&](double t) {
    const Vector n = (1 - t) * from.n + t * to.n;
    return n.dot(part.support(t, -n)) - ((1 - t) * from.d + t * to.d) - rounding;
  };
  double t = 0;
  for (int step = 0; step < kMostSteps && height(t) > contact_gap; ++step) {
    const double next = lastAbove(height, curvature, separation, t, latest);
    if (next == latest) return Impact::kNever;
    if (!(next > t)) break;
    t = next;
  }
  return t;
}

/// timeOfContact for two planes or half-spaces: 0 if they touch, or if one turns, because only
/// parallel ones are apart.
double timeOfUnboundedContact(const MovingPart& first, const MovingPart& second, double separation,
                              double latest, double parallel) {
  const TriangleGap start = gapOf(first.placed(false), second.placed(false), parallel);
  if (!(start.distance > separation)) return 0;
  const Vector n = (start.points.second - start.points.first) / start.distance;
  double at_end = 0;  // the gap, negative if they overlap
  for (const MovingPart* part : {&first, &second}) {
    const Plane from(part->placed(false)), to(part->placed(true));
    if (from.n.cross(to.n).norm() > parallel) return 0;
    at_end += (part == &first ? -1 : 1) * n.dot(to.n) * to.d;
  }
  if (at_end > separation) return Impact::kNever;
  constexpr double kEarly = 1 - kTolerance;
  const double time = (start.distance - separation) / (start.distance - at_end) * kEarly;
  return time <= latest ? time : Impact::kNever;
}

}  // namespace

Vector MovingPart::support(double t, const Vector& direction) const {
  if (const Solid* const shape = this->shape()) {
    const fcl::Matrix3d linear = (1 - t) * start_tf_.linear() + t * end_tf_.linear();
    const Vector translation = (1 - t) * start_tf_.translation() + t * end_tf_.translation();
    return linear * shape->support(linear.transpose() * direction) + translation;
  }
  Vector best = (1 - t) * start_[0] + t * end_[0];
  for (std::size_t k = 1; k < 3; ++k) {
    const Vector x = (1 - t) * start_[k] + t * end_[k];
    if (direction.dot(x) > direction.dot(best)) best = x;
  }
  return best;
}

double MovingPart::radius() const {
  Vector most;
  for (int k = 0; k < 3; ++k)
    most[k] = std::max(std::fabs(shape()->support(Vector::Unit(k))[k]),
                       std::fabs(shape()->support(-Vector::Unit(k))[k]));
  return most.norm();
}

double MovingPart::largestMotion() const {
  if (shape())
    return (end_tf_.translation() - start_tf_.translation()).norm() +
           (end_tf_.linear() - start_tf_.linear()).norm() * radius();
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) most = std::max(most, (end_[k] - start_[k]).norm());
  return most;
}

double MovingPart::extent() const {
  if (shape())
    return radius() + std::max(start_tf_.translation().norm(), end_tf_.translation().norm());
  double most = 0;
  for (const auto* corners : {&start_, &end_})
    for (const Vector& x : *corners) most = std::max(most, x.norm());
  return most;
}

double timeOfContact(const MovingPart& first, const MovingPart& second, double separation,
                     double latest, double parallel) {
  if (first.flat() && second.flat())
    return timeOfUnboundedContact(first, second, separation, latest, parallel);
  if (first.flat()) return timeOfFlatContact(second, first, separation, latest);
  if (second.flat()) return timeOfFlatContact(first, second, separation, latest);
  return timeOfConvexContact(first, second, separation, latest);
}

}  // namespace adaptive_bvh
