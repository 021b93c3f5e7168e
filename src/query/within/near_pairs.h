#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {

// The queries of proximity.h for placed meshes, in double precision. Results are overwritten. They
// throw std::invalid_argument on pairs to ignore that are not sorted, and check nothing else.

/// Finds the pairs of triangles, one of each mesh, that are at most request.distance apart.
void findPairsWithin(const PairOfMeshes& meshes, const ProximityRequest& request,
                     TrianglePairs& result);
/// Finds those of one mesh with itself. Nearest points are placed in the world by the mesh's
/// transform.
void findPairsWithin(const PlacedMesh& mesh, const ProximityRequest& request,
                     TrianglePairs& result);

/// Finds the pairs of features, one of each mesh, that are at most request.distance apart.
void findFeaturePairsWithin(const PairOfMeshes& meshes, const FeatureProximityRequest& request,
                            FeaturePairs& result);
/// Finds those of one mesh with itself, without features that have a vertex in common.
void findFeaturePairsWithin(const PlacedMesh& mesh, const FeatureProximityRequest& request,
                            FeaturePairs& result);

/// Computes the details of pairs of features (featurePairDetails). `to_first`: maps the frame of
/// the second mesh to that of the first. Throws std::invalid_argument unless all features exist.
void findFeatureDetails(const PlacedMesh& first, const MeshState& second,
                        const RelativePlacement& to_first, const FeaturePairs& pairs,
                        FeaturePairDetails& result);

/// Whether the distance of the meshes is at most `distance`.
bool isNearer(const PairOfMeshes& meshes, double distance);

}  // namespace adaptive_bvh
