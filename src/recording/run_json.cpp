#include "json_text.h"
#include "run.h"

namespace adaptive_bvh {
namespace {

double number(std::size_t n) { return static_cast<double>(n); }

const char* nameOf(VolumeKind kind) {
  switch (kind) {
    case VolumeKind::SweptRectangle: return "swept rectangle";
    case VolumeKind::Box: return "box";
    default: return "none";
  }
}

void writeBody(const RecordedBody& body, JsonText& json) {
  json.open('{').member("name", body.name);
  json.member("vertices", double(body.vertices)).member("triangles", double(body.triangles));
  json.member("indices", number(body.triangles_begin));
  json.member("indexBits", body.small_indices ? 16. : 32.);
  json.member("volumes", std::string(nameOf(body.source->volumeKind())));
  json.close('}');
}

void writePoints(const char* name, const PointBlock& points, JsonText& json) {
  json.key(name).open('{').member("at", number(points.begin)).member("count", number(points.count));
  json.key("low").open('[').values(points.low).close(']');
  json.key("size").open('[').values(points.size).close(']').close('}');
}

/// By columns: the images of x, y and z, and the origin.
void writePose(const fcl::Transform3d& pose, JsonText& json) {
  json.key("pose").open('[');
  for (int column = 0; column < 4; ++column)
    json.values(fcl::Vector3d(pose.matrix().col(column).head<3>()));
  json.close(']');
}

void writeUpdate(const UpdateReport& report, JsonText& json) {
  json.key("update").open('{').member("nodes", double(report.nodes));
  json.member("refitted", double(report.refitted())).member("moved", double(report.moved));
  json.member("inflated", double(report.inflated));
  json.member("displacement", report.largest_displacement).close('}');
}

void writeBodyPose(const RecordedPose& body, const RecordedPose* before, JsonText& json) {
  json.open('{');
  if (!before || before->positions.begin != body.positions.begin)
    writePoints("positions", body.positions, json);
  if (!before || before->pose.matrix() != body.pose.matrix()) writePose(body.pose, json);
  json.key("volumes").open('[').value(number(body.volumes_begin));
  json.value(number(body.volume_count)).close(']');
  if (body.clearance) {
    json.key("clearance").open('{').member("at", number(body.clearance->begin));
    json.member("low", body.clearance->low).member("high", body.clearance->high).close('}');
  }
  if (body.updated) writeUpdate(body.update, json);
  json.close('}');
}

void writeResults(const RecordedFrame& frame, JsonText& json) {
  const FrameResults& results = frame.results;
  if (results.distance) json.member("distance", *results.distance);
  if (results.update_ms) json.member("updateMs", *results.update_ms);
  if (results.query_ms) json.member("queryMs", *results.query_ms);
  if (results.contact_count) json.member("contactCount", number(*results.contact_count));
  if (!results.note.empty()) json.member("note", results.note);
  if (frame.contacts.count > 0) writePoints("contacts", frame.contacts, json);
  if (results.nearest_points.empty()) return;
  json.key("nearest").open('[');
  for (const auto& [first, second] : results.nearest_points) {
    json.open('[').values(first).values(second);
    json.close(']');
  }
  json.close(']');
}

}  // namespace

std::string toJson(const Run& run) {
  JsonText json;
  json.open('{').member("format", 1.).member("title", run.options.title);
  json.member("unit", run.options.unit).member("volumeDepth", double(run.options.volume_depth));
  json.member("framesPerSecond", run.options.frames_per_second);
  json.key("up").open('[').values(run.options.up).close(']');
  json.member("dataBytes", number(run.blob.size()));
  json.key("bodies").open('[');
  for (const RecordedBody& body : run.bodies) writeBody(body, json);
  json.close(']').key("frames").open('[');
  const RecordedFrame* before = nullptr;
  for (const RecordedFrame& frame : run.frames) {
    json.open('{').key("bodies").open('[');
    for (std::size_t i = 0; i < frame.bodies.size(); ++i)
      writeBodyPose(frame.bodies[i], before ? &before->bodies[i] : nullptr, json);
    json.close(']');
    writeResults(frame, json);
    json.close('}');
    before = &frame;
  }
  json.close(']').close('}');
  return json.text();
}

}  // namespace adaptive_bvh
