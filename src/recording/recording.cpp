#include "adaptive_bvh/recording.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <utility>

#include "run.h"

namespace adaptive_bvh {
namespace {

constexpr int kDeepest = 20;

[[noreturn]] void refuse(const std::string& call, const std::string& why) {
  throw std::invalid_argument("Recording::" + call + ": " + why);
}

void checkPose(const std::string& call, const fcl::Transform3d& tf) {
  if (!tf.matrix().allFinite()) refuse(call, "the transform is not finite");
}

/// The mesh or model of this body still has the vertices and triangles that it was added with.
void checkCounts(const RecordedBody& body) {
  const int vertices = body.source->vertices(), triangles = body.source->triangleCount();
  if (vertices == body.vertices && triangles == body.triangles) return;
  refuse("frame", "'" + body.name + "' has " + std::to_string(vertices) + " vertices and " +
                      std::to_string(triangles) + " triangles, and had " +
                      std::to_string(body.vertices) + " and " + std::to_string(body.triangles) +
                      " when it was added");
}

void checkClearance(const VertexValues& clearance, const std::vector<RecordedBody>& bodies) {
  const auto body = static_cast<std::size_t>(clearance.body);
  if (clearance.body < 0 || body >= bodies.size())
    refuse("frame", "a clearance of body " + std::to_string(clearance.body) + ", of " +
                        std::to_string(bodies.size()) + " bodies");
  if (clearance.values.size() != static_cast<std::size_t>(bodies[body].vertices))
    refuse("frame", std::to_string(clearance.values.size()) + " clearances given for the " +
                        std::to_string(bodies[body].vertices) + " vertices of '" +
                        bodies[body].name + "'");
  for (const double value : clearance.values)
    if (!std::isfinite(value)) refuse("frame", "a clearance is not finite");
}

/// Not the report that the frame before saw: even equal work does not take equal times.
bool isNew(const UpdateReport& now, const UpdateReport& before) {
  return now.displacement_seconds != before.displacement_seconds ||
         now.propagation_seconds != before.propagation_seconds ||
         now.refit_seconds != before.refit_seconds;
}

/// Numbers that are not finite count as left out. Contacts and clearance are left out, too.
FrameResults definedNumbers(const FrameResults& results) {
  FrameResults defined;
  const auto number = [](const std::optional<double>& value) {
    return value && std::isfinite(*value) ? value : std::nullopt;
  };
  defined.distance = number(results.distance);
  defined.update_ms = number(results.update_ms);
  defined.query_ms = number(results.query_ms);
  for (const auto& pair : results.nearest_points)
    if (pair[0].allFinite() && pair[1].allFinite()) defined.nearest_points.push_back(pair);
  defined.contact_count = results.contact_count;
  defined.note = results.note;
  return defined;
}

PointBlock appendFinite(const std::vector<fcl::Vector3d>& points, Blob& blob) {
  std::vector<fcl::Vector3d> finite;
  for (const fcl::Vector3d& point : points)
    if (point.allFinite()) finite.push_back(point);
  return appendPoints(finite.data(), finite.size(), blob);
}

}  // namespace

struct Recording::State {
  Run run;
  std::vector<VolumeRecord> volumes;  ///< of one body in one frame

