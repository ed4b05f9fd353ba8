// Trials of a map of many sessions: simulated days of one place, as a table in Markdown; see
// docs/scale.md. `city_trials DAYS SEEDS SCANS SENSOR...`.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dynains/dyna_ins_remover.hpp"
#include "dynains/io/city.hpp"
#include "dynains/io/city_map.hpp"
#include "dynains/io/session_writer.hpp"
#include "dynains/remover.hpp"
#include "dynains/simulation/simulator.hpp"

using namespace dynains;
namespace fs = std::filesystem;

namespace {

std::uint32_t instance_of(std::uint32_t label) { return label >> 16U; }
bool is_moving(std::uint32_t label) { return (label & 0xFFFFU) >= 252 && (label & 0xFFFFU) <= 259; }

PointBuffer points_of(const simulation::SimulatedScan& scan) {
  PointBuffer points;
  points.resize(scan.labels.size());
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    points.x[i] = scan.xyzi[4 * i];
    points.y[i] = scan.xyzi[4 * i + 1];
    points.z[i] = scan.xyzi[4 * i + 2];
  }
  return points;
}

/// Runs over one day and adds it to the city. Returns the changes of the place that stand there.
std::set<std::uint32_t> add_day(const City& city, const simulation::Config& config,
                                SessionPoints& everything) {
  simulation::Simulator simulator(config);
  DynaInsRemover remover(DynaInsRemover::Config::offline());
  SessionInfo info;
  info.name = "day" + std::to_string(config.day);
  info.begin = config.day;
  SessionWriter writer(city, info);
  std::set<std::uint32_t> changes;
  std::deque<simulation::SimulatedScan> open;
  const auto take_final = [&](const ScanVerdict& verdict) {
    const simulation::SimulatedScan scan = std::move(open.front());
    open.pop_front();
    const auto number = static_cast<std::uint32_t>(verdict.scan);
    const PointBuffer points = points_of(scan);
    writer.add(points, verdict.labels, scan.labels, scan.T_world_sensor, number);
    std::vector<PointLabel> all(verdict.labels.begin(), verdict.labels.end());
    for (PointLabel& label : all) {
      if (label == PointLabel::kDynamic) label = PointLabel::kStatic;
    }
    everything.add(points, all, scan.labels, scan.T_world_sensor, number);
  };
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    open.push_back(simulator.scan(i));
    const simulation::SimulatedScan& scan = open.back();
    for (const simulation::ObjectState& object : scan.objects) {
      if (object.instance >= simulation::kFirstChange) changes.insert(object.instance);
    }
    const RawPoints<float> points{scan.xyzi.data(), scan.labels.size(), 4};
    const FrameResult frame = remover.push(points, scan.T_world_sensor, scan.time);
    if (frame.finished) take_final(*frame.finished);
  }
  remover.flush(take_final);
  writer.commit();
  return changes;
}

struct Count {
  std::size_t kept = 0, of = 0;

  void add(bool is_kept) {
    kept += is_kept ? 1 : 0;
    ++of;
  }
  double percent() const {
    return of == 0 ? 0.0 : 100.0 * static_cast<double>(kept) / static_cast<double>(of);
  }
};

struct Result {
  Count fixed;          ///< points of the static world that sessions brought: their voxel stands
  Count gone_near;      ///< of gone_brought: earlier sessions, near the way of a later session
  Count gone_brought;   ///< points that sessions brought of objects that are gone: they stand
  Count gone_measured;  ///< points that sessions measured of objects that are gone: they stand
  Count added;          ///< points of `diff`, added: of an object
  Count removed;        ///< points of `diff`, removed: of an object
  Count changes;        ///< changes between the first and the last day: found by `diff`
};

/// Whether a point of a session is of an object that is not there at the end.
bool is_gone(std::uint32_t label, bool is_last, const std::set<std::uint32_t>& at_end) {
  if (instance_of(label) == 0) return false;
  if (instance_of(label) >= simulation::kFirstChange) return at_end.count(instance_of(label)) == 0;
  return !is_last || is_moving(label);
}

constexpr double kNear = 40.0;  // m

/// Positions of the references of all sessions.
std::vector<std::vector<Eigen::Vector3d>> ways_of(const City& city, const CityMap& map) {
  std::vector<std::vector<Eigen::Vector3d>> ways;
  for (const SessionInfo& session : map.sessions()) {
    ways.emplace_back();
    const SessionReferenceReader reader(city, session);
    for (const auto& entry : reader.entries()) ways.back().push_back(entry.sensor);
  }
  return ways;
}

