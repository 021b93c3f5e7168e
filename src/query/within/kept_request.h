#pragma once

#include <array>
#include <optional>
#include <vector>

#include "adaptive_bvh/contact_set.h"
#include "adaptive_bvh/surface_neighbourhood.h"
#include "base/pack.h"

namespace adaptive_bvh {

/// Which pairs a ContactSet holds. It owns what it ignores.
struct KeptRequest {
  explicit KeptRequest(const ContactSetRequest& request)
      : distance(request.distance),
        has_features(request.elements == ContactElements::Features),
        ignored(own(request.ignored)) {}
  KeptRequest(const KeptRequest&) = delete;
  KeptRequest& operator=(const KeptRequest&) = delete;

  std::array<std::vector<FeaturePair>, 4> lists;
  std::optional<SurfaceNeighbourhood> surface;
  const double distance;
  const bool has_features;
  const Ignored ignored;  ///< refers to the lists and the surface here
  /// Whether there may be pairs to leave out, apart from neighbours.
  const bool ignores_some = doesIgnore(ignored.triangles) || doesIgnore(ignored.vertex_face) ||
                            doesIgnore(ignored.face_vertex) || doesIgnore(ignored.edge_edge);

  /// How many pairs of each kind the bits of a candidate stand for (CandidateRows).
  std::array<std::size_t, 3> kindsOf(unsigned bits, bool is_self) const {
    if (!has_features) return {bits & 1, 0, 0};
    const auto count = [&](unsigned mask) -> std::size_t {
      return static_cast<std::size_t>(packs::countOf16(bits & mask));
    };
    const std::size_t first = count(0x7), second = count(0x38), edges = count(0x7fc0);
    return is_self ? std::array<std::size_t, 3>{first + second, 0, edges}
                   : std::array<std::size_t, 3>{first, second, edges};
  }

 private:
  static bool doesIgnore(const IgnoredPairs& pairs) { return pairs.list || pairs.test; }
  Ignored own(Ignored given) {
    if (given.surface) given.surface = &surface.emplace(*given.surface);
    std::size_t list = 0;
    for (IgnoredPairs* pairs :
         {&given.triangles, &given.vertex_face, &given.face_vertex, &given.edge_edge})
      if (pairs->list) pairs->list = &(lists[list++] = *pairs->list);
    return given;
  }
};

}  // namespace adaptive_bvh
