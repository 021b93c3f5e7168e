#include "run_page.h"

#include <cstdio>
#include <fstream>
#include <vector>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "clock.h"
#ifdef ADAPTIVE_BVH_HAS_RECORDING
#include "adaptive_bvh/recording.h"
#endif

namespace tools {

#ifdef ADAPTIVE_BVH_HAS_RECORDING
namespace {

double megabytes(const std::string& path) {
  return double(std::ifstream(path, std::ios::binary | std::ios::ate).tellg()) / 1e6;
}

/// What updates and queries of a frame take, milliseconds.
struct FrameTimes {
  double update, query;
};

/// The times of the program that is shown: meshes, without the recorder and without the volumes of
/// the models that it draws.
std::vector<FrameTimes> timesOf(const MovingPair& pair) {
  adaptive_bvh::DeformableMesh a(pair.a), b(pair.b);
  adaptive_bvh::CoherentDistance followed(a, b);
  const auto origin = fcl::Transform3d::Identity();
  std::vector<FrameTimes> times;
  for (int frame = 1; frame <= pair.frames; ++frame) {
    const double t = double(frame) / pair.frames;
    const Positions &pa = pair.motion_a.at(t), &pb = pair.motion_b.at(t);
    fcl::DistanceResultd result;
    Clock clock;
    a.update(pa);
    b.update(pb);
    const double update_ms = clock.milliseconds();
    followed.distance(origin, origin, fcl::DistanceRequestd(true), result);
    times.push_back({update_ms, clock.milliseconds()});
  }
  return times;
}

}  // namespace

template <typename BV>
void writePage(const MovingPair& pair, const std::string& path) {
  adaptive_bvh::AdaptiveBVHModel<BV> a, b;
  fillModel(pair.a, a);
  fillModel(pair.b, b);
  const auto origin = fcl::Transform3d::Identity();

  adaptive_bvh::RecordingOptions options;
  options.title = "A deforming body above a waving plate";
  options.volume_depth = 5;
  adaptive_bvh::Recording recording(options);
  recording.add(a, origin, "body");
  recording.add(b, origin, "plate");
  const std::vector<FrameTimes> times = timesOf(pair);
  double recording_ms = 0;
  for (int frame = 1; frame <= pair.frames; ++frame) {
    const double t = double(frame) / pair.frames;
    const Positions &pa = pair.motion_a.at(t), &pb = pair.motion_b.at(t);
    fcl::DistanceResultd result;
    a.update(pa);
    b.update(pb);
    adaptive_bvh::distance(&a, origin, &b, origin, fcl::DistanceRequestd(true), result);
    const FrameTimes& now = times[static_cast<std::size_t>(frame - 1)];
    Clock clock;
    recording.frame(adaptive_bvh::FrameResults(result).addTimes(now.update, now.query));
    recording_ms += clock.milliseconds();
  }
  Clock clock;
  recording.write(path);
  const double writing_ms = clock.milliseconds();
  std::printf(
      "page: %s (%.1f MB)\n  its times are those of meshes, in a run without the recorder; "
      "recording %.3f ms a frame, writing %.0f ms\n",
      path.c_str(), megabytes(path), recording_ms / pair.frames, writing_ms);
}
#else
template <typename BV>
void writePage(const MovingPair&, const std::string&) {
  std::printf("built without the component recording (libjs-three): no page\n");
}
#endif

template void writePage<fcl::RSSd>(const MovingPair&, const std::string&);
template void writePage<fcl::OBBRSSd>(const MovingPair&, const std::string&);

}  // namespace tools
