// A command or option that does not exist, mistyped perhaps.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

namespace dynains::program {

/// After `app` has refused a command line: names the first word that is no option, or no command
/// where one is expected, and the nearest existing name.
std::optional<std::string> remark_on_unknown_word(const CLI::App& app);

}  // namespace dynains::program
