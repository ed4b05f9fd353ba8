// Trials of moving objects on random worlds: boxes, velocities and ids against the simulated truth.
// Observed vehicles have at least ten points within 40 m and are faster than 0.5 m/s. One is found
// if an object lies nearer to its true centre, at the mean time of its points, than half its
// length, and near if within 0.5 m. Worlds with fewer than 20 observations decide nothing and are
// left out.
//   object_trials [FROM [WORLDS [SCANS]]]
// Prints a row for each world and kind of verdict, then all of them.

#include "support/drive_of.hpp"
#include "support/simulated_runs.hpp"

using namespace dynains;

namespace {

/// A vehicle in one scan.
struct Vehicle {
  std::uint32_t instance;
  Eigen::Vector2d centre, velocity;  // m, m/s
  double length;
  double age;  // s since it was first observed
};

struct Truth {
  std::vector<Vehicle> vehicles;
  std::vector<simulation::ObjectState> all;  // that move, of any kind and size
};

struct Counts {
  int observed = 0, found = 0, near = 0, timed = 0, fast = 0, pairs = 0, switches = 0;
  int listed = 0, false_ones = 0, doubles = 0;
};

constexpr double kRange = 40.0;  // m
constexpr int kMinPoints = 10;

bool is_vehicle(std::uint32_t label) { return label == 252 || (label >= 256 && label <= 259); }

/// Truth of each scan.
std::vector<Truth> truth_of(const std::vector<simulation::SimulatedScan>& scans) {
  std::vector<Truth> result(scans.size());
  std::map<std::uint32_t, double> first_seen;
  for (std::size_t i = 1; i + 1 < scans.size(); ++i) {
    std::map<std::uint32_t, int> points;
    std::map<std::uint32_t, double> offsets;  // s, sums
    for (std::size_t p = 0; p < scans[i].labels.size(); ++p) {
      const std::uint32_t instance = test::instance_of(scans[i].labels[p]);
      ++points[instance];
      if (!scans[i].times.empty()) offsets[instance] += static_cast<double>(scans[i].times[p]);
    }
    const auto state_of = [&](std::size_t scan, std::uint32_t instance) {
      const auto& objects = scans[scan].objects;
      return std::find_if(objects.begin(), objects.end(),
                          [&](const auto& object) { return object.instance == instance; });
    };
    for (const simulation::ObjectState& object : scans[i].objects) {
      if (object.label > 251) result[i].all.push_back(object);
      const auto before = state_of(i - 1, object.instance),
                 after = state_of(i + 1, object.instance);
      if (before == scans[i - 1].objects.end() || after == scans[i + 1].objects.end()) continue;
      const Eigen::Vector2d centre = object.T_world_object.translation().head<2>();
      const double range = (centre - scans[i].T_world_sensor.translation().head<2>()).norm();
      if (!is_vehicle(object.label) || range > kRange || points[object.instance] < kMinPoints)
        continue;
      const double seen = first_seen.emplace(object.instance, scans[i].time).first->second;
      const Eigen::Vector2d velocity =
          (after->T_world_object.translation() - before->T_world_object.translation()).head<2>() /
          (scans[i + 1].time - scans[i - 1].time);
      if (velocity.norm() < 0.5) continue;
      const double offset = offsets[object.instance] / points[object.instance];
      result[i].vehicles.push_back({object.instance, centre + offset * velocity, velocity,
                                    object.length, scans[i].time - seen});
    }
  }
  return result;
}

/// Moves the points into the frame of the sensor at the time of the scan.
void deskew(std::vector<simulation::SimulatedScan>& scans) {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    simulation::SimulatedScan& scan = scans[i];
    const std::size_t from = std::min(i, scans.size() - 2);
    const Pose step = Pose(scans[from].T_world_sensor.inverse() * scans[from + 1].T_world_sensor);
    const Eigen::Quaterniond turn(step.linear());
    for (std::size_t p = 0; p < scan.times.size(); ++p) {
      const double share =
          static_cast<double>(scan.times[p]) / (scans[from + 1].time - scans[from].time);
      Eigen::Map<Eigen::Vector3f> point(&scan.xyzi[4 * p]);
      point = (Eigen::Quaterniond::Identity().slerp(share, turn) * point.cast<double>() +
               share * step.translation())
                  .cast<float>();
    }
  }
}

