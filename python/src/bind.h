#pragma once

#include <pybind11/pybind11.h>

namespace adaptive_bvh::python {

// The parts of the module, each with the classes of its results.

void bindShapes(pybind11::module_& module);
void bindMeshes(pybind11::module_& module);          ///< Mesh, load_mesh, weld_vertices
void bindFiles(pybind11::module_& module);           ///< readers of the command, with mesh_io
void bindLockedMesh(pybind11::module_& module);      ///< DeformableMesh, MeshUpdate
void bindQuery(pybind11::module_& module);           ///< distance, collide, self_collide
void bindPairs(pybind11::module_& module);           ///< CoherentDistance, CoherentProximity
void bindFeatures(pybind11::module_& module);        ///< FeaturePairs
void bindIgnored(pybind11::module_& module);         ///< Ignored, SurfaceNeighbourhood
void bindFeatureDetails(pybind11::module_& module);  ///< feature_pair_details
void bindProximity(pybind11::module_& module);       ///< is_nearer, pairs_within, ...
void bindPoints(pybind11::module_& module);          ///< closest_point, closest_points, ...
void bindRays(pybind11::module_& module);            ///< first_hit, any_hit, ray_hits
void bindPenetration(pybind11::module_& module);     ///< vertex_contacts, signed_distance
void bindDerivatives(pybind11::module_& module);     ///< distance_derivatives
void bindInside(pybind11::module_& module);          ///< signed_distances, is_watertight, ...
void bindContactRegions(pybind11::module_& module);  ///< contact_regions, ContactTracker
void bindContactSet(pybind11::module_& module);      ///< ContactSet
void bindContinuous(pybind11::module_& module);      ///< Motion, candidates, earliest_impact, ...
void bindMotions(pybind11::module_& module);         ///< least_distance, SurfaceNeighbourhood, ...
void bindTrustRegion(pybind11::module_& module);     ///< TrustRegion
void bindScene(pybind11::module_& module);           ///< Scene
void bindRecording(pybind11::module_& module);       ///< _Recording, where the component is there

}  // namespace adaptive_bvh::python
