#include "tile_server.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dynains/errors.hpp"
#include "viewer/page.hpp"
#include "viewer/tile_point.hpp"
#include "viewer/tileset_writer.hpp"

namespace dynains::program {

namespace fs = std::filesystem;

/// An open folder.
class TileServer::ServedFolder {
 public:
  explicit ServedFolder(const fs::path& folder)
      : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (descriptor_ < 0) throw IoError(folder.string() + ": cannot be read");
  }
  ~ServedFolder() { ::close(descriptor_); }
  ServedFolder(const ServedFolder&) = delete;
  ServedFolder& operator=(const ServedFolder&) = delete;

  /// A regular file in the folder, which is not a link; nothing if it cannot be read.
  std::optional<WebAnswer> read(const std::string& name, const char* type) const {
    const int file =
        ::openat(descriptor_, name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) return std::nullopt;
    std::optional<WebAnswer> answer;
    struct stat status {};
    if (::fstat(file, &status) == 0 && S_ISREG(status.st_mode)) {
      std::string content(static_cast<std::size_t>(status.st_size), '\0');
      if (read_all(file, content)) answer = WebAnswer{std::move(content), type};
    }
    ::close(file);
    return answer;
  }

 private:
  static bool read_all(int file, std::string& content) {
    for (std::size_t done = 0; done < content.size();) {
      const ssize_t count = ::read(file, content.data() + done, content.size() - done);
      if (count <= 0) return false;
      done += static_cast<std::size_t>(count);
    }
    return true;
  }

  int descriptor_;
};

TileServer::TileServer(const fs::path& folder)
    : folder_(std::make_unique<ServedFolder>(folder)),
      tiles_(std::make_unique<ServedFolder>(folder / viewer::kTilesetFolder)),
      page_(viewer::map_page()) {}

TileServer::~TileServer() = default;

std::optional<WebAnswer> TileServer::answer(const std::string& path) const {
  if (path == "/") return WebAnswer{page_, "text/html; charset=utf-8"};
  if (path == std::string("/") + viewer::kTilesetFile) {
    return folder_->read(viewer::kTilesetFile, "application/json");
  }
  const std::string prefix = std::string("/") + viewer::kTilesetFolder + '/';
  const std::string end = viewer::kPointTileExtension;
  if (path.size() < prefix.size() + end.size() || path.compare(0, prefix.size(), prefix) != 0 ||
      path.compare(path.size() - end.size(), end.size(), end) != 0) {
    return std::nullopt;
  }
  const std::string name = path.substr(prefix.size(), path.size() - prefix.size() - end.size());
  if (!viewer::is_tile_node_name(name)) return std::nullopt;
  return tiles_->read(name + end, "application/octet-stream");
}

}  // namespace dynains::program
