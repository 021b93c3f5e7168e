#include "adaptive_bvh/recording.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <ostream>
#include <system_error>

#include "adaptive_bvh/detail/write_file.h"
#include "body.h"
#include "frame_json.h"

// Recording: collects the frames of a run as JSON text and arrays of numbers (Blob), and writes
// them as a page. Values that did not change since the previous frame are not stored again.
namespace adaptive_bvh {
namespace {

constexpr int kMaxVolumeDepth = 20;

/// Throws std::invalid_argument for a call of this function of Recording.
[[noreturn]] void refuse(const std::string& call, const std::string& why) {
  throw std::invalid_argument("Recording::" + call + ": " + why);
}

void checkPose(const std::string& call, const fcl::Transform3d& tf) {
  if (!tf.matrix().allFinite()) refuse(call, "the transform is not finite");
}

/// What was recorded last of a body: the values that the next frame is compared with.
struct LastFrame {
  PointBlock positions;
  DistanceBlock vertex_distances;
  json pose;
  const VolumeRecord* volumes = nullptr;            ///< in the Blob
  std::size_t volumes_begin = 0, volume_count = 0;  ///< beginning in the Blob; number of volumes
  UpdateReport update;
};

/// A body of the run.
struct RecordedBody {
  std::unique_ptr<BodySource> source;  ///< null if the body was removed
  std::string name;
  int vertices = 0, triangles = 0;  ///< their numbers when the body was added
  fcl::Transform3d pose;            ///< current pose, for the next frame
  json description;                 ///< data that do not change between frames
  LastFrame last;
};

/// Undoes appending to a Blob if an exception is thrown: the destructor removes what was appended
/// since the constructor, unless `keep` was called.
class BlobMark {
 public:
  explicit BlobMark(Blob& blob) : blob_(&blob), begin_(blob.size()) {}
  ~BlobMark() {
    if (blob_) blob_->takeBack(begin_);
  }
  BlobMark(const BlobMark&) = delete;
  BlobMark& operator=(const BlobMark&) = delete;
  void keep() { blob_ = nullptr; }

