// Trials of a map of many sessions: simulated days of one place, as a table in Markdown; see
// docs/scale.md. `city_trials DAYS SEED SEEDS SCANS SENSOR...`; SEED is the first one.
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/city_map.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/compiled_remover.hpp"
#include "dynains/simulation/simulator.hpp"

using namespace dynains;
namespace fs = std::filesystem;

namespace {

std::uint32_t instance_of(std::uint32_t label) { return label >> 16U; }

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

/// Where the objects were whose points a day measured, up to the range of contributions. Labels do
/// not tell this: they call a car moving that drove off out of sight.
class MeasuredObjects {
 public:
  void add(const simulation::SimulatedScan& scan, std::uint32_t number) {
    constexpr float kRange = static_cast<float>(SessionConfig().contribution_range);
    std::set<std::uint32_t> measured;
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      const Eigen::Map<const Eigen::Vector3f> point(&scan.xyzi[4 * i]);
      if (instance_of(scan.labels[i]) != 0 && point.norm() <= kRange) {
        measured.insert(instance_of(scan.labels[i]));
      }
    }
    for (const simulation::ObjectState& object : scan.objects) {
      if (measured.count(object.instance) == 0) continue;
      places_[object.instance].push_back({number, object.T_world_object.translation().head<2>()});
    }
  }

  /// Whether an object was measured at different places.
  bool moved(std::uint32_t label) const {
    const std::vector<Place>* const places = places_of(label);
    return places != nullptr &&
           std::any_of(places->begin(), places->end(),
                       [&](const Place& place) { return is_far(place, places->front()); });
  }

  /// Whether an object stood where it was in scan `scan` until it was measured for the last time:
  /// it did not move, or it stopped by then and stood for kLeastStand scans.
  bool stood_to_the_end(std::uint32_t label, std::uint32_t scan) const {
    if (!moved(label)) return true;
    const std::vector<Place>& places = *places_of(label);
    const Place& last = places.back();
    const auto stopped = std::find_if(places.rbegin(), places.rend(), [&](const Place& place) {
                           return is_far(place, last);
                         }).base();
    return scan >= stopped->scan && last.scan - stopped->scan >= kLeastStand;
  }

 private:
  static constexpr double kMovedWay = 0.5;          // m
  static constexpr std::uint32_t kLeastStand = 30;  // scans: 3 s

  struct Place {
    std::uint32_t scan;
    Eigen::Vector2d at;  // m
  };

  static bool is_far(const Place& a, const Place& b) { return (a.at - b.at).norm() > kMovedWay; }
  const std::vector<Place>* places_of(std::uint32_t label) const {
    const auto found = places_.find(instance_of(label));
    return found == places_.end() ? nullptr : &found->second;
  }

  std::map<std::uint32_t, std::vector<Place>> places_;  // by instance, in the order of the scans
};

/// One simulated day.
struct Day {
  std::unique_ptr<MemoryStore> store;
  SessionPoints near;  ///< static and moving points, up to the range of contributions
  SessionPoints all;
  std::set<std::uint32_t> changes = {};  ///< changes of the place that stand there
  MeasuredObjects objects = {};
};

