#pragma once

#include <functional>
#include <string>
#include <vector>

#include "adaptive_bvh/mesh_io.h"

/// Pairs of deforming bodies after thesis chapter IV, for examples, benchmark, tuner and tests. All
/// of it is computed: no files, no randomness. Lengths: the helmet's radius is about 1.
namespace scenarios {

using Point = fcl::Vector3d;
using Mesh = adaptive_bvh::TriangleMesh<double>;
using Pose = Eigen::Isometry3d;

/// A surface and its motion. Time runs from 0 (at rest) to 1 (the end of the motion).
class Body {
 public:
  /// Where the point that rests at `rest` is at time t: a map of space, so that meshes of every
  /// resolution move alike.
  using Motion = std::function<Point(const Point& rest, double t)>;

  Body(std::string name, Mesh rest, int frames, Motion motion, const Pose& pose = Pose::Identity());

  const std::string& name() const { return name_; }
  int frames() const { return frames_; }
  /// The mesh at frame 0, placed.
  Mesh mesh() const;
  const std::vector<fcl::Triangle>& triangles() const { return rest_.triangles; }
  std::size_t vertices() const { return rest_.vertices.size(); }

  /// Positions in a frame, placed; past the last frame the body stays as it is.
  void positions(int frame, std::vector<Point>& out) const;
  std::vector<Point> positions(int frame) const;

  /// Places the body further: `pose` after what it already has.
  Body placed(const Pose& pose) const;

 private:
  std::string name_;
  Mesh rest_;
  int frames_;
  Motion motion_;
  Pose pose_;
};

struct Scenario {
  std::string name;
  Body first, second;

  /// As long as the longer body.
  int frames() const { return std::max(first.frames(), second.frames()); }
  std::size_t triangles() const { return first.triangles().size() + second.triangles().size(); }
};

struct Options {
  /// Every mesh gets about resolution^2 times the triangles, with the same motion.
  int resolution = 1;
  /// Plates lie in coordinate planes. That flatters axis-aligned boxes, so by default the whole
  /// scene is turned by one generic rotation.
  bool aligned = false;
};

/// \name The bodies of thesis Table 1, at rest or moving; vertices/triangles/frames at resolution 1
/// \{
Body plate(int resolution = 1);          ///< 100/162/62: bulges up and down
Body twistingPlate(int resolution = 1);  ///< 100/162/218: its ends turn by a full turn
Body cable(int resolution = 1);          ///< 100/180/127: hangs from one end, swings and bends
Body helmet(int resolution = 1);         ///< 385/710/20: squeezed from both sides, with a dent
Body foldingSheet(int resolution = 1);   ///< 100/162/29: folds on itself
/// \}

/// The five pairs of thesis figures 2 to 6. Each comes near in some frames and touches in a few.
std::vector<Scenario> thesisScenarios(const Options& options = {});

/// How far a body's vertices move from frame to frame while it deforms.
struct MotionSize {
  double mean_in_edges = 0, largest_in_edges = 0;          ///< in mean edge lengths at rest
  double mean_in_diagonals = 0, largest_in_diagonals = 0;  ///< in bounding-box diagonals at rest
};
MotionSize measureMotion(const Body& body);

}  // namespace scenarios
