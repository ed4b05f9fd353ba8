#include "run_report.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <locale>
#include <map>

#include "dynains/evaluation/evaluate.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/trajectory.hpp"
#include "run_results.hpp"

namespace dynains::run {
namespace {

nlohmann::ordered_json times_to_json(const RunTiming& timing) {
  std::map<std::string, std::vector<double>> columns;
  for (const TimingRow& row : timing.rows) {
    StageTimes::visit(row.stages,
                      [&](const char* stage, double ms) { columns[stage].push_back(ms); });
    columns["total"].push_back(row.total);
  }
  nlohmann::ordered_json json;
  const StageTimes none;
  StageTimes::visit(none, [&](const char* stage, double) {
    json[stage] = statistics(std::move(columns[stage]));
  });
  json["total"] = statistics(std::move(columns["total"]));
  return json;
}

nlohmann::ordered_json pose_residual_to_json(const RunTiming& timing) {
  std::vector<double> metres, degrees;
  for (const TimingRow& row : timing.rows) {
    if (!row.pose_residual) continue;
    metres.push_back(row.pose_residual->first);
    degrees.push_back(row.pose_residual->second);
  }
  if (metres.empty()) return nullptr;
  return {{"metres", statistics(std::move(metres))}, {"degrees", statistics(std::move(degrees))}};
}

/// Highest resident memory of this process so far.
std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts kilobytes
}

}  // namespace

nlohmann::ordered_json statistics(std::vector<double> values) {
  if (values.empty()) values = {0.0};
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[std::max<std::size_t>(static_cast<std::size_t>(rank), 1) - 1];
  };
  return {{"median", quantile(0.5)},
          {"p95", quantile(0.95)},
          {"p99", quantile(0.99)},
          {"max", values.back()}};
}

nlohmann::ordered_json make_report(const RunPlan& plan, const nlohmann::ordered_json& doubts,
                                   const RunResults& results, const RunTiming& timing) {
  const Recording& sequence = plan.sequence;
  const RunSettings& settings = plan.settings;
  const Tally& labels = results.tally();
  nlohmann::ordered_json report = begin_marker(kRunOutput);
  report["static_map"] = nullptr;
  if (results.map_points()) {
    report["static_map"] = {{"file", settings.outputs.map_name()},
                            {"points", *results.map_points()}};
  }
  report["sequence"] = settings.recording;
  report["sequence_flags"] = settings.recording_flags;
  report["first_scan"] = sequence.name(plan.range.first);
  // Without a finished scan: the first one.
  report["last_scan"] =
      sequence.name(plan.range.first + std::max<std::size_t>(results.finished(), 1) - 1);
  report["scans"] = results.finished();
  report["scans_without_pose"] = sequence.missing_pose_count();
  report["log_ends_early"] = sequence.early_end().has_value();
  report["points"] = labels.points;
  for (std::size_t k = 0; k < sequence.sensors().size(); ++k) {
    report["sensors"].push_back(
        {{"pose", extrinsic_text(sequence.sensors()[k])}, {"points", timing.sensor_points[k]}});
  }
  report["labels"] = {{"invalid", labels[PointLabel::kInvalid]},
                      {"out_of_range", labels[PointLabel::kOutOfRange]},
                      {"ground", labels[PointLabel::kGround]},
                      {"static", labels[PointLabel::kStatic]},
                      {"dynamic", labels[PointLabel::kDynamic]}};
  report["milliseconds"] = times_to_json(timing);
  report["flush_milliseconds"] = timing.flush;
  const double wall = ms_since(settings.started);
  report["wall_milliseconds"] = wall;
  report["share_outside_pipeline"] = std::clamp(1.0 - timing.pipeline / wall, 0.0, 1.0);
  report["peak_memory_bytes"] = peak_memory_bytes();
  report["pose_residual"] = pose_residual_to_json(timing);
  report["doubts"] = doubts;
  report["preset"] = settings.preset;
  report["configuration"] = plan.configuration;
  report["request"] = plan.request;
  return report;
}

void write_timing(const std::filesystem::path& path, const RunTiming& timing) {
  AtomicFile file(path);
  std::ostream& out = file.stream();
  out.imbue(std::locale::classic());
  out << std::fixed << std::setprecision(4) << "scan,points";
  const StageTimes none;
  StageTimes::visit(none, [&](const char* stage, double) { out << ',' << stage << "_ms"; });
  out << ",total_ms,pose_residual_m,pose_residual_deg,time_s\n";
  for (const TimingRow& row : timing.rows) {
    out << evaluation::csv_field(row.scan) << ',' << row.points;
    StageTimes::visit(row.stages, [&](const char*, double ms) { out << ',' << ms; });
    out << ',' << row.total << ',';
    if (row.pose_residual) out << row.pose_residual->first;
    out << ',';
    if (row.pose_residual) out << row.pose_residual->second;
    out << ',' << std::setprecision(9) << row.time << std::setprecision(4) << '\n';
  }
  file.commit();
}

void write_tracks(const std::filesystem::path& path, std::vector<TrackRow>& rows) {
  std::map<std::uint32_t, std::uint64_t> last_scans;
  for (const TrackRow& row : rows) last_scans[row.object.id] = row.object.last_scan;
  AtomicFile file(path);
  std::ostream& out = file.stream();
  out.imbue(std::locale::classic());
  out << std::setprecision(15) << "scan,time";
  const MovingObject none;
  MovingObject::visit(none, [&](const char* name, auto) { out << ',' << name; });
  out << '\n';
  for (TrackRow& row : rows) {
    row.object.last_scan = last_scans[row.object.id];
    out << row.scan << ',' << row.time;
    MovingObject::visit(row.object, [&](const char*, auto number) { out << ',' << number; });
    out << '\n';
  }
  file.commit();
}

}  // namespace dynains::run
