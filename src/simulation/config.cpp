#include "dynains/simulation/config.hpp"

namespace dynains::simulation {
namespace {

/// Position of `name` among the names of an enumeration whose values count from 0.
std::size_t position_of(const std::string& name, const std::vector<std::string>& names,
                        const char* what) {
  std::string known;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return i;
    known += (i == 0 ? "" : ", ") + names[i];
  }
  throw ConfigError(std::string("simulation.") + what + " = \"" + name + "\" must be one of " +
                    known);
}

}  // namespace

const std::vector<std::string>& scene_names() {
  static const std::vector<std::string> names{
      "urban",    "highway", "vegetation", "crowd",  "stop-and-go", "canopy", "hill",
      "car-park", "static",  "hall",       "forest", "garage",      "mixed"};
  return names;
}

const std::vector<std::string>& sensor_names() {
  static const std::vector<std::string> names{"hdl64",    "vlp16", "hdl32",   "os1-64", "os0-128",
                                              "pandar64", "livox", "mid-360", "raster", "rings"};
  return names;
}

const std::vector<std::string>& labelling_names() {
  static const std::vector<std::string> names{"ever", "instant"};
  return names;
}

Scene scene_from_name(const std::string& name) {
  return static_cast<Scene>(position_of(name, scene_names(), "scene"));
}

Sensor sensor_from_name(const std::string& name) {
  return static_cast<Sensor>(position_of(name, sensor_names(), "sensor"));
}

Labelling labelling_from_name(const std::string& name) {
  return static_cast<Labelling>(position_of(name, labelling_names(), "labelling"));
}

}  // namespace dynains::simulation
