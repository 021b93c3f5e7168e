#include "contact_runner.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include "contact_continuous.h"
#include "contact_judge.h"
#include "stopwatch.h"

namespace adaptive_bvh_bench {
namespace {

/// Those in `a` that are not in `b`.
long missing(const std::vector<TrianglePair>& a, const std::vector<TrianglePair>& b) {
  std::vector<TrianglePair> difference;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(difference));
  return long(difference.size());
}

/// Counts that a method does not report stay negative.
void add(long& sum, long count) {
  if (count >= 0) sum = std::max(sum, 0L) + count;
}

/// What is right in one frame.
struct Truth {
  TouchingPairs pairs;
  double distance = 0;  ///< or a time
  double motion = 1;    ///< of a time: how far vertices move in a step
};

double largestMotion(const Positions& from, const Positions& to) {
  double largest = 0;
  for (std::size_t v = 0; v < from.size(); ++v)
    largest = std::max(largest, (to[v] - from[v]).norm());
  return largest;
}

class ContactRun {
 public:
  ContactRun(const ContactCase& contact_case, const std::vector<ContactKind>& kinds,
             const ContactRunOptions& options)
      : case_(contact_case), options_(options) {
    for (const ContactKind& kind : kinds)
      if (std::count(kind.jobs.begin(), kind.jobs.end(), case_.job)) kinds_.push_back(&kind);
    result_.job = case_.job;
    result_.name = case_.scenario.name;
    result_.frames = case_.frames();
    result_.triangles = case_.triangles();
    for (const ContactKind* kind : kinds_) {
      ContactMeasurement m;
      m.key = kind->key;
      m.title = kind->title;
      m.is_ours = kind->owner == ContactKind::Ours;
      m.by_fcl_test = kind->by_fcl_test;
      result_.methods.push_back(m);
    }
    steps_ = 1 + double(case_.frames()) * options.repeats;
  }

  ContactResult all() {
    judge();
    std::mt19937 random(options_.seed);
    for (int repeat = 0; repeat < options_.repeats; ++repeat) runAll(random, repeat == 0);
    return std::move(result_);
  }

 private:
  void step(const std::string& what) {
    if (options_.progress)
      options_.progress(done_++ / steps_,
                        case_.scenario.name + ", " + toString(case_.job) + ": " + what);
  }

  void load(int frame) {
    before_ = frame_.first;
    case_.scenario.first.positions(frame, frame_.first);
    if (!case_.isSelf()) case_.scenario.second.positions(frame, frame_.second);
  }

  Truth truth() const {
    const Mesh first = {frame_.first, case_.scenario.first.triangles()};
    if (case_.job == Job::Continuous)
      return {{},
              earliestImpactOfAll({first, before_, frame_.first}),
              largestMotion(before_, frame_.first)};
    if (case_.isSelf()) return {touchingPairs(first), 0};
    const Mesh second = {frame_.second, case_.scenario.second.triangles()};
    if (case_.job == Job::Collide) return {touchingPairs(first, second), 0};
    return {{}, exactDistance(first, second)};
  }

  void judge() {
    step("judge");
    load(0);
    for (int frame = 1; frame <= case_.frames(); ++frame) {
      load(frame);
      truths_.push_back(truth());
      result_.contacts += long(truths_.back().pairs.surely.size());
    }
    const auto nearer = [](const Truth& a, const Truth& b) { return a.distance < b.distance; };
    const auto [low, high] = std::minmax_element(truths_.begin(), truths_.end(), nearer);
    result_.least_distance = low->distance;
    result_.largest_distance = high->distance;
  }

  void runAll(std::mt19937& random, bool first_time) {
    std::vector<std::unique_ptr<ContactMethod>> methods;
    std::vector<std::size_t> order;
    for (const ContactKind* kind : kinds_) {
      order.push_back(order.size());
      methods.push_back(kind->make(case_));
      result_.methods[order.back()].update_ms.push_back(0);
      result_.methods[order.back()].query_ms.push_back(0);
    }
    for (std::size_t frame = 0; frame < truths_.size(); ++frame) {
      step("frame " + std::to_string(frame + 1));
      load(int(frame) + 1);
      std::shuffle(order.begin(), order.end(), random);
      for (std::size_t k : order) {
        runFrame(*methods[k], frame, result_.methods[k]);
        if (first_time) compare(methods[k]->answer(), truths_[frame], result_.methods[k]);
      }
    }
  }

  void runFrame(ContactMethod& method, std::size_t frame, ContactMeasurement& m) const {
    const double update = milliseconds([&] { method.update(frame_); });
    const double query = milliseconds([&] { method.query(); });
    m.update_ms.back() += update / case_.frames();
    m.query_ms.back() += query / case_.frames();
    m.frame_ms.resize(truths_.size(), std::numeric_limits<double>::max());
    m.frame_ms[frame] = std::min(m.frame_ms[frame], update + query);
  }

  void compare(const ContactAnswer& answer, const Truth& truth, ContactMeasurement& m) const {
    add(m.counts.box_tests, answer.counts.box_tests);
    add(m.counts.candidates, answer.counts.candidates);
    add(m.counts.triangle_tests, answer.counts.triangle_tests);
    if (case_.isNumber()) return compareDistance(answer, truth, m);
    add(m.counts.contacts, m.by_fcl_test ? long(answer.pairs.size()) : answer.counts.contacts);
    if (!m.by_fcl_test) return;
    m.missed += missing(truth.pairs.surely, answer.pairs);
    m.extra += missing(answer.pairs, truth.pairs.possibly);
  }

  /// The tolerance is what coordinates of a size of about 1 leave of a small difference. A time is
  /// as good as the place at that time: it may be early by as much as edges are nearly parallel.
  static void compareDistance(const ContactAnswer& answer, const Truth& truth,
                              ContactMeasurement& m) {
    if (answer.distance == truth.distance) return;  // both may be infinite
    const double error = std::abs(answer.distance - truth.distance) * truth.motion;
    m.worst_error = std::max(m.worst_error, error);
    m.wrong_frames += !(error <= 1e-12 + 1e-9 * truth.distance * truth.motion);
  }

  const ContactCase& case_;
  const ContactRunOptions& options_;
  std::vector<const ContactKind*> kinds_;
  ContactResult result_;
  Frame frame_;
  Positions before_;           // of the first body, in the frame before
  std::vector<Truth> truths_;  // by frame
  double steps_, done_ = 0;
};

}  // namespace

const char* toString(Job job) {
  switch (job) {
    case Job::SelfCollision: return "self-collision";
    case Job::Collide: return "collide";
    case Job::Distance: return "distance";
    case Job::Continuous: return "continuous";
  }
  return "";
}

bool ContactResult::oursFailed() const {
  return std::any_of(methods.begin(), methods.end(), [](const ContactMeasurement& m) {
    return m.is_ours && (m.missed > 0 || m.extra > 0 || m.wrong_frames > 0);
  });
}

ContactResult runContactCase(const ContactCase& contact_case, const std::vector<ContactKind>& kinds,
                             const ContactRunOptions& options) {
  return ContactRun(contact_case, kinds, options).all();
}

}  // namespace adaptive_bvh_bench
