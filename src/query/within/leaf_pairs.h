#pragma once

#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "boxes/wide_search.h"
#include "query/within/kept_meshes.h"
#include "query/within/kept_request.h"

namespace adaptive_bvh {

/// Which pairs of triangles a search of KeptPairs finds.
struct LeafPairRange {
  double distance;        ///< largest distance of a pair
  bool is_exact;          ///< false: perhaps also some pairs that are farther apart
  MovedNodes moved = {};  ///< the pairs of nodes to search, if not all
};

/// Finds the pairs of triangles in a range, without the neighbours that the request leaves out.
/// `found`: pairs of indices in the order of the leaves; of one mesh the smaller one comes first.
void findLeafPairs(const KeptMeshes& meshes, const KeptRequest& request, const LeafPairRange& range,
                   std::vector<FeaturePair>& found);

}  // namespace adaptive_bvh
