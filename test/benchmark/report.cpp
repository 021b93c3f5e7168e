#include "report.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "median.h"

namespace adaptive_bvh_bench {
namespace {

/// A method over all scenarios; milliseconds by repeat.
struct Sum {
  std::vector<double> update, query, total;
  Work work;
  int wrong = 0;
  double bytes = 0, triangles = 0;
  double touching = 0;
};

Sum sumOf(const Series& series, std::size_t k) {
  Sum sum;
  const std::size_t repeats = series.scenarios.front().methods[k].update_ms.size();
  sum.update.assign(repeats, 0);
  sum.query = sum.total = sum.update;
  for (const ScenarioResult& scenario : series.scenarios) {
    const Measurement& m = scenario.methods[k];
    for (std::size_t r = 0; r < repeats; ++r) {
      sum.update[r] += m.update_ms[r];
      sum.query[r] += m.query_ms[r];
      sum.total[r] += m.total(r);
    }
    sum.work += m.work;
    sum.wrong += m.wrong_frames;
    sum.touching += m.touching_ms;
    sum.bytes += m.bytes_per_triangle * double(scenario.triangles);
    sum.triangles += double(scenario.triangles);
  }
  return sum;
}

std::size_t referenceOf(const std::vector<MethodKind>& kinds) {
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (kinds[k].key == kReference) return k;
  return kinds.size();
}

/// The fastest of FCL's rows; nothing without one.
Sum bestPeer(const Series& series, const std::vector<MethodKind>& kinds) {
  Sum best;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (!kinds[k].is_fcl) continue;
    Sum sum = sumOf(series, k);
    if (best.total.empty() || median(sum.total) < median(best.total)) best = std::move(sum);
  }
  return best;
}

/// How many times faster than the reference, repeat by repeat; 0 without one.
double speedUp(const Sum& reference, const Sum& sum) {
  std::vector<double> ratios;
  for (std::size_t r = 0; r < reference.total.size(); ++r)
    ratios.push_back(reference.total[r] / sum.total[r]);
  return ratios.empty() ? 0 : median(ratios);
}

/// Half of what lies between the least and the greatest, in per cent of the median.
double spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return 50 * (*high - *low) / median(values);
}

template <typename... Values>
std::string text(const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof(buffer), format, values...);
  return buffer;
}

std::ofstream opened(const std::string& path) {
  std::ofstream out(path);
  if (!out) throw std::runtime_error("cannot write '" + path + "'");
  return out;
}

/// How many times faster than FCL's best row of that scenario each of our rows is, where frames
/// touch without those.
void writeLeads(std::ostream& out, const Series& series, const std::vector<MethodKind>& kinds) {
  const auto apart = [](const Measurement& m) {
    double sum = 0;
    for (double ms : m.frame_ms) sum += ms;
    return sum - m.touching_ms;
  };
  if (std::none_of(kinds.begin(), kinds.end(), [](const MethodKind& k) { return k.is_fcl; }))
    return;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (kinds[k].is_fcl || kinds[k].note == MethodKind::Wrong) continue;
    out << "| " << kinds[k].title << ": times faster than FCL's best |";
    for (const ScenarioResult& scenario : series.scenarios) {
      double best = std::numeric_limits<double>::max();
      for (std::size_t j = 0; j < kinds.size(); ++j)
        if (kinds[j].is_fcl) best = std::min(best, apart(scenario.methods[j]));
      out << text(" %.2f |", best / apart(scenario.methods[k]));
    }
    out << '\n';
  }
}

}  // namespace

