#include "session_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <random>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "dynains/errors.hpp"
#include "io/failure.hpp"
#include "session_files.hpp"

namespace dynains::session_files {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStagingEnd = ".staging";
constexpr std::size_t kRandomDigits = 16;

}  // namespace

FolderLock lock_city(const fs::path& folder) {
  using namespace std::chrono_literals;
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (true) {
    try {
      return FolderLock(folder);
    } catch (const UsageError&) {
      if (std::chrono::steady_clock::now() > end) throw;
    }
    std::this_thread::sleep_for(20ms);
  }
}

bool is_staging_name(const std::string& name) {
  const std::size_t end_size = std::strlen(kStagingEnd);
  if (name.size() < 2 + 1 + kRandomDigits + end_size || name.front() != '.') return false;
  const std::size_t digits = name.size() - end_size - kRandomDigits;
  return name.compare(name.size() - end_size, end_size, kStagingEnd) == 0 &&
         name[digits - 1] == '.' &&
         name.find_first_not_of("0123456789abcdef", digits) == name.size() - end_size;
}

fs::path make_staging(const fs::path& city, const std::string& session) {
  std::random_device random;
  std::string digits;
  for (std::size_t i = 0; i < kRandomDigits; ++i) digits += "0123456789abcdef"[random() % 16];
  fs::path folder = city / ('.' + session + '.' + digits + kStagingEnd);
  std::error_code error;
  if (!fs::create_directory(folder, error)) {
    fail_by_system(folder, "cannot be created", error ? error.value() : EEXIST);
  }
  return folder;
}

fs::path foreign_entry(const fs::path& folder) {
  const auto is_one_of_ours = [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    if (entry.is_symlink()) return false;
    if (entry.is_directory()) return name == kTileFolder;
    return entry.is_regular_file() && (name == kSessionFile || name == kReferenceFile);
  };
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!is_one_of_ours(entry)) return entry.path();
  }
  if (!fs::exists(folder / kTileFolder)) return {};
  for (const auto& entry : fs::directory_iterator(folder / kTileFolder)) {
    const bool is_tile =
        entry.is_regular_file() && !entry.is_symlink() && entry.path().extension() == kTileEnd;
    if (!is_tile) return entry.path();
  }
  return {};
}

void remove_session_files(const fs::path& folder) {
  fs::path kept;
  std::error_code first_error;
  const auto note = [&](const fs::path& path, const std::error_code& error) {
    if (!error || first_error) return;
    kept = path;
    first_error = error;
  };
  std::error_code error;
  const auto remove = [&](const fs::path& path) {
    fs::remove(path, error);
    if (error != std::errc::directory_not_empty) note(path, error);
  };
  const auto is_folder = [&](const fs::path& path) {
    return fs::is_directory(fs::symlink_status(path, error));
  };
  if (!is_folder(folder)) return;
  const fs::path tiles = folder / kTileFolder;
  if (is_folder(tiles)) {
    std::vector<fs::path> files;
    for (fs::directory_iterator entry(tiles, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() == kTileEnd) files.push_back(entry->path());
    }
    note(tiles, error);
    for (const fs::path& file : files) {
      if (!is_folder(file)) remove(file);
    }
    remove(tiles);
  }
  for (const char* const name : {kReferenceFile, kSessionFile}) {
    if (!is_folder(folder / name)) remove(folder / name);
  }
  remove(folder);
  if (first_error) fail_by_system(kept, "cannot be removed", first_error.value());
}

}  // namespace dynains::session_files