/// Runs over one day and adds it to the city.
void add_day(const City& city, const simulation::Config& config, Day& day) {
  simulation::Simulator simulator(config);
  DynaInsRemover remover(DynaInsRemover::Config::offline());
  SessionInfo info;
  info.name = "day" + std::to_string(config.day);
  info.begin = config.day;
  MemoryStore store;
  SessionWriter writer(city, info, store);
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
    day.near.add(points, all, scan.labels, scan.T_world_sensor, number);
    day.all.add(points, all, scan.labels, scan.T_world_sensor, number);
  };
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    open.push_back(simulator.scan(i));
    const simulation::SimulatedScan& scan = open.back();
    for (const simulation::ObjectState& object : scan.objects) {
      if (object.instance >= simulation::kFirstChange) day.changes.insert(object.instance);
    }
    day.objects.add(scan, static_cast<std::uint32_t>(i));
    const RawPoints<float> points{scan.xyzi.data(), scan.labels.size(), 4};
    const FrameResult frame = remover.push(points, scan.T_world_sensor, scan.time);
    if (frame.finished) take_final(*frame.finished);
  }
  remover.flush(take_final);
  writer.commit();
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
  Count fixed;      ///< points of the static world that sessions brought: their voxel stands
  Count fixed_far;  ///< voxels of the static world measured at any distance: they stand
  Count come;       ///< points brought of objects that stand at the end: their voxel stands
  Count gone_near;  ///< of gone: earlier sessions, near the way of a later session
  Count gone;       ///< measured points of objects that are gone by the last session: they stand
  Count gone_last;  ///< measured points of moving objects of the last session: they stand
  Count added;      ///< clusters of `diff`, added: of an object that has come
  Count removed;    ///< clusters of `diff`, removed: of an object that has left
  Count changes;    ///< changes between the first and the last day: found by `diff`
};

/// Whether a point of a session is of an object that is not there at the end.
bool is_gone(std::uint32_t label, std::size_t session, const std::vector<Day>& days) {
  const std::uint32_t instance = instance_of(label);
  if (instance == 0) return false;
  if (instance >= simulation::kFirstChange) return days.back().changes.count(instance) == 0;
  return session + 1 < days.size() || days.back().objects.moved(label);
}

constexpr double kNear = 40.0;  // m

/// Positions of the references of all sessions.
std::vector<std::vector<Eigen::Vector3d>> ways_of(const CityMap& map) {
  std::vector<std::vector<Eigen::Vector3d>> ways;
  for (const SessionInfo& session : map.sessions()) {
    ways.emplace_back();
    for (const SessionReference& reference : session.references) {
      ways.back().push_back(reference.sensor);
    }
  }
  return ways;
}

void judge_map(const City& city, std::vector<Day>& days, Result& result) {
  const CityMap map(city);
  const auto last = static_cast<std::uint32_t>(map.sessions().size() - 1);
  const std::vector<std::vector<Eigen::Vector3d>> ways = ways_of(map);
  const auto is_near_later_way = [&](const Eigen::Vector3d& position, std::size_t session) {
    for (std::size_t later = session + 1; later < ways.size(); ++later) {
      for (const Eigen::Vector3d& sensor : ways[later]) {
        if ((sensor - position).head<2>().norm() < kNear) return true;
      }
    }
    return false;
  };
  std::map<TileIndex, VoxelHashTable<>> standing_of;
  for (const TileIndex& tile : map.tiles()) {
    const TileHistory history = map.history(tile);
    VoxelHashTable<>& standing = standing_of[tile];
    std::set<std::pair<std::size_t, std::size_t>> in_map;
    history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
      standing.insert(session_voxel(city.grid(), history.points(session)[i]));
      in_map.insert({session, i});
    });
    for (std::size_t session = 0; session <= last; ++session) {
      for (std::size_t i = 0; i < history.points(session).size(); ++i) {
        const SessionPoint& point = history.points(session)[i];
        if (is_gone(point.label, session, days)) {
          const bool stands = in_map.count({session, i}) > 0;
          Count& gone = session == last ? result.gone_last : result.gone;
          gone.kept += stands ? 1 : 0;
          if (is_near_later_way(map.position(tile, point), session)) {
            result.gone_near.kept += stands ? 1 : 0;
          }
          continue;
        }
        (instance_of(point.label) == 0 ? result.fixed : result.come)
            .add(standing.find(session_voxel(city.grid(), point)) != VoxelHashTable<>::kNone);
      }
    }
  }
  std::map<TileIndex, VoxelHashTable<>> seen_of;
  for (std::size_t session = 0; session < days.size(); ++session) {
    const bool is_last = session + 1 == days.size();
    days[session].near.for_each_tile(
        [&](const TileIndex& tile, const std::vector<SessionPoint>& points) {
          for (const SessionPoint& point : points) {
            if (!is_gone(point.label, session, days)) continue;
            ++(is_last ? result.gone_last : result.gone).of;
            if (is_near_later_way(map.position(tile, point), session)) ++result.gone_near.of;
          }
        });
    days[session].all.for_each_tile(
        [&](const TileIndex& tile, const std::vector<SessionPoint>& points) {
          for (const SessionPoint& point : points) {
            if (instance_of(point.label) != 0) continue;
            VoxelHashTable<>& seen = seen_of[tile];
            const VoxelKey voxel = session_voxel(city.grid(), point);
            const std::size_t before = seen.size();
            if (seen.insert(voxel) != before) continue;
            result.fixed_far.add(standing_of[tile].find(voxel) != VoxelHashTable<>::kNone);
          }
        });
  }
}

