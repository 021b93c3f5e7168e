#pragma once

#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adaptive_bvh/recording.h"
#include "blob.h"
#include "body.h"

namespace adaptive_bvh {

/// A body of a run: what does not change over frames.
struct RecordedBody {
  std::string name;
  std::unique_ptr<BodySource> source;
  fcl::Transform3d pose;
  int vertices = 0, triangles = 0;
  std::size_t triangles_begin = 0;  ///< in the Blob: three indices each
  bool small_indices = false;       ///< of 16 bits, else of 32
};

/// A body in one frame.
struct RecordedPose {
  PointBlock positions;
  fcl::Transform3d pose;
  const VolumeRecord* volumes = nullptr;            ///< in the Blob
  std::size_t volumes_begin = 0, volume_count = 0;  ///< where in it, and how many
  std::optional<ValueBlock> clearance;
  bool updated = false;  ///< the body was updated since the frame before
  UpdateReport update;   ///< the last one
};

/// A frame: results, and the bodies in their order.
struct RecordedFrame {
  FrameResults results;  ///< without contacts and clearance, which are in the Blob
  PointBlock contacts;
  std::vector<RecordedPose> bodies;
};

/// All that a page is written from.
struct Run {
  RecordingOptions options;
  std::vector<RecordedBody> bodies;
  std::vector<RecordedFrame> frames;
  Blob blob;
};

/// The run as JSON, without its Blob.
std::string toJson(const Run& run);

/// Writes the page.
void writePage(const Run& run, std::ostream& out);

}  // namespace adaptive_bvh
