#pragma once

#include <CLI/CLI.hpp>

namespace dynains::program {

/// `dynains eval SEQ [OUT...]`: both protocols, beside identity and oracle. Runs when parsed.
void add_eval_command(CLI::App& program);

}  // namespace dynains::program
