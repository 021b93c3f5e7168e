#pragma once

#include <optional>

#include "ccd/moving_body.h"
#include "scene/body.h"

namespace adaptive_bvh {

/// The motion of a mesh or a shape in the step.
class SteppingBody {
 public:
  SteppingBody(const Body& stepping, FramePath path)
      : body(stepping), object_(stepping.geometry.at(fcl::Transform3d::Identity())) {
    if (!body.isMesh()) {
      moving_.emplace(object_.solid().solid,
                      FrameMotion(rotated(body.start_tf), rotated(body.tf), path));
      return;
    }
    const MeshState& mesh = body.mesh();
    const FrameMotion frame(body.start_tf, body.tf, path);
    if (mesh.previous.empty())
      moving_.emplace(mesh, frame);
    else
      moving_.emplace(mesh, mesh.previous.data(), mesh.vertices.data(), frame);
  }
  SteppingBody(const SteppingBody&) = delete;
  SteppingBody& operator=(const SteppingBody&) = delete;

  const MovingBody& moving() const { return *moving_; }
  bool isFlat() const { return moving_->flat() != nullptr; }

  const Body& body;

 private:
  const QueryObject object_;
  std::optional<MovingBody> moving_;
};

}  // namespace adaptive_bvh
