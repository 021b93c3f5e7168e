#pragma once

#include "tree/contours.h"
#include "tree/on_demand.h"

namespace adaptive_bvh {

/// The contours of one model's four-wide tree, found by the first query that needs them after a
/// build.
class ContoursOnDemand {
 public:
  /// `wide`: of the model whose AdaptiveTree is `tree`, up to date.
  template <typename S, typename Tree>
  const Contours& current(const WideTree<S>& wide, const Tree& tree) {
    return contours_.current(tree.topology_number, [&](Contours& contours) {
      contours.adopt(wide.nodes(), wide.size(), tree.topology.slots, TaskPool(tree.query_threads));
    });
  }
  std::size_t bytes() const { return contours_.bytes(); }

 private:
  OnDemand<Contours> contours_;
};

}  // namespace adaptive_bvh
