#include "recording_settings.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "dynains/errors.hpp"
#include "io/byte_reader.hpp"
#include "parameter_values.hpp"

namespace dynains::run {
namespace {

/// `word` as a shell reads it back.
std::string quoted(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

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

RecordingOptions RecordingSettings::checked() const {
  if (!options.sensor_origin.isZero(0.0) && !options.sensor_frame.empty()) {
    throw ConfigError("sensor origin and sensor frame exclude each other");
  }
  if (!options.sensor_origin.isZero(0.0) && !options.sensors.empty()) {
    throw ConfigError("sensor origin and sensors exclude each other");
  }
  RecordingOptions result = options;
  for (const std::string text : flags) {
    if (is_file(text)) result.sources.emplace_back(text);
  }
  return result;
}

bool RecordingSettings::assign(const std::string& flag, const std::string& text,
                               const std::string& name) {
  bool is_known = false;
  visit(*this, [&](const auto& setting) {
    if (flag != "--" + flag_name(setting.name)) return;
    is_known = true;
    assign_parameter(setting, text, name);
  });
  if (is_known && text != "false") flags[flag] = text;
  return is_known;
}

void RecordingSettings::complete(const nlohmann::ordered_json& earlier) {
  for (const auto& [flag, text] : earlier.items()) {
    if (flags.contains(flag) || !text.is_string()) continue;
    if (!assign(flag, text, flag)) throw ConfigError("unknown parameter " + flag);
  }
}

std::string RecordingSettings::as_given(const std::string& recording,
                                        const std::string& further) const {
  std::string text = quoted(recording);
  for (const auto& [flag, value] : flags.items()) {
    if ((' ' + further + ' ').find(' ' + flag + ' ') != std::string::npos) continue;
    text += ' ' + flag;
    if (value != "true") text += ' ' + quoted(value);
  }
  return further.empty() ? text : text + ' ' + further;
}

}  // namespace dynains::run
