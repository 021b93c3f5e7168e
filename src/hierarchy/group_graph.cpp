#include "hierarchy/group_graph.h"

#include <algorithm>

namespace adaptive_bvh {

Scratch<Link> combined(unsigned groups, const Scratch<Link>& links) {
  Buckets<Link> by_first(groups, links, [](const Link& link) { return link.first; });
  Scratch<Link> result;
  result.reserve(links.size());
  Scratch<std::size_t> place(groups);  // of the link to a group, if at or past this bucket's
  for (unsigned g = 0; g < groups; ++g) {
    const std::size_t bucket = result.size();
    for (const Link* i = by_first.begin(g); i != by_first.end(g); ++i) {
      const Link& link = *i;
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

GroupGraph::GroupGraph(unsigned groups, const Scratch<Link>& links)
    : start_(groups + 1, 0), neighbours_(2 * links.size() + 1) {
  for (const Link& link : links) {
    ++start_[link.first];
    ++start_[link.second];
  }
  unsigned sum = 0;
  for (unsigned& start : start_) start = sum += start;  // where the group's neighbours end
  for (const Link& link : links) {
    neighbours_[--start_[link.first]] = {link.second, link.weight};
    neighbours_[--start_[link.second]] = {link.first, link.weight};
  }
  for (unsigned g = 0; g < groups; ++g)
    std::sort(neighbours_.begin() + start_[g], neighbours_.begin() + start_[g + 1],
              [](const Neighbour& a, const Neighbour& b) {
                return a.weight != b.weight ? a.weight > b.weight : a.group < b.group;
              });
}

}  // namespace adaptive_bvh