void judge_map(const City& city, const std::vector<std::size_t>& measured,
               const std::set<std::uint32_t>& at_end, Result& result) {
  const CityMap map(city);
  const auto last = static_cast<std::uint32_t>(map.sessions().size() - 1);
  const std::vector<std::vector<Eigen::Vector3d>> ways = ways_of(city, map);
  const auto is_near_later_way = [&](const Eigen::Vector3d& position, std::size_t session) {
    for (std::size_t later = session + 1; later < ways.size(); ++later) {
      for (const Eigen::Vector3d& sensor : ways[later]) {
        if ((sensor - position).head<2>().norm() < kNear) return true;
      }
    }
    return false;
  };
  std::size_t gone = 0;
  for (const TileIndex& tile : map.tiles()) {
    const TileHistory history = map.history(tile);
    VoxelHashTable<> standing;
    std::set<std::pair<std::size_t, std::size_t>> in_map;
    history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
      standing.insert(session_voxel(city.grid(), history.points(session)[i]));
      in_map.insert({session, i});
    });
    for (std::size_t session = 0; session <= last; ++session) {
      for (std::size_t i = 0; i < history.points(session).size(); ++i) {
        const SessionPoint& point = history.points(session)[i];
        if (is_gone(point.label, session == last, at_end)) {
          const bool stands = in_map.count({session, i}) > 0;
          result.gone_brought.add(stands);
          if (is_near_later_way(map.position(tile, point), session)) result.gone_near.add(stands);
          gone += stands ? 1 : 0;
        } else if (instance_of(point.label) == 0) {
          result.fixed.add(standing.find(session_voxel(city.grid(), point)) !=
                           VoxelHashTable<>::kNone);
        }
      }
    }
  }
  result.gone_measured.kept += gone;
  for (const std::size_t count : measured) result.gone_measured.of += count;
}

void judge_diff(const City& city, const std::set<std::uint32_t>& before,
                const std::set<std::uint32_t>& after, Result& result) {
  constexpr std::size_t kFewest = 20;  // points of a change that was found
  const CityMap map(city);
  const auto last = static_cast<std::uint32_t>(map.sessions().size() - 1);
  std::map<std::uint32_t, std::size_t> came, left;
  for (const TileIndex& tile : map.tiles()) {
    const CityChanges changes = map.changes(tile, 0, last);
    for (const CityPoint& p : changes.added) {
      result.added.add(instance_of(p.point.label) != 0);
      ++came[instance_of(p.point.label)];
    }
    for (const CityPoint& p : changes.removed) {
      result.removed.add(instance_of(p.point.label) != 0);
      ++left[instance_of(p.point.label)];
    }
  }
  for (const std::uint32_t change : after) {
    if (before.count(change) == 0) result.changes.add(came[change] >= kFewest);
  }
  for (const std::uint32_t change : before) {
    if (after.count(change) == 0) result.changes.add(left[change] >= kFewest);
  }
}

Result try_days(const fs::path& folder, int days, simulation::Config config) {
  const City city = City::open_or_make(folder, {});
  std::vector<std::set<std::uint32_t>> changes;
  std::vector<SessionPoints> everything;
  for (config.day = 1; config.day <= days; ++config.day) {
    everything.emplace_back(city.grid());
    changes.push_back(add_day(city, config, everything.back()));
  }
  std::vector<std::size_t> measured;
  for (std::size_t i = 0; i < everything.size(); ++i) {
    measured.push_back(0);
    everything[i].for_each_tile([&](const TileIndex&, const std::vector<SessionPoint>& points) {
      for (const SessionPoint& point : points) {
        measured[i] += is_gone(point.label, i + 1 == everything.size(), changes.back()) ? 1 : 0;
      }
    });
  }
  Result result;
  judge_map(city, measured, changes.back(), result);
  judge_diff(city, changes.front(), changes.back(), result);
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const int days = argc > 1 ? std::atoi(argv[1]) : 5;
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 3;
  simulation::Config config;
  config.scans = argc > 3 ? std::atoi(argv[3]) : 150;
  std::vector<std::string> sensors(argv + std::min(argc, 4), argv + argc);
  if (sensors.empty()) sensors = {"hdl64", "vlp16"};
  std::cout << "| sensor | seed | static kept | gone, near | gone, of brought | gone, of measured "
               "| diff added: "
               "objects | diff removed: objects | changes found "
               "|\n|---|---|---|---|---|---|---|---|---|\n"
            << std::fixed << std::setprecision(2);
  for (const std::string& sensor : sensors) {
    config.sensor = simulation::sensor_from_name(sensor);
    for (int seed = 1; seed <= seeds; ++seed) {
      config.seed = static_cast<std::uint64_t>(seed);
      const fs::path folder =
          fs::temp_directory_path() / ("city_trials_" + std::to_string(::getpid()));
      const Result r = try_days(folder, days, config);
      City city(folder);
      for (const SessionInfo& session : city.sessions()) city.drop(session.name);
      fs::remove(folder / "city.json");
      fs::remove(folder);
      std::cout << "| " << sensor << " | " << seed << " | " << r.fixed.percent() << " % | "
                << r.gone_near.percent() << " % of " << r.gone_near.of << " | "
                << r.gone_brought.percent() << " % of " << r.gone_brought.of << " | "
                << r.gone_measured.percent() << " % of " << r.gone_measured.of << " | "
                << r.added.percent() << " % of " << r.added.of << " | " << r.removed.percent()
                << " % of " << r.removed.of << " | " << r.changes.kept << " of " << r.changes.of
                << " |" << std::endl;
    }
  }
}
