// The completeness that folders of results declare, and checks of it.
#pragma once

#include <nlohmann/json.hpp>
#include <regex>
#include <string>

#include "tree.hpp"

namespace dynains::test {

inline bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

enum class Claim { kNone, kUnfinished, kComplete, kUnreadable };

/// Value of "complete" in report.json or simulation.json; kNone: neither file exists.
inline Claim claim_of(const Tree& results) {
  for (const char* marker : {"report.json", "simulation.json"}) {
    const auto file = results.find(marker);
    if (file == results.end()) continue;
    const auto json = nlohmann::json::parse(file->second.bytes.text(), nullptr, false);
    if (!json.is_object() || json.value("program", "") != "dynains") return Claim::kUnreadable;
    return json.value("complete", false) ? Claim::kComplete : Claim::kUnfinished;
  }
  return Claim::kNone;
}

/// The tree without measured times and memory.
inline Tree without_measurements(Tree tree) {
  for (auto& [name, item] : tree) {
    if (ends_with(name, "report.json")) {
      auto json = nlohmann::json::parse(item.bytes.text(), nullptr, false);
      if (!json.is_object()) continue;
      for (const char* field : {"milliseconds", "flush_milliseconds", "wall_milliseconds",
                                "share_outside_pipeline", "peak_memory_bytes"}) {
        json.erase(field);
      }
      item.bytes = json.dump();
    }
    if (ends_with(name, "timing.csv")) {
      item.bytes = std::regex_replace(item.bytes.text(), std::regex("[0-9]+\\.[0-9]{4}"), "time");
    }
  }
  return tree;
}

}  // namespace dynains::test
