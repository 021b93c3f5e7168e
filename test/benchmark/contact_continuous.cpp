// This library's candidates and earliest impact between two frames.
#include "contact_continuous.h"

#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh_bench {
namespace {

/// Lists all candidates, and finds the earliest impact. The mesh itself needs no update: it lends
/// the tree.
class Continuous : public ContactMethod {
 public:
  Continuous(const ContactCase& contact_case, int threads)
      : mesh_(contact_case.scenario.first.mesh()), end_(contact_case.scenario.first.positions(0)) {
    mesh_.setThreads(threads);
  }

  void update(const Frame& frame) override {
    start_.swap(end_);
    end_ = frame.first;
  }
  void query() override {
    const adaptive_bvh::Motion motion(mesh_, start_, end_);
    first_ = selfEarliestImpact(motion, 0, pairs_);
  }
  ContactAnswer answer() override {
    ContactAnswer answer;
    answer.counts.candidates = long(pairs_.size());
    answer.distance = first_.time;
    return answer;
  }

 private:
  adaptive_bvh::DeformableMesh mesh_;
  Positions start_, end_;
  adaptive_bvh::FeaturePairs pairs_;
  adaptive_bvh::Impact first_;
};

}  // namespace

std::vector<ContactKind> continuousContactMethods(int threads) {
  const auto row = [](const std::string& key, const std::string& title, int used) -> ContactKind {
    return {key, title, ContactKind::Ours, false, {Job::Continuous}, [used](const ContactCase& c) {
              return std::make_unique<Continuous>(c, used);
            }};
  };
  std::vector<ContactKind> kinds = {row("continuous", "adaptive_bvh, continuous", 1)};
  if (threads > 1)
    kinds.push_back(row("continuous-threads",
                        "adaptive_bvh, continuous, " + std::to_string(threads) + " threads",
                        threads));
  return kinds;
}

}  // namespace adaptive_bvh_bench
