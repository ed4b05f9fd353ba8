// The page and the tiles of a map for a web server.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "web_server.hpp"

namespace dynains::program {

/// Answers with the page of a map, tileset.json and the tiles of one folder, and with nothing else.
/// Files are opened by fixed names below the open folder and never through links.
class TileServer {
 public:
  /// Throws IoError.
  explicit TileServer(const std::filesystem::path& folder);
  ~TileServer();

  std::optional<WebAnswer> answer(const std::string& path) const;

 private:
  class ServedFolder;
  std::unique_ptr<ServedFolder> folder_, tiles_;
  std::string page_;
};

}  // namespace dynains::program
