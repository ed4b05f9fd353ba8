#include "output_folder.hpp"

#include <algorithm>
#include <system_error>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

void remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) throw IoError(path.string() + ": cannot be removed: " + error.message());
}

void remove_files(const fs::path& folder, const std::vector<std::string>& extensions) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string extension = entry->path().extension().string();
    if (std::find(extensions.begin(), extensions.end(), extension) != extensions.end()) {
      files.push_back(entry->path());
    }
  }
  for (const fs::path& file : files) remove_file(file);
  // Stays if it holds anything else.
  fs::remove(folder, error);
}

}  // namespace

void create_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be created: " + error.message());
}

void check_output_folder(const fs::path& folder, const OutputFiles& ours, bool force) {
  std::error_code error;
  const bool empty = fs::is_empty(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be listed: " + error.message());
  if (!empty && !fs::is_regular_file(folder / ours.marker, error)) {
    throw IoError(folder.string() + ": is not empty and holds no earlier results (no " +
                  ours.marker + "); choose another folder");
  }
  if (!empty && !force) {
    throw IoError(folder.string() +
                  ": holds earlier results; choose another folder, or replace them by --force");
  }
}

void clear_output_folder(const fs::path& folder, const OutputFiles& ours,
                         const std::string& marker_text) {
  AtomicFile marker(folder / ours.marker);
  marker.stream() << marker_text;
  marker.commit();
  for (const std::string& name : ours.files) remove_file(folder / name);
  std::error_code error;
  for (const std::string& name : ours.folders) {
    if (fs::is_directory(folder / name, error)) remove_files(folder / name, ours.extensions);
  }
}

}  // namespace dynains::program
