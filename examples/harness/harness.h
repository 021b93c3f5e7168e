#pragma once

#include "elastic_rods.h"
#include "route.h"

namespace harness {

/// A wiring harness in an engine bay on a shaker. The bay and all that is fixed to it, clips and
/// sockets too, shake as one, and frames are seen from the bay: parts stand still, and the cables
/// swing by gravity and inertia. Contacts are not resolved: a cable would pass through what is in
/// its way. Clips and sockets are left out, as they touch the harness by design.
class Harness {
 public:
  static constexpr double kFramesPerSecond = 200;

  /// At rest, with about so many triangles. Throws std::invalid_argument below 4,000.
  explicit Harness(std::size_t triangles);

  /// The next frame, 1 / kFramesPerSecond later. The shaker starts with the first.
  void advance();

  /// The surface now: closed tubes and connectors, which overlap where a cable branches. Triangles
  /// are the same in every frame.
  const Surface& surface() const { return surface_; }
  const ElasticRods& rods() const { return rods_; }

 private:
  struct Sleeve {
    double at, reach, height;  ///< along the cable, in edges; height above the cable
  };
  struct Rod {
    Cable cable;
    std::vector<std::size_t> nodes;
    std::vector<int> edges;
    std::vector<Sleeve> sleeves;
    int around = 0, rings = 0;
  };
  void addCable(const Cable& cable);
  void clampEnds(const Rod& rod);
  void tessellate(std::size_t triangles);
  Surface currentSurface() const;
  Surface tube(const Rod& rod) const;
  Points ring(const Rod& rod, double at) const;
  Surface plug(const Rod& rod) const;

  ElasticRods rods_;
  std::vector<Rod> cables_;
  Surface surface_;
  double time_ = 0;
};

}  // namespace harness
