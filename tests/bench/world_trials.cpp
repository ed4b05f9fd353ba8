// Trials of the remover on random worlds, in process: each world is simulated, judged and scored.
// A setting is a list of parameters of the remover, `name=value,name=value`; `default` changes
// none. All settings judge the same scans.
//   world_trials [--from SEED] [--worlds N] [--scans N] [--world scene=room,...] [SETTING...]
#include <CLI/CLI.hpp>

#include "dynains/errors.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "program/parameter_flags.hpp"
#include "support/simulated_runs.hpp"

using namespace dynains;

namespace {

using Scans = std::vector<simulation::SimulatedScan>;

struct Options {
  std::uint64_t from = 1;
  std::uint64_t worlds = 10;
  int scans = 60;
  std::string world = "default";  ///< parameters that are not drawn, such as "scene=room"
  bool rigs = false;
  std::vector<std::string> settings;
};

/// The parameters of `list`, such as "tau-contested=0.97,beta=2".
run::ParameterValues values_of(const std::string& list) {
  run::ParameterValues values;
  if (list == "default") return values;
  std::istringstream stream(list);
  for (std::string item; std::getline(stream, item, ',');) {
    const std::size_t equals = item.find('=');
    if (equals == std::string::npos) {
      throw ConfigError("\"" + item + "\": expected name=value");
    }
    const std::string name = run::flag_name(item.substr(0, equals));
    values.set(name, item.substr(equals + 1), name);
  }
  return values;
}

/// A robot has its own rig, a vehicle one of the others. Scans of rigs are whole.
void add_rig(simulation::Config& config) {
  using simulation::Rig;
  constexpr Rig kOfVehicles[] = {Rig::kRoofTwo, Rig::kRoofThree, Rig::kCorners};
  const bool is_robot = config.sensor_height > 0.0 && config.sensor_height < 1.2;
  config.rig = is_robot ? Rig::kRobot : kOfVehicles[config.seed % 3];
  config.rolling_shutter = false;
}

simulation::Config world_of(std::uint64_t seed, const Options& options) {
  simulation::Config config = simulation::random_world(seed);
  if (options.rigs) add_rig(config);
  values_of(options.world).apply(config);
  config.scans = options.scans;
  return config;
}

std::string name_of(const simulation::Config& config) {
  std::ostringstream text;
  text << config.seed << ' ' << plain_value(config.scene) << ' ' << plain_value(config.sensor)
       << ' ' << plain_value(config.gait) << std::setprecision(2) << ' ' << config.sensor_height
       << "m " << config.ego_speed << "m/s " << config.rate << "Hz";
  if (config.rig != simulation::Rig::kNone) text << ' ' << plain_value(config.rig);
  return text.str();
}

/// For each scan and point, a bit of each setting is set if the point is static.
using InMap = test::StaticPoints;

/// Sets the bits of `in_map`.
void judge(const Scans& scans, const DynaInsRemover::Config& config, unsigned bit, InMap& in_map) {
  const auto keep = [&](const ScanVerdict& verdict) {
    std::vector<std::uint8_t>& bits = in_map.at(verdict.scan);
    for (std::size_t i = 0; i < bits.size(); ++i) {
      if (is_static(verdict.labels[i])) bits[i] |= static_cast<std::uint8_t>(1U << bit);
    }
  };
  DynaInsRemover remover(config);
  for (const simulation::SimulatedScan& scan : scans) {
    const FrameResult frame =
        remover.push(test::points_of(scan), scan.T_world_sensor_noisy, scan.time);
    if (frame.finished) keep(*frame.finished);
  }
  remover.flush(keep);
}

/// Scores of one setting in one world; NaN where a world has none. More is better.
using Scores = std::vector<double>;

const std::vector<std::string> kScoreNames = {"F1", "SA", "DA", "objects"};

Scores scores_of(const evaluation::EvaluationRow& row) {
  return {100 * row.voxels.f1(), row.points.kept(), row.points.removed(), row.objects->kept()};
}

void print_row(const std::string& name, const Scores& scores) {
  std::cout << "| " << name << " |" << std::fixed << std::setprecision(2);
  for (const double score : scores) {
    if (std::isfinite(score)) {
      std::cout << ' ' << score << " |";
    } else {
      std::cout << " - |";
    }
  }
  std::cout << std::endl;
}

void print_header(const std::string& first) {
  std::cout << "| " << first << " |";
  for (const std::string& name : kScoreNames) std::cout << ' ' << name << " |";
  std::cout << "\n|---|";
  for (std::size_t i = 0; i < kScoreNames.size(); ++i) std::cout << "---:|";
  std::cout << std::endl;
}

/// Worst decile and mean over the worlds that have the score.
void print_summary(const std::string& setting, const std::vector<Scores>& worlds) {
  Scores decile, mean;
  for (std::size_t k = 0; k < kScoreNames.size(); ++k) {
    std::vector<double> values;
    for (const Scores& scores : worlds) {
      if (std::isfinite(scores[k])) values.push_back(scores[k]);
    }
    std::sort(values.begin(), values.end());
    double sum = 0;
    for (const double value : values) sum += value;
    const std::size_t tenth = values.empty() ? 0 : (values.size() - 1) / 10;
    decile.push_back(values.empty() ? std::nan("") : values[tenth]);
    mean.push_back(sum / static_cast<double>(values.size()));
  }
  print_row(setting + ", worst decile", decile);
  print_row(setting + ", mean", mean);
}

Options parse(int argc, char** argv) {
  Options options;
  CLI::App app("Trials of the remover on random worlds");
  app.add_option("--from", options.from, "first seed [1]");
  app.add_option("--worlds", options.worlds, "number of seeds [10]");
  app.add_option("--scans", options.scans, "scans of each world [60]");
  app.add_flag("--rigs", options.rigs, "several sensors in each world");
  app.add_option("--world", options.world, "name=value,...: parameters that are not drawn");
  app.add_option("SETTING", options.settings, "name=value,...: parameters of the remover");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));
  }
  if (options.settings.empty()) options.settings = {"default"};
  return options;
}

void run_trials(const Options& options) {
  const std::vector<std::string>& settings = options.settings;
  std::vector<DynaInsRemover::Config> configs(settings.size());
  for (std::size_t s = 0; s < settings.size(); ++s) values_of(settings[s]).apply(configs[s]);
  std::map<std::string, std::vector<Scores>> worlds;
  print_header("world");
  for (std::uint64_t seed = options.from; seed < options.from + options.worlds; ++seed) {
    const simulation::Config world = world_of(seed, options);
    const Scans scans = test::simulate(world);
    const std::vector<Pose> mounts = simulation::Simulator(world).mounts();
    InMap in_map;
    for (const auto& scan : scans) in_map.emplace_back(scan.labels.size(), std::uint8_t{0});
    for (std::size_t s = 0; s < settings.size(); ++s) {
      if (!mounts.empty()) configs[s].sensors = mounts;
      judge(scans, configs[s], static_cast<unsigned>(s), in_map);
    }
    const evaluation::Evaluation result = test::evaluate(scans, in_map, settings, mounts);
    for (std::size_t s = 0; s < settings.size(); ++s) {
      const Scores scores = scores_of(result.rows[2 + s]);
      print_row(settings.size() == 1 ? name_of(world) : name_of(world) + ": " + settings[s],
                scores);
      worlds[settings[s]].push_back(scores);
    }
  }
  std::cout << '\n';
  print_header("over " + std::to_string(options.worlds) + " worlds");
  for (const std::string& setting : settings) print_summary(setting, worlds[setting]);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run_trials(parse(argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "world_trials: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
