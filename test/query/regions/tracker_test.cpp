// The identity of contact regions over steps: scripted bodies, and the rule on random triangles.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "adaptive_bvh/contact_regions.h"
#include "support/closed_bodies.h"

namespace adaptive_bvh_test {
namespace tracker_test {

using adaptive_bvh::ContactChange;
using adaptive_bvh::ContactEvent;
using adaptive_bvh::ContactRegions;
using adaptive_bvh::ContactTracker;
using adaptive_bvh::DeformableMesh;
using Ids = std::vector<std::uint64_t>;

std::string written(const std::vector<ContactEvent>& events) {
  const char* const names[] = {"born", "persisting", "split", "merged", "gone"};
  std::string text;
  for (const ContactEvent& e : events) {
    text += names[int(e.change)] + (" " + std::to_string(e.id));
    if (e.other != e.id) text += " " + std::to_string(e.other);
    text += ", ";
  }
  return text;
}

/// A body with two bumps below is pressed into a block, so deep that both contacts become one, and
/// lifted again.
TEST(ContactTracker, FollowsBumpsThatMergeAndSplit) {
  constexpr int kSide = 20;
  const TriangleMesh flat = latticeBox(kSide);
  TriangleMesh bumpy = flat;
  for (auto& p : bumpy.vertices) {
    if (p[2] > 0) continue;
    for (const double x : {6., 14.}) {
      const double r2 = (p[0] - x) * (p[0] - x) + (p[1] - 10) * (p[1] - 10);
      p[2] -= (x < 10 ? 4 : 3) * std::exp(-r2 / 10);
    }
  }
  const DeformableMesh block(flat), press(bumpy);
  ContactRegions regions;
  ContactTracker tracker;
  const auto step = [&](double height) {
    fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
    tf2.translation() = Eigen::Vector3d(0.3, 0.2, kSide + height);
    contactRegions(block, tf1, press, tf2, regions);
    tracker.track(regions);
    return written(tracker.events());
  };
  EXPECT_EQ("", step(5));
  EXPECT_EQ("born 1, ", step(3.2));
  EXPECT_EQ("persisting 1, born 2, ", step(2));
  EXPECT_EQ("persisting 1, persisting 2, ", step(1.9));
  EXPECT_EQ("persisting 1, merged 2 1, ", step(0.4));
  EXPECT_EQ(Ids{1}, tracker.ids());
  EXPECT_EQ("persisting 1, split 3 1, ", step(1.9));
  EXPECT_EQ((Ids{1, 3}), tracker.ids());
  EXPECT_EQ("persisting 1, gone 3, ", step(3.2));
  EXPECT_EQ("gone 1, ", step(5));
  EXPECT_EQ("", step(5));
  EXPECT_EQ("born 4, ", step(3.2));
  tracker.clear();
  EXPECT_EQ("born 5, ", step(3.2));
}

/// The rule, by sets.
class Judge {
 public:
  using Region = std::set<unsigned>;

  std::vector<ContactEvent> track(const std::vector<Region>& now) {
    std::vector<std::uint64_t> ids(now.size(), 0);
    std::vector<bool> is_continued(before_.size(), false);
    for (;;) {
      std::size_t most = 0, best_old = 0, best_new = 0;
      for (std::size_t a = 0; a < before_.size(); ++a)
        for (std::size_t b = 0; b < now.size(); ++b) {
          const std::size_t count = shared(before_[a], now[b]);
          if (is_continued[a] || ids[b] != 0 || count < most || count == 0) continue;
          const bool is_smaller =
              most == 0 || ids_[a] < ids_[best_old] || (a == best_old && b < best_new);
          if (count == most && !is_smaller) continue;
          most = count;
          best_old = a;
          best_new = b;
        }
      if (most == 0) break;
      is_continued[best_old] = true;
      ids[best_new] = ids_[best_old];
    }
    std::vector<ContactEvent> events;
    for (std::size_t b = 0; b < now.size(); ++b) {
      if (ids[b] != 0) {
        events.push_back({ContactChange::Persisting, ids[b], ids[b]});
        continue;
      }
      std::size_t most = 0;
      std::uint64_t from = ids[b] = ++last_;
      for (std::size_t a = 0; a < before_.size(); ++a) {
        const std::size_t count = shared(before_[a], now[b]);
        if (count < most || count == 0 || (count == most && ids_[a] > from)) continue;
        most = count;
        from = ids_[a];
      }
      events.push_back({most ? ContactChange::Split : ContactChange::Born, ids[b], from});
    }
    std::map<std::uint64_t, ContactEvent> ended;
    for (std::size_t a = 0; a < before_.size(); ++a) {
      if (is_continued[a]) continue;
      std::size_t most = 0;
      std::uint64_t into = ids_[a];
      for (std::size_t b = 0; b < now.size(); ++b)
        if (const std::size_t count = shared(before_[a], now[b]); count > most) {
          most = count;
          into = ids[b];
        }
      ended[ids_[a]] = {most ? ContactChange::Merged : ContactChange::Gone, ids_[a], into};
    }
    for (const auto& e : ended) events.push_back(e.second);
    before_ = now;
    ids_ = ids;
    return events;
  }

 private:
  static std::size_t shared(const Region& a, const Region& b) {
    std::size_t count = 0;
    for (const unsigned t : a) count += b.count(t);
    return count;
  }

  std::vector<Region> before_;
  std::vector<std::uint64_t> ids_;
  std::uint64_t last_ = 0;
};

TEST(ContactTracker, FollowsItsRule) {
  RandomGeometry random(91);
  std::map<ContactChange, long> counts;
  for (int run = 0; run < manySteps(200); ++run) {
    ContactTracker tracker;
    Judge judge;
    for (int step = 0; step < 20; ++step) {
      ContactRegions regions;
      std::vector<Judge::Region> sets(std::size_t(random.below(5)));
      regions.volumes.resize(sets.size());
      for (auto* side : {&regions.first, &regions.second}) {
        side->begins = {0};
        for (auto& set : sets) {
          std::set<unsigned> triangles;
          for (int i = random.below(7); i > 0; --i) triangles.insert(unsigned(random.below(30)));
          side->triangles.insert(side->triangles.end(), triangles.begin(), triangles.end());
          side->begins.push_back(side->triangles.size());
          for (const unsigned t : triangles) set.insert(t + (side == &regions.second ? 100 : 0));
        }
      }
      tracker.track(regions);
      const auto expected = judge.track(sets);
      ASSERT_EQ(written(expected), written(tracker.events())) << run << ", " << step;
      for (const ContactEvent& e : expected) ++counts[e.change];
    }
  }
  EXPECT_EQ(5u, counts.size());
}

}  // namespace tracker_test
}  // namespace adaptive_bvh_test
