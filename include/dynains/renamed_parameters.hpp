// Former names of parameters. Flags, config files and the Python module refuse them with an error
// that gives the present name.
#pragma once

#include <string>

namespace dynains {

struct RenamedParameter {
  const char* former_name;  ///< snake_case
  const char* present_name;
  const char* note;  ///< how values translate; empty if they stay the same
};

inline constexpr RenamedParameter kRenamedParameters[] = {
    {"use_free_space", "decision", "true: free_space or both, false: window"},
    {"horizon", "lookahead_scans", ""},
    {"memory", "lookback_scans", ""},
    {"ground_reach", "ground_test_distance", ""},
    {"remove_share", "removal_ratio", ""},
    {"see_share", "pass_ratio", ""},
    {"passage_cell", "dynamic_grid_cell", ""},
    {"passage_share", "dynamic_grid_ratio", ""},
    {"see_past_movers", "ignore_dynamic_returns", ""},
};

/// Text for an error message: the present name of `former_name`, or an empty text if no parameter
/// ever had that name.
inline std::string renaming_of(const std::string& former_name) {
  for (const RenamedParameter& renamed : kRenamedParameters) {
    if (former_name != renamed.former_name) continue;
    const std::string note = renamed.note;
    return std::string("is now called ") + renamed.present_name +
           (note.empty() ? "" : " (" + note + ")");
  }
  return {};
}

}  // namespace dynains