 private:
  Blob* blob_;  ///< null after `keep`
  const std::size_t begin_;
};

/// A body of a followed scene that the recording does not have yet.
struct NewBody {
  BodyId id;
  std::unique_ptr<BodySource> source;
  std::string name;
};

/// Throws unless the body's mesh or model has as many vertices and triangles as when it was added.
void checkCounts(const RecordedBody& body) {
  const int vertices = body.source->vertexCount(), triangles = body.source->triangleCount();
  if (vertices == body.vertices && triangles == body.triangles) return;
  refuse("frame", "'" + body.name + "' has " + std::to_string(vertices) + " vertices and " +
                      std::to_string(triangles) + " triangles, and had " +
                      std::to_string(body.vertices) + " and " + std::to_string(body.triangles) +
                      " when it was added");
}

/// The body with this number, to which results (`what`) refer. Throws if it does not exist.
const RecordedBody& bodyWith(int number, const char* what,
                             const std::vector<RecordedBody>& bodies) {
  const auto body = static_cast<std::size_t>(number);
  if (number < 0 || body >= bodies.size())
    refuse("frame", std::string(what) + " of body " + std::to_string(number) + ", of " +
                        std::to_string(bodies.size()) + " bodies");
  if (!bodies[body].source)
    refuse("frame", std::string(what) + " of '" + bodies[body].name + "', which was removed");
  return bodies[body];
}

// The functions check... throw std::invalid_argument if results cannot be recorded.

void checkVertexDistances(const VertexValues& distances, const std::vector<RecordedBody>& bodies) {
  const RecordedBody& body = bodyWith(distances.body, "distances of vertices", bodies);
  if (distances.values.size() != static_cast<std::size_t>(body.vertices))
    refuse("frame", std::to_string(distances.values.size()) + " distances given for the " +
                        std::to_string(body.vertices) + " vertices of '" + body.name + "'");
  for (const double value : distances.values)
    if (!std::isfinite(value)) refuse("frame", "the distance of a vertex is not finite");
}

void checkPatches(const TrianglePatches& patches, const std::vector<RecordedBody>& bodies) {
  const RecordedBody& body = bodyWith(patches.body, "patches", bodies);
  if (patches.triangles.size() != patches.patches.size())
    refuse("frame", std::to_string(patches.patches.size()) + " patches given for " +
                        std::to_string(patches.triangles.size()) + " triangles");
  for (const unsigned triangle : patches.triangles)
    if (triangle >= static_cast<unsigned>(body.triangles))
      refuse("frame", "a patch names triangle " + std::to_string(triangle) + " of '" + body.name +
                          "', which has " + std::to_string(body.triangles));
}

void checkArrows(const Arrows& arrows) {
  if (arrows.origins.size() != arrows.vectors.size())
    refuse("frame", "'" + arrows.label + "' has " + std::to_string(arrows.vectors.size()) +
                        " vectors for " + std::to_string(arrows.origins.size()) + " origins");
  if (!(arrows.scale >= 0 && std::isfinite(arrows.scale)))
    refuse("frame", "the scale of '" + arrows.label + "' is negative or not finite");
}

void checkResults(const FrameResults& results, const std::vector<RecordedBody>& bodies) {
  for (const VertexValues& distances : results.vertex_distances)
    checkVertexDistances(distances, bodies);
  for (const TrianglePatches& patches : results.patches) checkPatches(patches, bodies);
  for (const Arrows& arrows : results.arrows) checkArrows(arrows);
}

/// Whether an update took place between two reports. Even equal work hardly ever takes equal times,
/// so different updates have different reports.
bool isNew(const UpdateReport& now, const UpdateReport& before) {
  return now.largest_displacement != before.largest_displacement ||
         now.displacement_seconds != before.displacement_seconds ||
         now.propagation_seconds != before.propagation_seconds ||
         now.refit_seconds != before.refit_seconds;
}

}  // namespace

struct Recording::State {
  RecordingOptions options;
  std::vector<RecordedBody> bodies;
  int frame_count = 0;
  std::string frames;  ///< as JSON, separated by commas
  Blob blob;
  /// Adds, moves and removes bodies as in the followed scene; empty if none is followed.
  std::function<void(Recording&)> read_scene;
  std::map<BodyId, int> numbers;  ///< the number in `bodies` of each body of the followed scene

