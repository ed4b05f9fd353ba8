// Pictures that the program gnuplot draws.
#pragma once

#include <filesystem>
#include <string>

namespace dynains::program {

/// Runs gnuplot on a script, in the folder of the script, and puts what it writes to its standard
/// output into `picture`, whole or not at all. The script and what it reads stay. No shell is
/// involved. Throws IoError if gnuplot is missing, naming its package, or if it fails.
void draw_by_gnuplot(const std::filesystem::path& script, const std::filesystem::path& picture);

/// A text of a script: quoted, without what gnuplot would interpret.
std::string gnuplot_text(const std::string& text);

}  // namespace dynains::program