/// One point of `diff`.
struct DiffPoint {
  Eigen::Vector3d position;  // m
  bool is_of_change;         ///< of an object that stands in one of both maps
};

constexpr double kClusterCell = 0.4;  // m, as find_changes() with the grid of the trials

/// Calls `visit(members)` for the clusters of points in touching cells of kClusterCell.
template <class Visitor>
void for_each_cluster(const std::vector<DiffPoint>& points, Visitor&& visit) {
  VoxelHashTable<> cells;
  std::vector<VoxelKey> keys;
  std::vector<std::vector<std::uint32_t>> members;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d at = points[i].position / kClusterCell;
    const VoxelKey key = voxel_key(static_cast<std::int64_t>(std::floor(at.x())),
                                   static_cast<std::int64_t>(std::floor(at.y())),
                                   static_cast<std::int64_t>(std::floor(at.z())));
    const std::uint32_t cell = cells.insert(key);
    if (cell == keys.size()) {
      keys.push_back(key);
      members.emplace_back();
    }
    members[cell].push_back(i);
  }
  std::vector<bool> is_done(keys.size(), false);
  for (std::uint32_t first = 0; first < keys.size(); ++first) {
    if (is_done[first]) continue;
    is_done[first] = true;
    std::vector<std::uint32_t> open = {first}, cluster;
    while (!open.empty()) {
      const std::uint32_t cell = open.back();
      open.pop_back();
      cluster.insert(cluster.end(), members[cell].begin(), members[cell].end());
      for (int i = 0; i < 27; ++i) {
        const std::uint32_t next =
            cells.find(keys[cell] + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        if (next == VoxelHashTable<>::kNone || is_done[next]) continue;
        is_done[next] = true;
        open.push_back(next);
      }
    }
    visit(cluster);
  }
}

/// Counts the clusters that are larger than 0.5 m; true ones are mostly of objects that stand.
/// A parked car that stands on one of the two days only is a change, like a container. So is a car
/// that stands, or has stopped, for as long as the sensor sees it: nobody has seen it drive off.
void judge_clusters(const std::vector<DiffPoint>& points, Count& count) {
  constexpr double kLeastExtent = 0.5;  // m
  for_each_cluster(points, [&](const std::vector<std::uint32_t>& cluster) {
    Eigen::AlignedBox3d box;
    std::size_t objects = 0;
    for (const std::uint32_t i : cluster) {
      box.extend(points[i].position);
      objects += points[i].is_of_change ? 1 : 0;
    }
    if (box.sizes().maxCoeff() > kLeastExtent) count.add(2 * objects > cluster.size());
  });
}

