#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace adaptive_bvh_bench {

/// Adds the subcommand `proximity` to a program. Returns what runs it, once the command line was
/// parsed with it: prints a markdown table, and says whether all methods found the same pairs.
std::function<bool()> addProximityQuestions(CLI::App& app);

}  // namespace adaptive_bvh_bench
