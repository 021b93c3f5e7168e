#pragma once

#include <array>
#include <vector>

#include "adaptive_bvh/contact_set.h"
#include "base/pack.h"

namespace adaptive_bvh {

/// Which pairs a ContactSet holds, in double precision. It owns the lists of pairs to ignore.
struct KeptRequest {
  template <typename S>
  explicit KeptRequest(const ContactSetRequest<S>& request)
      : distance(static_cast<double>(request.distance)),
        has_features(request.elements == ContactElements::Features),
        filter(request.filter),
        triangles(own(request.triangles, 0)),
        vertex_face(own(request.vertex_face, 1)),
        face_vertex(own(request.face_vertex, 2)),
        edge_edge(own(request.edge_edge, 3)) {}
  KeptRequest(const KeptRequest&) = delete;
  KeptRequest& operator=(const KeptRequest&) = delete;

  std::array<std::vector<FeaturePair>, 4> lists;
  const double distance;
  const bool has_features;
  const NeighbourFilter filter;
  const IgnoredPairs triangles, vertex_face, face_vertex, edge_edge;
  /// Whether there may be pairs to leave out.
  const bool ignores_some = doesIgnore(triangles) || doesIgnore(vertex_face) ||
                            doesIgnore(face_vertex) || doesIgnore(edge_edge);

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
  IgnoredPairs own(const IgnoredPairs& given, std::size_t list) {
    IgnoredPairs owned = given;
    if (!given.list) return owned;
    lists[list] = *given.list;
    owned.list = &lists[list];
    return owned;
  }
};

}  // namespace adaptive_bvh