  int add(std::unique_ptr<BodySource> source, const fcl::Transform3d& tf, const std::string& name);
  RecordedPose poseOf(std::size_t index);
  void keepVolumes(const RecordedPose* before, RecordedPose& now);
};

int Recording::State::add(std::unique_ptr<BodySource> source, const fcl::Transform3d& tf,
                          const std::string& name) {
  checkPose("add", tf);
  if (!run.frames.empty())
    throw std::logic_error("Recording::add: frames have been recorded; add all bodies before");
  const std::vector<std::uint32_t> corners = source->triangles();
  const auto vertices = static_cast<std::size_t>(source->vertices());
  if (corners.empty()) refuse("add", "'" + name + "' has no triangles");
  for (const std::uint32_t corner : corners)
    if (corner >= vertices) refuse("add", "a triangle of '" + name + "' names a missing vertex");

  RecordedBody body;
  body.name = name;
  body.pose = tf;
  body.vertices = source->vertices();
  body.triangles = source->triangleCount();
  body.small_indices = vertices <= std::numeric_limits<std::uint16_t>::max();
  body.triangles_begin = run.blob.size();
  if (body.small_indices) {
    const std::vector<std::uint16_t> small(corners.begin(), corners.end());
    run.blob.append(small.data(), small.size());
  } else {
    run.blob.append(corners.data(), corners.size());
  }
  body.source = std::move(source);
  run.bodies.push_back(std::move(body));
  return static_cast<int>(run.bodies.size()) - 1;
}

RecordedPose Recording::State::poseOf(std::size_t index) {
  const RecordedBody& body = run.bodies[index];
  const RecordedPose* before = run.frames.empty() ? nullptr : &run.frames.back().bodies[index];
  RecordedPose now;
  now.pose = body.pose;
  now.update = body.source->lastUpdate();
  now.updated = before ? isNew(now.update, before->update) : now.update.seconds() > 0;

  now.positions = body.source->appendPositions(run.blob);
  if (before && samePoints(now.positions, before->positions)) {
    run.blob.takeBack(run.blob.size() - now.positions.begin);
    now.positions = before->positions;
  }
  volumes.clear();
  if (run.options.volume_depth >= 0)
    body.source->readVolumes({run.options.volume_depth, now.updated, run.options.deeper_refits},
                             now.positions.low, volumes);
  keepVolumes(before, now);
  return now;
}

/// What was read, or what the frame before has when that is the same.
void Recording::State::keepVolumes(const RecordedPose* before, RecordedPose& now) {
  now.volume_count = volumes.size();
  if (volumes.empty()) return;
  if (before && before->volume_count == volumes.size() &&
      std::memcmp(before->volumes, volumes.data(), volumes.size() * sizeof(VolumeRecord)) == 0) {
    now.volumes = before->volumes;
    now.volumes_begin = before->volumes_begin;
  } else {
    now.volumes_begin = run.blob.size();
    now.volumes = run.blob.append(volumes.data(), volumes.size());
  }
}

Recording::Recording(const RecordingOptions& options) : state_(std::make_unique<State>()) {
  if (!options.up.allFinite() || options.up.isZero(0))
    refuse("Recording", "up must be a direction");
  if (!(options.frames_per_second > 0 && std::isfinite(options.frames_per_second)))
    refuse("Recording", "frames_per_second must be positive");
  if (options.volume_depth > kDeepest)
    refuse("Recording", "volume_depth is at most " + std::to_string(kDeepest));
  if (options.deeper_refits < 0) refuse("Recording", "deeper_refits is negative");
  state_->run.options = options;
}

Recording::~Recording() = default;
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;

template <typename S>
int Recording::add(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                   const std::string& name) {
  return state_->add(sourceOf(mesh), tf.template cast<double>(), name);
}

template <typename BV>
int Recording::add(const AdaptiveBVHModel<BV>& model, const fcl::Transform3<typename BV::S>& tf,
                   const std::string& name) {
  if (model.getNumBVs() == 0) refuse("add", "'" + name + "' has no triangles or is not built");
  return state_->add(sourceOf(model), tf.template cast<double>(), name);
}

int Recording::add(const TriangleMesh<double>& mesh, const fcl::Transform3d& tf,
                   const std::string& name) {
  for (const fcl::Vector3d& point : mesh.vertices)
    if (!point.allFinite()) refuse("add", "a vertex of '" + name + "' is not finite");
  return state_->add(sourceOf(mesh), tf, name);
}

void Recording::place(int body, const fcl::Transform3d& tf) {
  if (body < 0 || body >= bodies())
    refuse("place", "body " + std::to_string(body) + ", of " + std::to_string(bodies()));
  checkPose("place", tf);
  state_->run.bodies[static_cast<std::size_t>(body)].pose = tf;
}

void Recording::frame(const FrameResults& results) {
  Run& run = state_->run;
  if (run.bodies.empty()) throw std::logic_error("Recording::frame: no body was added");
  for (const RecordedBody& body : run.bodies) checkCounts(body);
  for (const VertexValues& clearance : results.clearance) checkClearance(clearance, run.bodies);

  RecordedFrame frame;
  for (std::size_t body = 0; body < run.bodies.size(); ++body)
    frame.bodies.push_back(state_->poseOf(body));
  for (const VertexValues& clearance : results.clearance)
    frame.bodies[static_cast<std::size_t>(clearance.body)].clearance =
        appendValues(clearance.values, run.blob);
  frame.results = definedNumbers(results);
  frame.contacts = appendFinite(results.contacts, run.blob);
  run.frames.push_back(std::move(frame));
}

int Recording::bodies() const { return static_cast<int>(state_->run.bodies.size()); }
int Recording::frames() const { return static_cast<int>(state_->run.frames.size()); }

std::size_t Recording::bytes() const {
  const Run& run = state_->run;
  return run.blob.size() + run.frames.size() * run.bodies.size() * sizeof(RecordedPose);
}

void Recording::write(std::ostream& out) const {
  if (state_->run.frames.empty()) throw std::logic_error("Recording::write: no frame was recorded");
  writePage(state_->run, out);
}

void Recording::write(const std::string& path) const {
  if (state_->run.frames.empty()) throw std::logic_error("Recording::write: no frame was recorded");
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  if (file) writePage(state_->run, file);
  file.close();
  if (!file)
    throw std::runtime_error("Recording::write: cannot write '" + path +
                             "': " + (errno ? std::strerror(errno) : "output failed"));
}

template int Recording::add(const AdaptiveBVHModel<fcl::RSS<float>>&, const fcl::Transform3f&,
                            const std::string&);
template int Recording::add(const AdaptiveBVHModel<fcl::RSS<double>>&, const fcl::Transform3d&,
                            const std::string&);
template int Recording::add(const AdaptiveBVHModel<fcl::OBBRSS<float>>&, const fcl::Transform3f&,
                            const std::string&);
template int Recording::add(const AdaptiveBVHModel<fcl::OBBRSS<double>>&, const fcl::Transform3d&,
                            const std::string&);
template int Recording::add(const DeformableMesh<float>&, const fcl::Transform3f&,
                            const std::string&);
template int Recording::add(const DeformableMesh<double>&, const fcl::Transform3d&,
                            const std::string&);

}  // namespace adaptive_bvh
