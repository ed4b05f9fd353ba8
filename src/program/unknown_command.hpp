// A command that there is not, mistyped perhaps.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

namespace dynains::program {

/// After `app` has refused a command line: if a command was to stand where something else does,
/// which there are and which of them is spelt most alike.
std::optional<std::string> remark_on_unknown_command(const CLI::App& app);

}  // namespace dynains::program
