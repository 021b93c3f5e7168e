#pragma once

#include <embree3/rtcore.h>

#include <cfloat>
#include <cmath>
#include <memory>
#include <type_traits>
#include <vector>

#include <Eigen/Geometry>

namespace adaptive_bvh_bench {

/// A float below or at x, at most two floats away.
inline float roundedDown(double x) {
  const auto f = float(x);
  return double(f) <= x ? f : f - std::abs(f) * FLT_EPSILON - FLT_MIN;
}
inline float roundedUp(double x) { return -roundedDown(-x); }

struct ReleaseEmbree {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <typename Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, ReleaseEmbree>;

/// A scene with one user geometry: a box a primitive, in a tree that each commit refits, or builds
/// anew by Embree's fastest builder (RTC_BUILD_QUALITY_LOW, Morton codes).
class EmbreeBoxes {
 public:
  EmbreeBoxes(RTCDevice device, std::size_t count,
              RTCBuildQuality quality = RTC_BUILD_QUALITY_REFIT)
      : boxes_(count),
        geometry_(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER)),
        scene_(rtcNewScene(device)) {
    rtcSetGeometryUserPrimitiveCount(geometry_.get(), unsigned(count));
    rtcSetGeometryUserData(geometry_.get(), this);
    rtcSetGeometryBoundsFunction(geometry_.get(), writeBounds, nullptr);
    rtcSetGeometryBuildQuality(geometry_.get(), quality);
    // Only a dynamic scene of low quality keeps a tree a geometry, which can be refitted.
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_LOW);
    rtcAttachGeometry(scene_.get(), geometry_.get());
  }
  EmbreeBoxes(const EmbreeBoxes&) = delete;
  EmbreeBoxes& operator=(const EmbreeBoxes&) = delete;

  /// To be set, and then committed.
  Eigen::AlignedBox3d& box(std::size_t i) { return boxes_[i]; }
  const Eigen::AlignedBox3d& box(std::size_t i) const { return boxes_[i]; }
  void commit() {
    rtcCommitGeometry(geometry_.get());
    rtcCommitScene(scene_.get());
  }
  RTCScene scene() const { return scene_.get(); }

 private:
  static void writeBounds(const RTCBoundsFunctionArguments* arguments) {
    const auto& boxes = *static_cast<const EmbreeBoxes*>(arguments->geometryUserPtr);
    const Eigen::AlignedBox3d& box = boxes.boxes_[arguments->primID];
    RTCBounds& bounds = *arguments->bounds_o;
    bounds.lower_x = roundedDown(box.min()[0]);
    bounds.lower_y = roundedDown(box.min()[1]);
    bounds.lower_z = roundedDown(box.min()[2]);
    bounds.upper_x = roundedUp(box.max()[0]);
    bounds.upper_y = roundedUp(box.max()[1]);
    bounds.upper_z = roundedUp(box.max()[2]);
  }

  std::vector<Eigen::AlignedBox3d> boxes_;
  Owned<RTCGeometry> geometry_;
  Owned<RTCScene> scene_;
};

}  // namespace adaptive_bvh_bench
