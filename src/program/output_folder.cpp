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

bool is_leftover(const fs::path& path) {
  return !target_of_temporary(path.filename().string()).empty();
}

std::vector<fs::path> list(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    entries.push_back(entry->path());
  }
  if (error) throw IoError(folder.string() + ": cannot be listed: " + error.message());
  return entries;
}

void remove_leftovers(const fs::path& folder) {
  for (const fs::path& entry : list(folder)) {
    if (is_leftover(entry)) remove_file(entry);
  }
}

void remove_files(const fs::path& folder, const std::vector<std::string>& extensions) {
  for (const fs::path& file : list(folder)) {
    const std::string extension = file.extension().string();
    if (std::find(extensions.begin(), extensions.end(), extension) != extensions.end()) {
      remove_file(file);
    }
  }
  std::error_code error;
  // Stays if it holds anything else.
  fs::remove(folder, error);
}

}  // namespace

fs::path whole_path(const fs::path& path) {
  const fs::path whole = fs::weakly_canonical(fs::absolute(path)).lexically_normal();
  return whole.has_filename() ? whole : whole.parent_path();
}

void create_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be created: " + error.message());
}

void check_output_folder(const fs::path& folder, const OutputFiles& ours, bool force) {
  std::error_code error;
  const std::vector<fs::path> entries = list(folder);
  const bool empty = std::all_of(entries.begin(), entries.end(), is_leftover);
  if (!empty && !fs::is_regular_file(folder / ours.marker, error)) {
    throw IoError(folder.string() + ": is not empty and holds no earlier results (no " +
                  ours.marker + "); choose another folder");
  }
  if (!empty && !force) {
    throw IoError(folder.string() +
                  ": holds earlier results; choose another folder, or replace them by --force");
  }
}

void mark_output_folder(const fs::path& folder, const OutputFiles& ours,
                        const std::string& marker_text) {
  remove_leftovers(folder);
  AtomicFile marker(folder / ours.marker);
  marker.stream() << marker_text;
  marker.commit();
  std::error_code error;
  for (const std::string& name : ours.folders) {
    if (fs::is_directory(folder / name, error)) remove_leftovers(folder / name);
  }
}

void remove_leftovers_of(const fs::path& file) {
  for (const fs::path& entry : list(whole_path(file).parent_path())) {
    const bool is_of_file = entry.stem().stem() == "." + file.filename().string();
    if (is_of_file && is_leftover(entry)) remove_file(entry);
  }
}

void clear_output_folder(const fs::path& folder, const OutputFiles& ours,
                         const std::string& marker_text) {
  mark_output_folder(folder, ours, marker_text);
  for (const std::string& name : ours.files) remove_file(folder / name);
  std::error_code error;
  for (const std::string& name : ours.folders) {
    if (fs::is_directory(folder / name, error)) remove_files(folder / name, ours.extensions);
  }
}

}  // namespace dynains::program
