#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {

// The queries of proximity.h for placed meshes, in double precision. They throw
// std::invalid_argument on pairs to ignore that are not sorted, and check nothing else. Results are
// overwritten.

/// Finds the pairs of triangles that are at most request.distance apart.
void findPairsWithin(const PairOfMeshes& meshes, const ProximityRequest<double>& request,
                     TrianglePairs<double>& result);
/// Of one mesh, in its own frame.
void findPairsWithin(const PlacedMesh& mesh, const ProximityRequest<double>& request,
                     NeighbourFilter filter, TrianglePairs<double>& result);

/// Finds the pairs of features that are at most request.distance apart.
void findFeaturePairsWithin(const PairOfMeshes& meshes,
                            const FeatureProximityRequest<double>& request, FeaturePairs& result);
/// Of one mesh.
void findFeaturePairsWithin(const PlacedMesh& mesh, const FeatureProximityRequest<double>& request,
                            FeaturePairs& result);

/// Whether two triangles are at most so far apart.
bool isNearer(const PairOfMeshes& meshes, double distance);

}  // namespace adaptive_bvh
