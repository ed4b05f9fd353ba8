#include "run_report.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <locale>

#include "dynains/evaluation/text_table.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/version.hpp"

namespace dynains::program {
namespace {

nlohmann::ordered_json to_json(std::vector<double> values) {
  const Statistics s = statistics(std::move(values));
  return {{"median", s.median}, {"p95", s.p95}, {"p99", s.p99}, {"max", s.max}};
}

nlohmann::ordered_json times_to_json(const RunTiming& timing) {
  nlohmann::ordered_json json;
  const auto column = [&](auto&& value_of) {
    std::vector<double> values;
    for (const TimingRow& row : timing.rows) values.push_back(value_of(row));
    return to_json(std::move(values));
  };
  for (std::size_t stage = 0; stage < timing.stages.size(); ++stage) {
    json[timing.stages[stage]] = column([&](const TimingRow& row) { return row.stages[stage]; });
  }
  json["total"] = column([](const TimingRow& row) { return row.total; });
  return json;
}

nlohmann::ordered_json pose_residual_to_json(const RunTiming& timing) {
  std::vector<double> metres, degrees;
  for (const TimingRow& row : timing.rows) {
    if (!row.pose_residual) continue;
    metres.push_back(row.pose_residual->translation);
    degrees.push_back(row.pose_residual->rotation);
  }
  if (metres.empty()) return nullptr;
  return {{"metres", to_json(std::move(metres))}, {"degrees", to_json(std::move(degrees))}};
}

}  // namespace

Statistics statistics(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[std::max<std::size_t>(static_cast<std::size_t>(rank), 1) - 1];
  };
  return {quantile(0.5), quantile(0.95), quantile(0.99), values.back()};
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr std::uint64_t kUnit = 1024;  // Linux counts kilobytes
  return static_cast<std::uint64_t>(usage.ru_maxrss) * kUnit;
}

WallTime wall_time(double ms, const RunTiming& timing) {
  if (!(ms > 0.0)) return {ms, 0.0};
  return {ms, std::clamp(1.0 - timing.pipeline / ms, 0.0, 1.0)};
}

nlohmann::ordered_json make_report(const RunDescription& run, const RunResults& results,
                                   const RunTiming& timing) {
  const LabelCounts& labels = results.labels();
  nlohmann::ordered_json report = begin_marker(run_output_kind());
  report["static_map"] = nullptr;
  if (!run.map.empty()) report["static_map"] = {{"file", run.map}};
  report["sequence"] = run.sequence;
  report["sequence_flags"] = run.sequence_flags;
  report["first_scan"] = run.first_scan;
  report["last_scan"] = run.last_scan;
  report["scans"] = results.finished();
  report["scans_without_pose"] = run.missing_poses;
  report["log_ends_early"] = run.log_ends_early;
  report["points"] = results.points();
  report["labels"] = {{"invalid", labels[PointLabel::kInvalid]},
                      {"out_of_range", labels[PointLabel::kOutOfRange]},
                      {"ground", labels[PointLabel::kGround]},
                      {"static", labels[PointLabel::kStatic]},
                      {"dynamic", labels[PointLabel::kDynamic]}};
  if (results.map_points()) report["static_map"]["points"] = *results.map_points();
  report["milliseconds"] = times_to_json(timing);
  report["flush_milliseconds"] = timing.flush;
  report["wall_milliseconds"] = run.wall.ms;
  report["share_outside_pipeline"] = run.wall.outside;
  report["peak_memory_bytes"] = peak_memory_bytes();
  report["pose_agreement"] = nullptr;
  if (run.agreement.points > 0) report["pose_agreement"] = run.agreement.share;
  report["pose_residual"] = pose_residual_to_json(timing);
  report["doubts"] = run.doubts;
  report["preset"] = run.preset;
  report["configuration"] = run.configuration;
  return report;
}

const OutputKind& run_output_kind() {
  static const OutputKind kind = {"run", "report.json"};
  return kind;
}

void write_timing(const std::filesystem::path& path, const RunTiming& timing) {
  AtomicFile file(path);
  std::ostream& out = file.stream();
  out.imbue(std::locale::classic());
  out << std::fixed << std::setprecision(4) << "scan,points";
  for (const std::string& stage : timing.stages) out << ',' << stage << "_ms";
  out << ",total_ms,pose_residual_m,pose_residual_deg,time_s\n";
  for (const TimingRow& row : timing.rows) {
    out << evaluation::csv_field(row.scan) << ',' << row.points;
    for (const double ms : row.stages) out << ',' << ms;
    out << ',' << row.total << ',';
    if (row.pose_residual) out << row.pose_residual->translation;
    out << ',';
    if (row.pose_residual) out << row.pose_residual->rotation;
    out << ',' << std::setprecision(9) << row.time << std::setprecision(4) << '\n';
  }
  file.commit();
}

}  // namespace dynains::program