/// The last id of each vehicle.
using Ids = std::map<std::uint32_t, std::uint32_t>;

void count(const Truth& truth, Span<const MovingObject> objects, Ids& ids, Counts& counts) {
  for (const Vehicle& vehicle : truth.vehicles) {
    ++counts.observed;
    const MovingObject* best = nullptr;
    double least = 0.5 * vehicle.length;
    int around = 0;
    for (const MovingObject& object : objects) {
      const double distance = (object.centre.head<2>() - vehicle.centre).norm();
      around += distance < 0.5 * vehicle.length ? 1 : 0;
      if (distance >= least) continue;
      least = distance;
      best = &object;
    }
    if (best == nullptr) continue;
    ++counts.found;
    counts.doubles += around - 1;
    counts.near += least < 0.5 ? 1 : 0;
    if (vehicle.age >= 1.0) {
      ++counts.timed;
      counts.fast += (best->velocity - vehicle.velocity).norm() < 1.0 ? 1 : 0;
    }
    const auto [last, is_first] = ids.emplace(vehicle.instance, best->id);
    if (!is_first) {
      ++counts.pairs;
      counts.switches += last->second != best->id ? 1 : 0;
      last->second = best->id;
    }
  }
  for (const MovingObject& object : objects) {
    ++counts.listed;
    counts.false_ones += std::none_of(truth.all.begin(), truth.all.end(), [&](const auto& other) {
      const Eigen::Vector2d to =
          (other.T_world_object.translation() - object.centre).template head<2>();
      return to.norm() < 0.5 * std::hypot(other.length, other.width) + 0.5;
    });
  }
}

void print(const std::string& name, const Counts& counts) {
  const auto percent = [](int part, int whole) { return whole == 0 ? 0.0 : 100.0 * part / whole; };
  std::cout << std::left << std::setw(34) << name << std::right << std::fixed
            << std::setprecision(1) << " observed " << std::setw(5) << counts.observed << " found "
            << percent(counts.found, counts.observed) << " near "
            << percent(counts.near, counts.observed) << " velocity "
            << percent(counts.fast, counts.timed) << " switches "
            << percent(counts.switches, counts.pairs) << " false "
            << percent(counts.false_ones, counts.listed) << " double "
            << percent(counts.doubles, counts.found) << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int k, std::uint64_t usual) {
    return argc > k ? std::strtoull(argv[k], nullptr, 10) : usual;
  };
  const std::uint64_t from = number(1, 1), worlds = number(2, 8);
  constexpr std::array<const char*, 2> kNames = {"newest", "final"};
  std::array<Counts, 2> sums;
  for (std::uint64_t seed = from; seed < from + worlds; ++seed) {
    simulation::Config world = simulation::random_world(seed);
    world.scans = static_cast<int>(number(3, 60));
    if (world.rolling_shutter) world.deskewed = 0.0;  // with times of the points
    std::vector<simulation::SimulatedScan> scans = test::simulate(world);
    deskew(scans);
    const std::vector<Truth> truth = truth_of(scans);
    std::size_t observations = 0;
    for (const Truth& scan : truth) observations += scan.vehicles.size();
    if (observations < 20) continue;

    DynaInsRemover::Config config;
    config.build_map = false;
    config.objects = true;
    DynaInsRemover remover(config);
    std::array<Counts, 2> counts;
    std::array<Ids, 2> ids, ids_for_sums;
    const auto take = [&](const ScanVerdict& verdict, std::size_t kind) {
      count(truth[verdict.scan], verdict.objects, ids[kind], counts[kind]);
      count(truth[verdict.scan], verdict.objects, ids_for_sums[kind], sums[kind]);
    };
    test::push_all(
        remover, scans, [&](const FrameResult& frame) { take(frame.newest(), 0); },
        [&](const ScanVerdict& verdict) { take(verdict, 1); });
    for (std::size_t kind = 0; kind < 2; ++kind) {
      print(std::to_string(seed) + ' ' + plain_value(world.scene) + ' ' +
                plain_value(world.sensor) + ' ' + kNames[kind],
            counts[kind]);
    }
  }
  for (std::size_t kind = 0; kind < 2; ++kind) print(kNames[kind], sums[kind]);
}
