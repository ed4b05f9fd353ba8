#include "json_file.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "io/input_file.hpp"

namespace dynains::run {
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

/// The part of the JSON library's message with the found and the expected content.
std::string reason_of(const nlohmann::json::exception& error) {
  const std::string what = error.what();
  const std::size_t reason = what.find("syntax error");
  return reason == std::string::npos ? what.substr(what.find("] ") + 2) : what.substr(reason);
}

}  // namespace

Json read_json_file(const fs::path& path) {
  const std::string text = read_text_file(path);
  // Many functions of the JSON library call themselves for each level.
  const auto check_depth = [&](int depth, Json::parse_event_t event, const Json&) {
    const bool begins =
        event == Json::parse_event_t::array_start || event == Json::parse_event_t::object_start;
    if (!begins || depth < kMaxJsonDepth) return true;
    throw IoError(path.string() + ": expected at most " + std::to_string(kMaxJsonDepth) +
                  " arrays and objects within each other");
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::parse_error& error) {
    fail_at(path, text, error.byte == 0 ? 0 : error.byte - 1, "expected JSON: " + reason_of(error));
  } catch (const Json::exception& error) {  // a number that is too large: at no place
    throw IoError(path.string() + ": expected JSON: " + reason_of(error));
  }
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace dynains::run
