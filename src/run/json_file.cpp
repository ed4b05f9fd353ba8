#include "json_file.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "read_text_file.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

[[noreturn]] void fail_at(const fs::path& path, std::string_view text, std::size_t byte,
                          const std::string& what) {
  const std::string_view before = text.substr(0, byte);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
  throw IoError(path.string() + ":" + std::to_string(line) + ": column " +
                std::to_string(before.size() - line_begin + 1) + ": " + what);
}

/// Many functions of the JSON library call themselves for each level.
void check_depth(const fs::path& path, std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
      continue;
    }
    if (c == '"') in_string = true;
    if (c == ']' || c == '}') --depth;
    if (c != '[' && c != '{') continue;
    if (++depth > kMaxJsonDepth) {
      fail_at(path, text, i,
              "expected at most " + std::to_string(kMaxJsonDepth) +
                  " arrays and objects within each other");
    }
  }
}

/// The part of the JSON library's message with the found and the expected content.
std::string reason_of(const nlohmann::json::exception& error) {
  const std::string what = error.what();
  const std::size_t reason = what.find("syntax error");
  return reason == std::string::npos ? what.substr(what.find("] ") + 2) : what.substr(reason);
}

/// The value at `pointer`, if it is there and not null.
const Json* find(const Json& json, const std::string& pointer) {
  const Json::json_pointer where(pointer);
  if (!json.contains(where)) return nullptr;
  const Json& value = json[where];
  return value.is_null() ? nullptr : &value;
}

template <class T>
std::optional<T> field_as(const fs::path& path, const Json& json, const std::string& pointer,
                          bool (Json::*is_of_type)() const noexcept, const char* expected) {
  const Json* const value = find(json, pointer);
  if (value == nullptr) return std::nullopt;
  if (!(value->*is_of_type)()) {
    throw IoError(path.string() + ": " + pointer + ": expected " + expected + ", found " +
                  value->type_name());
  }
  return value->get<T>();
}

}  // namespace

Json read_json_file(const fs::path& path) {
  const std::string text = read_text_file(path, kMaxJsonBytes, "a JSON file");
  check_depth(path, text);
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    fail_at(path, text, error.byte == 0 ? 0 : error.byte - 1, "expected JSON: " + reason_of(error));
  } catch (const Json::exception& error) {  // a number that is too large: at no place
    throw IoError(path.string() + ": expected JSON: " + reason_of(error));
  }
}

template <>
std::optional<bool> json_field(const fs::path& path, const Json& json, const std::string& pointer) {
  return field_as<bool>(path, json, pointer, &Json::is_boolean, "true or false");
}

template <>
std::optional<std::uint64_t> json_field(const fs::path& path, const Json& json,
                                        const std::string& pointer) {
  return field_as<std::uint64_t>(path, json, pointer, &Json::is_number_unsigned,
                                 "a whole number from 0 on");
}

template <>
std::optional<double> json_field(const fs::path& path, const Json& json,
                                 const std::string& pointer) {
  return field_as<double>(path, json, pointer, &Json::is_number, "a number");
}

template <>
std::optional<std::string> json_field(const fs::path& path, const Json& json,
                                      const std::string& pointer) {
  return field_as<std::string>(path, json, pointer, &Json::is_string, "a string");
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace dynains::program