  /// Appends the corners of triangles, in 16 bits if `small`. Returns the position in the Blob.
  std::size_t appendCorners(const std::vector<std::uint32_t>& corners, bool small);
  json record(RecordedBody& body);
  void recordVolumes(RecordedBody& body, bool updated);
  std::string textOfFrame(const FrameResults& results);
  std::string runAsJson() const;
  void requireBody(const char* call, int body) const;  ///< throws if there is no such body
};

std::size_t Recording::State::appendCorners(const std::vector<std::uint32_t>& corners, bool small) {
  const std::size_t begin = blob.size();
  if (small)
    blob.append(std::vector<std::uint16_t>(corners.begin(), corners.end()));
  else
    blob.append(corners);
  return begin;
}

/// The current state of a body as JSON; null if it was removed. Omits unchanged values.
json Recording::State::record(RecordedBody& body) {
  if (!body.source) return nullptr;
  json now;
  if (!body.source->isFixed() || body.last.positions.count == 0) {
    const PointBlock positions = body.source->appendPositions(blob);
    if (positions == body.last.positions)
      blob.takeBack(positions.begin);
    else
      now["positions"] = asJson(body.last.positions = positions);
  }
  json pose = asJson(body.pose);
  if (pose != body.last.pose) now["pose"] = body.last.pose = std::move(pose);

  const UpdateReport update = body.source->lastUpdate();
  const bool updated = isNew(update, body.last.update);
  if (updated) now["update"] = asJson(body.last.update = update);
  if (options.volume_depth >= 0) recordVolumes(body, updated);
  now["volumes"] = {body.last.volumes_begin, body.last.volume_count};
  return now;
}

/// Appends the volumes of a body, unless they equal those recorded last.
void Recording::State::recordVolumes(RecordedBody& body, bool updated) {
  const std::vector<VolumeRecord> volumes = body.source->volumes(
      {options.volume_depth, updated, options.deeper_refits}, body.last.positions.low);
  const std::size_t bytes = volumes.size() * sizeof(VolumeRecord);
  if (volumes.size() == body.last.volume_count &&
      (bytes == 0 || std::memcmp(volumes.data(), body.last.volumes, bytes) == 0))
    return;
  body.last.volume_count = volumes.size();
  body.last.volumes_begin = blob.size();
  body.last.volumes = blob.append(volumes);
}

std::string Recording::State::runAsJson() const {
  json run = {{"format", 1},
              {"title", options.title},
              {"unit", options.unit},
              {"timeUnit", options.time_unit},
              {"volumeDepth", options.volume_depth},
              {"framesPerSecond", options.frames_per_second},
              {"up", asJson(options.up)},
              {"dataBytes", blob.size()}};
  if (options.vertex_distance_range) run["vertexDistanceRange"] = *options.vertex_distance_range;
  for (const RecordedBody& body : bodies) run["bodies"].push_back(body.description);
  std::string text = textOf(run);
  text.pop_back();  // the closing brace, to add a member
  return text + ",\"frames\":[" + frames + "]}";
}

Recording::Recording(const RecordingOptions& options) : state_(std::make_unique<State>()) {
  if (!options.up.allFinite() || options.up.isZero(0))
    refuse("Recording", "up must be a direction");
  if (!(options.frames_per_second > 0 && std::isfinite(options.frames_per_second)))
    refuse("Recording", "frames_per_second must be positive");
  if (options.volume_depth > kMaxVolumeDepth)
    refuse("Recording", "volume_depth is at most " + std::to_string(kMaxVolumeDepth));
  if (options.deeper_refits < 0) refuse("Recording", "deeper_refits is negative");
  for (const double end : options.vertex_distance_range.value_or(std::array<double, 2>{}))
    if (!std::isfinite(end)) refuse("Recording", "vertex_distance_range is not finite");
  state_->options = options;
}

Recording::~Recording() = default;
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;

int Recording::add(std::unique_ptr<BodySource> source, const fcl::Transform3d& tf,
                   const std::string& name) {
  checkPose("add", tf);
  const std::vector<std::uint32_t> corners = source->corners();
  const int vertices = source->vertexCount(), triangles = source->triangleCount();
  if (corners.empty()) refuse("add", "'" + name + "' has no triangles");
  for (const std::uint32_t corner : corners)
    if (corner >= static_cast<std::uint32_t>(vertices))
      refuse("add", "a triangle of '" + name + "' names a missing vertex");

  const bool small = vertices <= std::numeric_limits<std::uint16_t>::max();
  BlobMark mark(state_->blob);
  const json description = {{"name", name},
                            {"vertices", vertices},
                            {"triangles", triangles},
                            {"indices", state_->appendCorners(corners, small)},
                            {"indexBits", small ? 16 : 32},
                            {"unbounded", source->isUnbounded()},
                            {"volumes", source->volumeKind()}};
  RecordedBody body;
  body.source = std::move(source);
  body.name = name;
  body.vertices = vertices;
  body.triangles = triangles;
  body.pose = tf;
  body.description = description;
  state_->bodies.push_back(std::move(body));
  mark.keep();
  return bodies() - 1;
}

void Recording::State::requireBody(const char* call, int body) const {
  if (body < 0 || static_cast<std::size_t>(body) >= bodies.size())
    refuse(call, "body " + std::to_string(body) + ", of " + std::to_string(bodies.size()));
  const RecordedBody& found = bodies[static_cast<std::size_t>(body)];
  if (!found.source) refuse(call, "'" + found.name + "' was removed");
}

void Recording::place(int body, const fcl::Transform3d& tf) {
  state_->requireBody("place", body);
  checkPose("place", tf);
  state_->bodies[static_cast<std::size_t>(body)].pose = tf;
}

void Recording::remove(int body) {
  state_->requireBody("remove", body);
  for (const auto& [id, number] : state_->numbers)
    if (number == body)
      refuse("remove", "'" + state_->bodies[static_cast<std::size_t>(body)].name + "' is body " +
                           std::to_string(id) + " of the followed scene");
  state_->bodies[static_cast<std::size_t>(body)].source.reset();
}

void Recording::follow(const Scene& scene, const std::function<std::string(BodyId)>& name) {
  if (state_->read_scene) throw std::logic_error("Recording::follow: a scene is followed already");
  std::function<void(Recording&)> read_scene = [&scene, name](Recording& recording) {
    // New bodies first, because adding them may throw; then the recording must not have changed.
    State& run = *recording.state_;
    std::vector<NewBody> added;
    for (const BodyId id : scene.bodies()) {
      if (run.numbers.count(id)) continue;
      std::unique_ptr<BodySource> source = sourceOf(scene.geometry(id));
      if (source->triangleCount() == 0) continue;  // an octree without occupied cells
      added.push_back({id, std::move(source), name ? name(id) : "body " + std::to_string(id)});
    }
    std::map<BodyId, int> numbers;
    BlobMark mark(run.blob);
    const std::size_t count = run.bodies.size();
    try {
      for (NewBody& body : added)
        numbers[body.id] =
            recording.add(std::move(body.source), scene.transform(body.id), body.name);
    } catch (const std::bad_alloc&) {
      while (run.bodies.size() > count) run.bodies.pop_back();
      throw;
    }
    mark.keep();
    for (auto entry = run.numbers.begin(); entry != run.numbers.end();) {
      const auto [id, number] = *entry;
      if (scene.contains(id)) {
        recording.place(number, scene.transform(id));
        ++entry;
      } else {
        run.bodies[static_cast<std::size_t>(number)].source.reset();
        entry = run.numbers.erase(entry);
      }
    }
    run.numbers.merge(numbers);
  };
  read_scene(*this);
  state_->read_scene = std::move(read_scene);
}

int Recording::bodyOf(BodyId id) {
  if (state_->read_scene) state_->read_scene(*this);
  const auto found = state_->numbers.find(id);
  if (found == state_->numbers.end())
    refuse("bodyOf", "no scene with a body " + std::to_string(id) + " is followed");
  return found->second;
}

void Recording::frame(const FrameResults& results) {
  State& run = *state_;
  if (run.read_scene) run.read_scene(*this);
  if (run.bodies.empty()) throw std::logic_error("Recording::frame: no body was added");
  for (const RecordedBody& body : run.bodies)
    if (body.source) checkCounts(body);
  checkResults(results, run.bodies);

  std::vector<LastFrame> before;
  for (const RecordedBody& body : run.bodies) before.push_back(body.last);
  BlobMark mark(run.blob);
  try {
    run.frames += run.textOfFrame(results);
  } catch (const std::bad_alloc&) {
    for (std::size_t i = 0; i < before.size(); ++i) std::swap(run.bodies[i].last, before[i]);
    throw;
  }
  mark.keep();
  ++run.frame_count;
}

/// A frame as JSON, preceded by a comma unless it is the first.
std::string Recording::State::textOfFrame(const FrameResults& results) {
  json frame = resultsOf(results, blob);
  for (RecordedBody& body : bodies) frame["bodies"].push_back(record(body));
  const auto jsonOfBody = [&frame](int body) -> json& {
    return frame["bodies"][static_cast<std::size_t>(body)];
  };
  for (const VertexValues& distances : results.vertex_distances)
    jsonOfBody(distances.body)["vertexDistances"] = appendDistances(
        distances.values, bodies[static_cast<std::size_t>(distances.body)].last.vertex_distances,
        blob);
  for (const TrianglePatches& patches : results.patches)
    jsonOfBody(patches.body)["patches"] = appendPatches(patches, blob);
  return (frame_count > 0 ? "," : "") + textOf(frame);
}

int Recording::bodies() const { return static_cast<int>(state_->bodies.size()); }
int Recording::frames() const { return state_->frame_count; }
std::size_t Recording::bytes() const { return state_->blob.size() + state_->frames.size(); }

void Recording::write(std::ostream& out) const {
  if (frames() == 0) throw std::logic_error("Recording::write: no frame was recorded");
  writePage(state_->options.title, state_->runAsJson(), state_->blob, out);
}

void Recording::write(const std::string& path) const {
  if (frames() == 0) throw std::logic_error("Recording::write: no frame was recorded");
  try {
    detail::writeFile(path, [this](std::ostream& out) { write(out); });
  } catch (const std::system_error& error) {
    throw std::runtime_error(std::string("Recording::write: ") + error.what());
  }
}

}  // namespace adaptive_bvh
