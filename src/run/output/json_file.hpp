// JSON files from untrusted sources.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>

#include "dynains/errors.hpp"

namespace dynains::run {

/// Arrays and objects within each other that a JSON file may have.
inline constexpr int kMaxJsonDepth = 64;

/// Reads a JSON file. Throws IoError with path, line, column and expectation.
nlohmann::ordered_json read_json_file(const std::filesystem::path& path);

/// Text of a JSON file. Bytes that are not UTF-8, as of paths, are replaced.
std::string to_text(const nlohmann::ordered_json& json);

/// The field of `json` that `pointer` ("/static_map/file") names; nothing if there is none or if it
/// is null. Throws IoError with path, pointer and expected type for a value of another type. T is
/// bool, double or std::string. `path` is the file that `json` was read from.
template <class T>
std::optional<T> json_field(const std::filesystem::path& path, const nlohmann::ordered_json& json,
                            const std::string& pointer) {
  const nlohmann::ordered_json::json_pointer where(pointer);
  if (!json.contains(where) || json[where].is_null()) return std::nullopt;
  const nlohmann::ordered_json& value = json[where];
  const char* expected = "a string";
  bool fits = value.is_string();
  if constexpr (std::is_same_v<T, bool>) {
    expected = "true or false";
    fits = value.is_boolean();
  } else if constexpr (std::is_same_v<T, double>) {
    expected = "a number";
    fits = value.is_number();
  }
  if (fits) return value.get<T>();
  throw IoError(path.string() + ": " + pointer + ": expected " + expected + ", found " +
                value.type_name());
}

/// A field that must exist; see json_field.
template <class T>
T required_json_field(const std::filesystem::path& path, const nlohmann::ordered_json& json,
                      const std::string& pointer) {
  if (std::optional<T> value = json_field<T>(path, json, pointer)) return *std::move(value);
  throw IoError(path.string() + ": " + pointer + ": not found; expected a value");
}

}  // namespace dynains::run
