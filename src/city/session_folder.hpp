// The folders of a city: its lock, and sessions that appear or leave by one rename.
#pragma once

#include <filesystem>
#include <string>

#include "dynains/io/folder_lock.hpp"

namespace dynains::session_files {

/// Exclusive lock of a city. Waits up to a minute, since others hold it for moments only. Throws
/// UsageError, IoError.
FolderLock lock_city(const std::filesystem::path& folder);

/// Whether a name in a city is that of a folder that SessionWriter stages or City::drop() removes.
bool is_staging_name(const std::string& name);
/// A new folder of that kind for a session. Throws IoError.
std::filesystem::path make_staging(const std::filesystem::path& city, const std::string& session);
/// Removes the files of a session from a folder, and the folder. Foreign files stay, and the folder
/// with them. What can be removed is removed; then throws IoError if something of ours stays.
void remove_session_files(const std::filesystem::path& folder);
/// Path of the first entry of a folder that is not part of a session; empty if there is none.
std::filesystem::path foreign_entry(const std::filesystem::path& folder);

}  // namespace dynains::session_files
