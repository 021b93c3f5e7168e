#pragma once

#include <ostream>

#include "contact_runner.h"

namespace adaptive_bvh_bench {

/// Markdown: one table of all cases and methods, update and query.
void writeContactSummary(std::ostream& out, const std::vector<ContactResult>& all,
                         const std::vector<ContactKind>& kinds);

/// Markdown: one table of a job, its cases one below the other. Milliseconds and counts a frame;
/// contacts missed and extra are sums.
void writeContactTable(std::ostream& out, Job job, const std::vector<ContactResult>& all);

/// Everything measured, frame by frame.
void writeContactJson(const std::string& path, const std::vector<ContactResult>& all);

/// One row per case and method.
void writeContactCsv(const std::string& path, const std::vector<ContactResult>& all);

}  // namespace adaptive_bvh_bench
