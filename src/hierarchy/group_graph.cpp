#include "hierarchy/group_graph.h"

#include <algorithm>
#include <utility>

namespace adaptive_bvh {

std::vector<Link> combined(unsigned groups, const std::vector<Link>& links) {
  const Buckets by_first(groups, links.size(), [&](std::size_t i) { return links[i].first; });
  std::vector<Link> result;
  result.reserve(links.size());
  std::vector<std::size_t> place(groups);  // of the link to a group, if at or past this bucket's
  for (unsigned g = 0; g < groups; ++g) {
    const std::size_t bucket = result.size();
    for (unsigned i = by_first.start[g]; i < by_first.start[g + 1]; ++i) {
      const Link& link = links[by_first.items[i]];
      if (link.second == g) continue;
      std::size_t& at = place[link.second];
      if (at >= bucket && at < result.size() && result[at].second == link.second) {
        result[at].weight += link.weight;
      } else {
        at = result.size();
        result.push_back(link);
      }
    }
  }
  return result;
}

GroupGraph::GroupGraph(unsigned groups, const std::vector<Link>& links)
    : neighbours_(2 * links.size() + 1) {
  // Link i has the ends 2 i and 2 i + 1.
  Buckets ends(groups, 2 * links.size(), [&](std::size_t end) {
    return end % 2 == 0 ? links[end / 2].first : links[end / 2].second;
  });
  for (std::size_t i = 0; i < ends.items.size(); ++i) {
    const unsigned end = ends.items[i];
    const Link& link = links[end / 2];
    neighbours_[i] = {end % 2 == 0 ? link.second : link.first, link.weight};
  }
  start_ = std::move(ends.start);
  for (unsigned g = 0; g < groups; ++g)
    std::sort(neighbours_.begin() + start_[g], neighbours_.begin() + start_[g + 1],
              [](const Neighbour& a, const Neighbour& b) {
                return a.weight != b.weight ? a.weight > b.weight : a.group < b.group;
              });
}

}  // namespace adaptive_bvh
