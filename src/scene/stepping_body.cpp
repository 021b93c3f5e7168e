// The bodies of a scene in a step, and their parts.
#include "scene/stepping_body.h"

#include <algorithm>
#include <limits>

#include "ccd/moving_pairs.h"

namespace adaptive_bvh {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

/// One of four boxes that are relative to an origin and scaled.
WorldBox boxOf(const Boxes4& boxes, int lane, const fcl::Vector3d& origin, double scale) {
  WorldBox box;
  for (int k = 0; k < 3; ++k) {
    box.low[k] = double(boxes.low[k][lane]) / scale + origin[k];
    box.high[k] = double(boxes.high[k][lane]) / scale + origin[k];
  }
  return box;
}

/// Appends boxes around the motion of what is below a node: those of nodes some levels deeper.
void addBoxes(MovingBoxes& boxes, int node, int levels, double scale,
              std::vector<WorldBox>& result) {
  const WideNode& links = boxes.links()[node];
  const bool is_last = levels == 0 || links.isLeaf();
  for (int i = 0; i < int(links.count); ++i)
    if (is_last)
      result.push_back(aroundBoth(boxOf(boxes[node].at[0], i, boxes.origin(0), scale),
                                  boxOf(boxes[node].at[1], i, boxes.origin(1), scale)));
    else
      addBoxes(boxes, links.below[i], levels - 1, scale, result);
}

bool contains(const WorldBox& outer, const WorldBox& inner) {
  return (outer.low.array() <= inner.low.array()).all() &&
         (outer.high.array() >= inner.high.array()).all();
}

}  // namespace

SteppingBody::SteppingBody(const Body& stepping, FramePath path)
    : body(stepping),
      path_(path),
      object_(body.geometry.at(fcl::Transform3d::Identity())),
      from_(body.isMesh() ? body.start_tf : rotated(body.start_tf)),
      to_(body.isMesh() ? body.tf : rotated(body.tf)) {
  const FrameMotion frame(from_, to_, path);
  if (body.isOctree()) {
    cells_.emplace(frame);
    return;
  }
  if (!body.isMesh()) {
    moving_.emplace(object_.solid().solid, frame);
  } else if (const MeshState& mesh = body.mesh(); mesh.previous.empty()) {
    moving_.emplace(mesh, frame);
  } else {
    moving_.emplace(mesh, mesh.previous.data(), mesh.vertices.data(), frame);
  }
  boxed_.emplace(*moving_, *memory_);
}

/// Of a mesh, boxes of its upper nodes: a hose is in few places of its box. Of an octree, one box
/// around all its cells, because the box of the root is far larger.
void SteppingBody::findBoxes() {
  if (moving_ && moving_->mesh() && !(moving_->acceleration() > 0)) {
    const double scale = walkScale(*moving_);
    boxed_->prepare(scale, 0, 1);
    return addBoxes(boxed_->boxes(), 0, 2, scale, boxes_);
  }
  if (moving_) return boxes_.push_back(sweptBox(body, path_));
  WorldBox all = {fcl::Vector3d::Constant(kEndless), fcl::Vector3d::Constant(-kEndless)};
  visitParts([&](const WorldBox& box) { return contains(all, box) ? kEndless : 0; },
             [] { return 0.; },
             [&](BoxedBody&, const WorldBox* cell) {
               if (cell) all = aroundBoth(all, *cell);
             });
  boxes_.push_back(all);
}

double SteppingBody::gapTo(const WorldBox& other) {
  if (moving_ && moving_->flat()) return gapToPlane(other);
  if (boxes_.empty()) findBoxes();
  double least = kEndless;
  for (const WorldBox& box : boxes_) least = std::min(least, gapOf(box, other));
  return least;
}

/// Heights above a plane whose normal and offset change evenly are those at the ends, or between.
double SteppingBody::gapToPlane(const WorldBox& other) const {
  if (moving_->frame().isScrew()) return 0;
  const fcl::Vector3d middle = (other.low + other.high) / 2, half = (other.high - other.low) / 2;
  double lowest = kEndless, highest = -kEndless;
  for (const double t : {0., 1.}) {
    const PlaneAt plane(*moving_, t);
    const double height = plane.normal.dot(middle) - plane.offset,
                 extent = plane.normal.cwiseAbs().dot(half) +
                          1e-12 * (middle.norm() + half.norm() + moving_->magnitude());
    lowest = std::min(lowest, height - extent);
    highest = std::max(highest, height + extent);
  }
  return std::max({lowest, moving_->flat()->isSolid() ? 0 : -highest, 0.});
}

void lowerToImpact(SteppingBody& first, SteppingBody& second, double separation,
                   MotionClearance& found) {
  const auto limit = [&] { return separation; };
  visitParts(first, second, kEndless, limit, [&](const ClearanceQuery& query) {
    MotionClearance now;
    if (!findFirstImpact(query, separation, found.meet() ? found.time : 1, now)) return;
    if (found.meet() && now.time == found.time && !(now.elements < found.elements)) return;
    now.box_tests += found.box_tests;
    now.pair_times += found.pair_times;
    found = now;
  });
}

}  // namespace adaptive_bvh
