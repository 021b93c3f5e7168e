#pragma once

#include "tree/boxes.h"
#include "tree/incidence.h"

namespace adaptive_bvh {

/// Writes `positions` (one per vertex) into the model, and where every vertex is and how it came
/// there into `boxes`; brings the local bounds up to date. Returns the largest displacement,
/// rounded up; not finite when the old positions were not.
template <typename BV>
typename BV::S stageVertices(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             const fcl::Vector3<typename BV::S>* positions);

/// The same for `count` vertices, by `indices`; of one that is named twice the last position
/// counts. Marks the nodes above them. All other motions become 0.
template <typename BV>
typename BV::S stageVertices(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             Incidence& incidence, const unsigned* indices,
                             const fcl::Vector3<typename BV::S>* positions, std::size_t count);

/// The same without motion, for a model as it stands.
template <typename BV>
void stageInPlace(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes);

}  // namespace adaptive_bvh
