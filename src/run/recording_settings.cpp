#include "recording_settings.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "dynains/errors.hpp"
#include "parameter_values.hpp"

namespace dynains::program {

double read_length_unit(const std::string& text) {
  if (text == "m") return 1.0;
  if (text == "cm") return 0.01;
  if (text == "mm") return 0.001;
  throw ConfigError(text + ": expected m, cm or mm");
}

double read_time_unit(const std::string& text) {
  constexpr std::pair<const char*, double> kUnits[] = {
      {"auto", 0.0}, {"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
  for (const auto& [name, seconds] : kUnits) {
    if (text == name) return seconds;
  }
  const std::optional<double> seconds = parse_value<double>(text);
  if (seconds && *seconds > 0.0 && std::isfinite(*seconds)) return *seconds;
  throw ConfigError(text + ": expected s, ms, us, ns or seconds above 0");
}

const RecordingOptions& RecordingSettings::checked() const {
  if (!options.sensor_origin.isZero(0.0) && !options.sensor_frame.empty()) {
    throw ConfigError("sensor origin and sensor frame exclude each other");
  }
  return options;
}

}  // namespace dynains::program
