// city.json and session.json.
#pragma once

#include <filesystem>
#include <string>

#include "dynains/city/city.hpp"

namespace dynains::session_files {

/// The text of city.json and session.json. Throws IoError without JSON.
std::string city_text(const SessionGrid& grid);
SessionGrid read_city(const std::filesystem::path& path);
std::string session_text(const SessionInfo& session);
/// Sessions of earlier versions have no checksum.
enum class Checksum { kIfPresent, kRequired };
SessionInfo read_session(const std::filesystem::path& path,
                         Checksum checksum = Checksum::kIfPresent);
/// Throws ConfigError unless `text` is empty or JSON.
void check_config_text(const std::string& text);

}  // namespace dynains::session_files
