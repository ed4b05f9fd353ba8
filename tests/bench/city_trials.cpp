// Trials of a map of many sessions: simulated days of one place, as a table in Markdown; see
// docs/scale.md. `city_trials DAYS SEED SEEDS SCANS SENSOR...`; SEED is the first one.
#include <unistd.h>

#include "dynains/city/city.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/compiled_remover.hpp"
#include "support/drive_of.hpp"
#include "support/points.hpp"

using namespace dynains;

namespace {

using test::instance_of;

/// Where the objects were whose points a day measured, up to the range of contributions. Labels do
/// not tell this: they call a car moving that drove off out of sight.
class MeasuredObjects {
 public:
  void add(const simulation::SimulatedScan& scan) {
    std::set<std::uint32_t> measured;
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      const std::uint32_t instance = instance_of(scan.labels[i]);
      if (instance != 0 && test::point_of(scan, i).norm() <= kTestRange) measured.insert(instance);
    }
    for (const simulation::ObjectState& object : scan.objects) {
      if (measured.count(object.instance) == 0) continue;
      places_[object.instance].push_back(object.T_world_object.translation().head<2>());
    }
  }

  /// Whether an object was measured at different places.
  bool moved(std::uint32_t label) const {
    const auto found = places_.find(instance_of(label));
    return found != places_.end() &&
           std::any_of(found->second.begin(), found->second.end(), [&](const auto& place) {
             return (place - found->second.front()).norm() > kMovedWay;
           });
  }

 private:
  static constexpr double kMovedWay = 0.5;  // m

  std::map<std::uint32_t, std::vector<Eigen::Vector2d>> places_;  // m, by instance
};

/// One simulated day.
struct Day {
  std::unique_ptr<ByteStore> store;
  SessionPoints near;  ///< static and moving points, up to the range of contributions
  SessionPoints all;
  std::set<std::uint32_t> changes = {};  ///< changes of the place that stand there
  MeasuredObjects objects = {};
};

/// Runs over one day and adds it to the city.
void add_day(City& city, const simulation::Config& config, Day& day) {
  simulation::Simulator simulator(config);
  DynaInsRemover remover(DynaInsRemover::Config::offline());
  SessionInfo info;
  info.name = "day" + std::to_string(config.day);
  info.begin = config.day;
  SessionWriter writer(city, info);
  std::deque<simulation::SimulatedScan> open;
  const auto take_final = [&](const ScanVerdict& verdict) {
    const simulation::SimulatedScan scan = std::move(open.front());
    open.pop_front();
    const auto number = static_cast<std::uint32_t>(verdict.scan);
    const PointBuffer points = test::buffer_of(scan.xyzi);
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
    day.objects.add(scan);
    const RawPoints<float> points{scan.xyzi.data(), scan.labels.size(), 4};
    const FrameResult frame = remover.push(points, scan.T_world_sensor, scan.time);
    if (frame.finished) take_final(*frame.finished);
  }
  remover.flush(take_final);
  writer.commit();
  city.reload();
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
  Count gone;       ///< measured points of objects that are gone by the last session: they stand
  Count gone_last;  ///< measured points of moving objects of the last session: they stand
};

/// Whether a point of a session is of an object that is not there at the end.
bool is_gone(std::uint32_t label, std::size_t session, const std::vector<Day>& days) {
  const std::uint32_t instance = instance_of(label);
  if (instance == 0) return false;
  if (instance >= simulation::kFirstChange) return days.back().changes.count(instance) == 0;
  return session + 1 < days.size() || days.back().objects.moved(label);
}

void judge_map(const City& city, std::vector<Day>& days, Result& result) {
  const auto last = static_cast<std::uint32_t>(city.sessions().size() - 1);
  std::map<TileIndex, VoxelHashTable<>> standing_of;
  for (const TileIndex& tile : city.tiles()) {
    const TileHistory history = city.history(tile);
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
        } else if (instance_of(point.label) == 0) {
          result.fixed.add(standing.find(session_voxel(city.grid(), point)) != kNoIndex);
        }
      }
    }
  }
  std::map<TileIndex, VoxelHashTable<>> seen_of;
  for (std::size_t session = 0; session < days.size(); ++session) {
    const bool is_last = session + 1 == days.size();
    days[session].near.for_each_tile(
        [&](const TileIndex&, const std::vector<SessionPoint>& points) {
          for (const SessionPoint& point : points) {
            if (is_gone(point.label, session, days)) {
              ++(is_last ? result.gone_last : result.gone).of;
            }
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
            result.fixed_far.add(standing_of[tile].find(voxel) != kNoIndex);
          }
        });
  }
}

Result try_days(const fs::path& folder, int days, simulation::Config config) {
  City city = City::open_or_make(folder, {});
  std::vector<Day> measured;
  for (config.day = 1; config.day <= days; ++config.day) {
    constexpr double kAnyDistance = 300.0;  // m
    auto store = std::make_unique<ByteStore>(fs::temp_directory_path());
    SessionPoints near(city.grid(), kTestRange, *store);
    SessionPoints all(city.grid(), kAnyDistance, *store);
    measured.push_back({std::move(store), std::move(near), std::move(all)});
    add_day(city, config, measured.back());
  }
  Result result;
  judge_map(city, measured, result);
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
  std::cout << "| sensor | seed | static kept | static kept of all distances | gone "
               "| moving on the last day |\n|---|---|---|---|---|---|\n"
            << std::fixed << std::setprecision(2);
  for (const std::string& sensor : sensors) {
    config.sensor = value_of_name<simulation::Sensor>(sensor).value();
    for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
      config.seed = static_cast<std::uint64_t>(seed);
      const fs::path folder =
          fs::temp_directory_path() / ("city_trials_" + std::to_string(::getpid()));
      const Result r = try_days(folder, days, config);
      fs::remove_all(folder);
      std::cout << "| " << sensor << " | " << seed;
      for (const Count& count : {r.fixed, r.fixed_far, r.gone, r.gone_last}) {
        std::cout << " | " << count.percent() << " % of " << count.of;
      }
      std::cout << " |" << std::endl;
    }
  }
}
