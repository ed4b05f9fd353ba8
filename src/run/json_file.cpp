#include "json_file.hpp"

#include "read_text_file.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

}  // namespace

std::string json_problem(const nlohmann::json::exception& error) {
  const std::string what = error.what();  // begins with "[json.exception.KIND.NUMBER] "
  return what.substr(what.find("] ") + 2);
}

Json read_json_file(const fs::path& path) {
  const std::string text = read_text_file(path, kMaxJsonBytes, "a JSON file");
  // Many functions of the JSON library call themselves for each level.
  const auto check_depth = [&](int depth, Json::parse_event_t event, const Json&) {
    using Event = Json::parse_event_t;
    const bool begins = event == Event::object_start || event == Event::array_start;
    if (!begins || depth < kMaxJsonDepth) return true;
    throw IoError(path.string() + ": expected at most " + std::to_string(kMaxJsonDepth) +
                  " arrays and objects within each other");
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::exception& error) {
    throw IoError(path.string() + ": expected JSON: " + json_problem(error));
  }
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace dynains::program
