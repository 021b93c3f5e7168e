#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "adaptive_bvh/mesh.h"

/// Pairs of deforming bodies, for examples, benchmark, tuner and tests: those of thesis chapter IV
/// and some that try other motions. All is computed: no files, no randomness. Lengths: the helmet's
/// radius is about 1.
namespace scenarios {

using Point = fcl::Vector3d;
using Mesh = adaptive_bvh::TriangleMesh;
using Pose = Eigen::Isometry3d;

/// A surface and its motion. Time runs from 0 (at rest) to 1 (the end of the motion).
class Body {
 public:
  /// Writes where every vertex is at time t.
  using Motion =
      std::function<void(const std::vector<Point>& rest, double t, std::vector<Point>& out)>;
  /// A motion of space, so that meshes of every resolution move alike.
  using PointMotion = Point (*)(const Point& rest, double t);

  Body(std::string name, Mesh rest, int frames, Motion motion);
  Body(std::string name, Mesh rest, int frames, PointMotion motion);

  const std::string& name() const { return name_; }
  /// At least 1.
  int frames() const { return std::max(1, frames_ / stride_); }
  /// The mesh at frame 0, placed.
  Mesh mesh() const;
  const std::vector<fcl::Triangle>& triangles() const { return rest_.triangles; }
  std::size_t vertices() const { return rest_.vertices.size(); }

  /// Positions in a frame, placed; past the last frame the body stays as it is.
  void positions(int frame, std::vector<Point>& out) const;
  std::vector<Point> positions(int frame) const;

  /// Places the body further: `pose` after what it already has.
  Body placed(const Pose& pose) const;
  /// Only every stride-th frame: motions are that much larger, frames that much fewer.
  Body withStride(int stride) const;

 private:
  std::string name_;
  Mesh rest_;
  int frames_, stride_ = 1;
  Motion motion_;
  Pose pose_ = Pose::Identity();
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

/// The five pairs of thesis figures 2 to 6. They come near each other; two of the five touch in a
/// few frames at resolution 1, more of them at finer ones.
std::vector<Scenario> thesisScenarios(const Options& options = {});

/// Four more, for what those five leave out:
/// - local poke: a tool presses one dent into a sheet of 2,592 triangles; about 1 % of its vertices
///   move. 60 frames.
/// - cloth drop: a cloth of 9,800 triangles falls on a dome and drapes it. 40 frames.
/// - vibration: the vertices of a helmet swing about where they rest, a period in four frames. A
///   plate stands still below it. The thesis's case for overall displacements (4.3). 60 frames.
/// - rigid tumble: a helmet turns as a whole, twice, above a plate; no strain. 60 frames.
std::vector<Scenario> furtherScenarios(const Options& options = {});

/// Both bodies placed further, by the generic rotation of Options.
Scenario turnedGenerically(const Scenario& scenario);

/// Only every stride-th frame of both bodies.
Scenario withStride(const Scenario& scenario, int stride);

/// How far a body's vertices move from frame to frame while it deforms.
struct MotionSize {
  double mean_in_edges = 0, largest_in_edges = 0;          ///< in mean edge lengths at rest
  double mean_in_diagonals = 0, largest_in_diagonals = 0;  ///< in bounding-box diagonals at rest
};
MotionSize measureMotion(const Body& body);

}  // namespace scenarios
