#pragma once

#include "contact_method.h"

namespace adaptive_bvh_bench {

/// One method on one case. Milliseconds a frame, one entry a repeat; counts are sums over frames.
struct ContactMeasurement {
  std::string key, title;
  bool is_ours = false, by_fcl_test = false;
  std::vector<double> update_ms, query_ms;
  std::vector<double> frame_ms;  ///< update + query by frame, least of the repeats
  ContactCounts counts;
  long missed = 0, extra = 0;  ///< pairs of triangles, against touchingPairs
  int wrong_frames = 0;        ///< whose distance differs by more than its tolerance
  double worst_error = 0;      ///< of a distance

  double total(std::size_t repeat) const { return update_ms[repeat] + query_ms[repeat]; }
};

struct ContactResult {
  Job job;
  std::string name;
  int resolution = 1, frames = 0;
  std::size_t triangles = 0;
  long contacts = 0;                                ///< the judge's, all frames
  double least_distance = 0, largest_distance = 0;  ///< of a distance job, the judge's
  std::vector<ContactMeasurement> methods;

  /// Was one of our rows wrong?
  bool oursFailed() const;
};

struct ContactRunOptions {
  int repeats = 3;
  unsigned seed = 1;  ///< of the order in which the methods take turns
  std::function<void(double, const std::string&)> progress;
};

/// All methods that do the job, in one process and thread. They take turns in every frame, in an
/// order drawn anew, so that what slows the machine down for a while slows all of them. Positions
/// are computed outside of the clock. In the first repeat all answers are compared with the
/// judge's.
ContactResult runContactCase(const ContactCase& contact_case, const std::vector<ContactKind>& kinds,
                             const ContactRunOptions& options);

}  // namespace adaptive_bvh_bench
