// Replacement of folders in one step.
#pragma once

#include <filesystem>

namespace dynains {

/// Moves the folder `staging` to `target`, so that there is never a part of it nor nothing. What
/// was at `target` is at `staging` then; returns whether there was something. Throws IoError, with
/// nothing changed, also if the file system cannot exchange two folders.
bool put_in_place(const std::filesystem::path& staging, const std::filesystem::path& target);

}  // namespace dynains