void judge_diff(const City& city, const std::vector<Day>& days, Result& result) {
  const CityMap map(city);
  const auto last = static_cast<std::uint32_t>(map.sessions().size() - 1);
  struct Share {
    std::size_t changed = 0, of = 0;
  };
  std::map<std::uint32_t, Share> came, left;
  std::vector<DiffPoint> added, removed;
  for (const TileIndex& tile : map.tiles()) {
    const TileHistory history = map.history(tile);
    const auto count = [&](std::uint32_t number, std::map<std::uint32_t, Share>& shares) {
      history.for_each_standing(number, [&](std::size_t session, std::size_t i) {
        ++shares[instance_of(history.points(session)[i].label)].of;
      });
    };
    count(0, left);
    count(last, came);
    const CityChanges changes = find_changes(city.grid(), history, 0, last);
    const auto diff_point = [&](const CityPoint& p) {
      const bool stands = instance_of(p.point.label) != 0 &&
                          days[p.session].objects.stood_to_the_end(p.point.label, p.point.scan);
      return DiffPoint{map.position(tile, p.point), stands};
    };
    for (const CityPoint& p : changes.added) {
      added.push_back(diff_point(p));
      ++came[instance_of(p.point.label)].changed;
    }
    for (const CityPoint& p : changes.removed) {
      removed.push_back(diff_point(p));
      ++left[instance_of(p.point.label)].changed;
    }
  }
  judge_clusters(added, result.added);
  judge_clusters(removed, result.removed);
  const auto judge = [&](const Share& share) {
    result.changes.add(share.changed > 0 && 2 * share.changed >= share.of);
  };
  const std::set<std::uint32_t>&before = days.front().changes, &after = days.back().changes;
  for (const std::uint32_t change : after) {
    if (before.count(change) == 0) judge(came[change]);
  }
  for (const std::uint32_t change : before) {
    if (after.count(change) == 0) judge(left[change]);
  }
}

Result try_days(const fs::path& folder, int days, simulation::Config config) {
  const City city = City::open_or_make(folder, {});
  std::vector<Day> measured;
  for (config.day = 1; config.day <= days; ++config.day) {
    constexpr double kAnyDistance = 300.0;  // m
    auto store = std::make_unique<MemoryStore>();
    SessionPoints near(city.grid(), SessionConfig().contribution_range, *store);
    SessionPoints all(city.grid(), kAnyDistance, *store);
    measured.push_back({std::move(store), std::move(near), std::move(all)});
    add_day(city, config, measured.back());
  }
  Result result;
  judge_map(city, measured, result);
  judge_diff(city, measured, result);
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const int days = argc > 1 ? std::atoi(argv[1]) : 5;
  const int first_seed = argc > 2 ? std::atoi(argv[2]) : 1;
  const int seeds = argc > 3 ? std::atoi(argv[3]) : 3;
  simulation::Config config;
  config.scans = argc > 4 ? std::atoi(argv[4]) : 150;
  std::vector<std::string> sensors(argv + std::min(argc, 5), argv + argc);
  if (sensors.empty()) sensors = {"hdl64", "vlp16"};
  std::cout
      << "| sensor | seed | static kept | static kept of all distances | standing objects kept "
         "| gone, near | gone | moving on the last day | diff added | diff removed | changes "
         "found |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
      << std::fixed << std::setprecision(2);
  const auto print = [](const Count& count) {
    std::cout << " | " << count.percent() << " % of " << count.of;
  };
  for (const std::string& sensor : sensors) {
    config.sensor = value_of_name<simulation::Sensor>(sensor).value();
    for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
      config.seed = static_cast<std::uint64_t>(seed);
      const fs::path folder =
          fs::temp_directory_path() / ("city_trials_" + std::to_string(::getpid()));
      const Result r = try_days(folder, days, config);
      City city(folder);
      for (const SessionInfo& session : city.sessions()) city.drop(session.name);
      fs::remove(folder);
      std::cout << "| " << sensor << " | " << seed;
      for (const Count& count : {r.fixed, r.fixed_far, r.come, r.gone_near, r.gone, r.gone_last}) {
        print(count);
      }
      for (const Count& count : {r.added, r.removed, r.changes}) {
        std::cout << " | " << count.kept << " of " << count.of;
      }
      std::cout << " |" << std::endl;
    }
  }
}
