#include "dynains/compiled_remover.hpp"
#include "dynains/parameters.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

struct Field {
  std::string section;
  std::string name;
  std::string help;
  Bounds bounds;
  double value;
  bool is_number;
  bool is_integer;
};

std::vector<Field> fields_of(const Config& config) {
  std::vector<Field> result;
  Config::visit_sections(config, [&](const char* section, const auto& part) {
    using Part = std::remove_const_t<std::remove_reference_t<decltype(part)>>;
    Part::visit(part, [&](const auto& parameter) {
      using Value = std::remove_const_t<std::remove_reference_t<decltype(parameter.value)>>;
      result.push_back({section, parameter.name, parameter.help, parameter.bounds,
                        static_cast<double>(parameter.value), kIsBounded<Value>,
                        std::is_integral_v<Value>});
    });
  });
  return result;
}

Config with(const std::string& name, double value) {
  Config config = Config::paper();
  Config::visit(config, [&](const auto& parameter) {
    using Value = std::remove_reference_t<decltype(parameter.value)>;
    if (parameter.name == name) parameter.value = static_cast<Value>(value);
  });
  return config;
}

std::string error_of(const Config& config) {
  try {
    config.validate();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST_CASE("the paper's configuration has the published parameters") {
  const Config config = Config::paper();
  CHECK(config.decision == Decision::kWindow);
  CHECK(config.window == 4);
  CHECK(config.use_belief);
  CHECK(config.descriptor.tau_s == 0.6);
  CHECK(config.belief.p_inc == 0.7);
  CHECK(config.belief.p_dec == 0.4);
  CHECK(config.belief.tau_rho == 0.8);
  CHECK(config.belief.tau_p == 0.5);
  CHECK(config.belief.prior == 0.5);
  CHECK(config.clusterer.voxel_range == 0.5);
  CHECK(config.clusterer.voxel_azimuth == 0.5);
  CHECK(config.clusterer.voxel_elevation == 3.0);
  CHECK(config.descriptor.cell_range == 0.25);
  CHECK(config.descriptor.cell_azimuth == 1.5);
  CHECK(config.min_range == 2.7);
  REQUIRE(config.sensors.size() == 1);
  CHECK(config.sensors[0].matrix().isIdentity(0.0));
  CHECK(config.map.map_voxel == 0.2);
}

TEST_CASE("the configuration of the public implementation is that of the paper but for its rules") {
  const Config config = Config::published();
  CHECK_NOTHROW(config.validate());
  CHECK(config.decision == Decision::kWindow);
  CHECK(config.descriptor.tau_s == 0.6);
  CHECK(config.belief_observations == BeliefObservations::kOthers);
  CHECK(config.compared_clusters == Comparison::kAnyBefore);
  CHECK(config.big_is_static);
  CHECK(config.votes == 0);
  CHECK(config.descriptor.belief_cells == 2.0);
  CHECK(config.descriptor.ignored_low == 0.2);
  CHECK(config.descriptor.bounds_of_ends);
  CHECK(config.belief.vanished_weight == 1.0);
  CHECK(config.ground.ground_fit_points == 1000000);
}

TEST_CASE("cells of a descriptor are bounded, since a cluster may reach all around the sensor") {
  Config config = Config::paper();
  config.descriptor.cell_azimuth = 0.125;  // 2880 sectors, of up to 1 km
  config.descriptor.cell_range = 1000.0 * 2880.0 / (1 << 26) * 1.001;
  CHECK_NOTHROW(config.validate());
  config.descriptor.cell_range *= 0.998;
  CHECK_THAT(error_of(config), StartsWith("OccupancyDescriptor: cell_range = 0.04") &&
                                   ContainsSubstring("at most 67108864"));
}

TEST_CASE("the presets are valid, and the offline one differs by its later scans alone") {
  CHECK_NOTHROW(Config().validate());
  CHECK_NOTHROW(Config::offline().validate());
  CHECK_NOTHROW(Config::odometry().validate());
  CHECK_FALSE(Config::odometry().build_map);
  CHECK(Config::odometry().evidence.pose_tolerance < Config().evidence.pose_tolerance);
  std::set<std::string> differing;
  const auto defaults = fields_of(Config()), offline = fields_of(Config::offline());
  for (std::size_t i = 0; i < defaults.size(); ++i) {
    if (defaults[i].value < offline[i].value) differing.insert(defaults[i].name);
    CHECK(defaults[i].value <= offline[i].value);
  }
  CHECK(differing == std::set<std::string>{"lookahead_scans"});
  CHECK_NOTHROW(Config::paper().validate());
}

TEST_CASE("parameter names are unique, and every parameter is explained") {
  std::set<std::string> names;
  for (const Field& field : fields_of(Config())) {
    INFO(field.section << '.' << field.name);
    CHECK(names.insert(field.name).second);
    CHECK(field.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") ==
          std::string::npos);
    CHECK(field.help.size() > 10);
  }
  CHECK(names.size() > 30);
}

TEST_CASE("an enum beyond its values is refused by field and names") {
  Config config;
  config.decision = static_cast<Decision>(2);
  CHECK_THAT(error_of(config),
             StartsWith("DynaInsRemover.decision = 2 must be window|free_space ("));
}

TEST_CASE("a value out of bounds is refused by field, value and bound") {
  for (const Field& field : fields_of(Config())) {
    if (!field.is_number) continue;
    INFO(field.section << '.' << field.name);
    REQUIRE(std::isfinite(field.bounds.min));
    REQUIRE(std::isfinite(field.bounds.max));
    const double infinity = std::numeric_limits<double>::infinity();
    const double step = field.is_integer ? 1.0 : 0.0;
    const auto past = [&](double bound, bool is_open, double direction) {
      if (is_open) return bound;
      return field.is_integer ? bound + std::copysign(step, direction)
                              : std::nextafter(bound, direction);
    };
    std::vector<double> bad = {past(field.bounds.min, field.bounds.min_open, -infinity),
                               past(field.bounds.max, field.bounds.max_open, infinity)};
    if (!field.is_integer) {
      bad.insert(bad.end(), {std::nan(""), infinity, -infinity});
    }
    for (const double value : bad) {
      const std::string error = error_of(with(field.name, value));
      INFO(value << " gives: " << error);
      CHECK_THAT(error, StartsWith(field.section + "." + field.name + " = "));
      CHECK_THAT(error, ContainsSubstring("must be in " + field.bounds.to_string()));
      if (field.is_integer) {
        CHECK_THAT(error, ContainsSubstring(" = " + std::to_string(static_cast<int>(value))));
      }
      CHECK_THROWS_AS(DynaInsRemover(with(field.name, value)), ConfigError);
    }
    // Values within both bounds give no error for the bounds of this field.
    const double good[] = {
        field.bounds.min_open ? std::nextafter(field.bounds.min, infinity) : field.bounds.min,
        field.bounds.max_open ? std::nextafter(field.bounds.max, -infinity) : field.bounds.max};
    for (const double value : good) {
      const std::string error = error_of(with(field.name, value));
      INFO(value << " gives: " << error);
      CHECK(error.find("must be in " + field.bounds.to_string()) == std::string::npos);
    }
  }
}

TEST_CASE("parameters that contradict each other are refused by name") {
  const auto error = [](auto&& change) {
    Config config = Config::paper();
    change(config);
    return error_of(config);
  };
  CHECK_THAT(error([](Config& c) { c.min_range = c.max_range = 50.0; }),
             ContainsSubstring("min_range = 50") && ContainsSubstring("max_range = 50"));
  const auto just_apart = [](Config& c) {
    c.min_range = 50.0;
    c.max_range = 50.1;
  };
  CHECK(error(just_apart).empty());
  CHECK_THAT(error([](Config& c) { c.votes = 5; }),
             ContainsSubstring("votes = 5") && ContainsSubstring("window = 4"));
  CHECK(error([](Config& c) { c.votes = 4; }).empty());
  CHECK_THAT(
      error([](Config& c) { c.ground.ground_min_range = c.ground.ground_max_range = 40.0; }),
      ContainsSubstring("ground_min_range = 40") && ContainsSubstring("ground_max_range = 40"));
  CHECK_THAT(error([](Config& c) { c.map.map_voxel = 0.004; }),
             ContainsSubstring("map_voxel = 0.004"));
  for (const double voxel : {0.005, 0.0}) {
    CHECK(error([&](Config& c) { c.map.map_voxel = voxel; }).empty());
  }
  const auto too_fine = [](Config& c) {  // more voxels than memory can hold
    c.clusterer.voxel_azimuth = c.clusterer.voxel_range = 0.05;
    c.clusterer.voxel_elevation = 0.1;
  };
  CHECK_THAT(error(too_fine), ContainsSubstring("voxel_range") && ContainsSubstring("cells"));
}

}  // namespace
}  // namespace dynains::test