void writeTables(std::ostream& out, const Series& series, const std::vector<MethodKind>& kinds) {
  int frames = 0, touching = 0;
  std::size_t triangles = 0;
  for (const ScenarioResult& scenario : series.scenarios) {
    frames += scenario.frames;
    touching += scenario.touching_frames;
    triangles += scenario.triangles;
  }
  const std::size_t repeats = series.scenarios.front().methods.front().update_ms.size();
  out << text(
      "\n%s orientation, resolution %d (triangles x %d, %zu in all), stride %d, %d frames, %d of "
      "them touching; medians of %zu\n\n",
      series.aligned ? "Aligned" : "General", series.resolution,
      series.resolution * series.resolution, triangles, series.stride, frames, touching, repeats);
  out << "| method | ms | ± % | faster than FCL RSS | than FCL's best | update | query | touching "
         "| volume tests | triangle tests | refits | wrong frames | bytes a triangle "
         "|\n"
         "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | "
         "---: |\n";
  const std::size_t reference = referenceOf(kinds);
  const Sum base = reference < kinds.size() ? sumOf(series, reference) : Sum();
  const Sum peer = bestPeer(series, kinds);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const Sum sum = sumOf(series, k);
    out << text(
        "| %s | %.1f | %.0f | %.2f | %.2f | %.1f | %.1f | %.1f | %ld | %ld | %ld | %d | %.0f |\n",
        kinds[k].title.c_str(), median(sum.total), spread(sum.total), speedUp(base, sum),
        speedUp(peer, sum), median(sum.update), median(sum.query), sum.touching, sum.work.bv_tests,
        sum.work.leaf_tests, sum.work.refitted, sum.wrong, sum.bytes / sum.triangles);
  }

  out << "\n| ms |";
  for (const ScenarioResult& scenario : series.scenarios) out << ' ' << scenario.name << " |";
  out << "\n| --- |";
  for (std::size_t i = 0; i < series.scenarios.size(); ++i) out << " ---: |";
  out << '\n';
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    out << "| " << kinds[k].title << " |";
    for (const ScenarioResult& scenario : series.scenarios) {
      const Measurement& m = scenario.methods[k];
      out << text(" %.1f |", median(m.update_ms) + median(m.query_ms));
    }
    out << '\n';
  }
  writeLeads(out, series, kinds);
  out.flush();
}

void writeJson(const std::string& path, const std::vector<Series>& all,
               const std::vector<MethodKind>& kinds) {
  nlohmann::json root = nlohmann::json::array();
  for (const Series& series : all) {
    nlohmann::json s = {
        {"resolution", series.resolution}, {"stride", series.stride}, {"aligned", series.aligned}};
    for (const ScenarioResult& scenario : series.scenarios) {
      nlohmann::json entry = {{"name", scenario.name},
                              {"frames", scenario.frames},
                              {"triangles", scenario.triangles},
                              {"touching_frames", scenario.touching_frames},
                              {"oracle", "quadruple precision"}};
      for (std::size_t k = 0; k < kinds.size(); ++k) {
        const Measurement& m = scenario.methods[k];
        entry["methods"].push_back({{"key", kinds[k].key},
                                    {"title", kinds[k].title},
                                    {"update_ms", m.update_ms},
                                    {"query_ms", m.query_ms},
                                    {"frame_ms", m.frame_ms},
                                    {"bv_tests", m.work.bv_tests},
                                    {"leaf_tests", m.work.leaf_tests},
                                    {"refitted", m.work.refitted},
                                    {"wrong_frames", m.wrong_frames},
                                    {"worst_error", m.worst_error},
                                    {"bytes_per_triangle", m.bytes_per_triangle}});
      }
      s["scenarios"].push_back(entry);
    }
    root.push_back(s);
  }
  opened(path) << root.dump(1) << '\n';
}

void writeCsv(const std::string& path, const std::vector<Series>& all,
              const std::vector<MethodKind>& kinds) {
  std::ofstream out = opened(path);
  out << "resolution,stride,aligned,scenario,frames,triangles,method,update_ms,query_ms,bv_tests,"
         "leaf_tests,refitted,wrong_frames,worst_error,bytes_per_triangle\n";
  for (const Series& series : all)
    for (const ScenarioResult& scenario : series.scenarios)
      for (std::size_t k = 0; k < kinds.size(); ++k) {
        const Measurement& m = scenario.methods[k];
        out << series.resolution << ',' << series.stride << ',' << series.aligned << ','
            << scenario.name << ',' << scenario.frames << ',' << scenario.triangles << ','
            << kinds[k].key << ',' << median(m.update_ms) << ',' << median(m.query_ms) << ','
            << m.work.bv_tests << ',' << m.work.leaf_tests << ',' << m.work.refitted << ','
            << m.wrong_frames << ',' << m.worst_error << ',' << m.bytes_per_triangle << '\n';
      }
}

}  // namespace adaptive_bvh_bench
