#pragma once

#include "tree/boxes.h"
#include "tree/incidence.h"

namespace adaptive_bvh {

/// How many volumes a propagation changed: see UpdateReport.
struct Propagated {
  int moved = 0, inflated = 0;
  void operator+=(const Propagated& other) {
    moved += other.moved;
    inflated += other.inflated;
  }
};

/// The translation-compensated propagation: renews all boxes, and moves and inflates every volume
/// so that it surely holds its triangles at their new positions. One sweep from the leaves to the
/// root.
///
/// Let every vertex below a node move by some d in the box [low, high] of displacements, c its
/// centre and h half its diagonal. d = c + e with |e| <= h. A volume that held the vertex at p
/// before holds p + c when it is moved by c, and p + d when its radius also grows by h. So a node
/// that moves as a whole does not grow at all, and one that is strained grows by its own strain,
/// at a rate relative to its size that does not depend on how large it is or how deep it lies.
///
/// The staged motions are what is left beyond a common translation m: d = m + e. A volume moves by
/// m + c, c the centre of the box of the e; m is added in the model's own precision, so that the
/// single precision of c and h costs nothing where a body moves far and deforms little.
///
/// docs/bounds.md has the proof with rounding.
template <typename BV>
Propagated propagateByBoxes(fcl::BVHModel<BV>& model, const Topology& topology,
                            Boxes<typename BV::S>& boxes);

/// All nodes below one: their pairs of siblings are a range.
struct Subtree {
  int root;
  int first_pair, last_pair;  ///< left siblings
  Swept value;                ///< the root's, when they are swept
};

/// About `count` subtrees without a node in common, from the last to the first, as equal in size as
/// the tree allows. None for small trees.
template <typename BV>
std::vector<Subtree> subtreesOf(const fcl::BVHModel<BV>& model, int count);

/// propagateByBoxes in two parts: first below every subtree's root, on whatever thread; then the
/// rest. `stack` has as many places as the tree is deep, and two.
template <typename BV>
Propagated propagateWithin(fcl::BVHModel<BV>& model, const Topology& topology,
                           Boxes<typename BV::S>& boxes, Subtree& subtree, Swept* stack);
template <typename BV>
Propagated propagateAbove(fcl::BVHModel<BV>& model, const Topology& topology,
                          Boxes<typename BV::S>& boxes, const std::vector<Subtree>& subtrees);

/// The same for the marked nodes and the root, where nothing moved below the others.
template <typename BV>
Propagated propagateByBoxes(fcl::BVHModel<BV>& model, const Topology& topology,
                            const Incidence& incidence, Boxes<typename BV::S>& boxes);

}  // namespace adaptive_bvh
