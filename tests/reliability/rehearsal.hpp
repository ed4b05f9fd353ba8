// A command of the program that is disturbed repeatedly, and the conditions that hold afterwards.
#pragma once

#include <nlohmann/json.hpp>
#include <regex>

#include "dynains/io/kitti.hpp"
#include "io/files.hpp"
#include "program/start.hpp"
#include "program/tiny_sequence.hpp"
#include "shim/log.hpp"
#include "support/catch.hpp"
#include "tree.hpp"

namespace dynains::test {

// Starts the program with the shim preloaded.

/// Sets variables that processes inherit if they start during its life.
class Environment {
 public:
  explicit Environment(std::map<std::string, std::string> variables)
      : variables_(std::move(variables)) {
    for (const auto& [name, value] : variables_) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& variable : variables_) ::unsetenv(variable.first.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::map<std::string, std::string> variables_;
};

/// Runs `dynains ARGUMENTS`. SIGALRM ends a program that hangs (exit code 142).
inline Outcome start_or_stop(const std::vector<std::string>& arguments) {
  return start(arguments, [] { ::alarm(20); });
}

struct Recorded {
  Outcome outcome;
  std::vector<shim::Entry> events;
};

/// Runs `dynains ARGUMENTS` and records its changes below `root`. `fault` as in shim.cpp; empty:
/// none.
inline Recorded start_with_shim(const std::vector<std::string>& arguments, const std::string& root,
                                const std::string& fault = {}) {
  const TemporaryFolder folder;
  const std::string log = folder / "log";
  write_text(log, {});
  const Environment environment({{"LD_PRELOAD", DYNAINS_SHIM},
                                 {"DYNAINS_SHIM_ROOT", root},
                                 {"DYNAINS_SHIM_LOG", log},
                                 {"DYNAINS_SHIM_FAULT", fault},
                                 // A sanitizer's runtime may come after the shim.
                                 {"ASAN_OPTIONS", "verify_asan_link_order=0"}});
  const Outcome outcome = start_or_stop(arguments);
  return {outcome, shim::parse_log(read_text(log))};
}

// The completeness that folders of results declare, and checks of it.

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
      if (json.contains("contents")) json["contents"].erase("timing.csv");
      item.bytes = json.dump();
    }
    if (ends_with(name, "timing.csv")) {
      item.bytes = std::regex_replace(item.bytes.text(), std::regex("[0-9]+\\.[0-9]{4}"), "time");
    }
  }
  return tree;
}

// A recording that the program processes in milliseconds.

/// Every twelfth point of the tiny sequence, about 440 per scan, with ground truth for the box.
/// Times differ from the defaults of a recording without times.
inline void write_small_recording(const std::filesystem::path& folder, std::size_t scans) {
  write_tiny_sequence(folder, scans);
  std::filesystem::create_directories(folder / "labels");
  std::vector<double> times;
  for (std::size_t i = 0; i < scans; ++i) {
    const std::vector<float> all = tiny_scan(i);
    std::vector<float> scan;
    std::vector<std::uint32_t> labels;
    const std::size_t box = all.size() / 4 - 192;
    for (std::size_t k = i; k < all.size() / 4; k += 12) {
      scan.insert(scan.end(), all.data() + 4 * k, all.data() + 4 * k + 4);
      labels.push_back(k < box ? 9 : 251);
    }
    write_scan(folder / "velodyne" / (scan_name(i) + ".bin"), scan);
    write_labels(folder / "labels" / (scan_name(i) + ".label"), labels);
    times.push_back(0.2 * static_cast<double>(i));
  }
  write_times(folder / "times.txt", times);
}

/// The number in an environment variable.
inline std::size_t number_in(const char* variable, std::size_t otherwise) {
  const char* const value = std::getenv(variable);
  return value == nullptr ? otherwise : static_cast<std::size_t>(std::stoul(value));
}

/// Arguments that begin with / are below the root: /seq is the input, /disk/out the folder of the
/// results, /maps another disk.
struct Scenario {
  std::vector<Arguments> before;  ///< run before the others
  Arguments command;              ///< the command that is disturbed
  Arguments again;                ///< completes the command
  /// Paths that a command changes one after the other, each at once.
  std::vector<std::string> parts = {};
};

class Rehearsal {
 public:
  /// Runs the whole scenario once, undisturbed.
  explicit Rehearsal(const Scenario& scenario) : scenario_(scenario) {
    for (const char* disk : {"/disk", "/maps"}) std::filesystem::create_directories(root_ + disk);
    write_small_recording(root_ + "/seq", 4);
    write_text(root_ + "/seq/run.cfg", "window = 3\n");
    const std::vector<Pose> poses(4, Pose(Eigen::Translation3d(64.0, -32.0, 2.0)));
    write_poses(root_ + "/seq/corrected.txt", poses);
    for (const Arguments& arguments : scenario.before) {
      REQUIRE(start_or_stop(with_root(arguments)).code == 0);
    }
    for (const char* disk : {"/maps", "/disk"}) write_text(root_ + disk + kForeign, "mine");
    before_ = read_tree(root_);
    const Recorded recorded = disturb(scenario.command, {});
    CAPTURE(recorded.outcome.err);
    REQUIRE(recorded.outcome.code == 0);
    after_ = read_tree(root_);
    REQUIRE(claim_of(below(after_, "disk/out")) == Claim::kComplete);
    results_before_ = results(before_);
    results_after_ = results(after_);
    comparable_after_ = comparable(after_);
    not_ours_before_ = not_ours(before_);
    events_ = recorded.events;
  }

  const std::string& root() const { return root_; }
  const Tree& before() const { return before_; }
  const Tree& after() const { return after_; }
  const std::vector<shim::Entry>& events() const { return events_; }

  /// Runs the command from its initial state, with a fault as in shim.cpp.
  Recorded disturb(const std::string& fault) {
    restore(before_);
    return disturb(scenario_.command, fault);
  }

  /// Description of a problem in a state that the command left; empty if there is none.
  std::string problem(const Tree& state) const {
    const std::string foreign = difference(not_ours(state), not_ours_before_);
    if (!foreign.empty()) return "not ours: " + foreign;
    const Tree folder = below(state, "disk/out");
    switch (claim_of(folder)) {
      case Claim::kUnreadable:
        return "the marker cannot be read";
      case Claim::kUnfinished:
        return {};
      case Claim::kComplete: {
        const std::string wrong = difference(results(state), results_after_);
        if (wrong.empty() || is_earlier(state) || is_between(state)) return {};
        return "called complete, but " + wrong;
      }
      case Claim::kNone:
        for (const auto& [path, item] : folder) {
          const bool hidden = is_hidden('/' + path) || is_foreign('/' + path);
          if (item.kind == Kind::kFile && !hidden) return path + " without a marker";
        }
        return {};
    }
    return {};
  }

  /// Restarts from the state. Returns a description of a problem in the result; empty if none.
  std::string problem_after_restart(const Tree& state) {
    restore(state);
    const Outcome outcome = start_or_stop(with_root(scenario_.again));
    const Tree end = read_tree(root_);
    if (outcome.code != 0) return "exit code " + std::to_string(outcome.code) + ": " + outcome.err;
    return difference_from_end(end);
  }

  /// Empty if the state has the complete results of the command, else the first difference.
  std::string difference_from_end(const Tree& state) const {
    return difference(comparable(state), comparable_after_);
  }

 private:
  static constexpr const char* kForeign = "/notes.txt";

  static bool is_foreign(const std::string& path) { return ends_with(path, kForeign); }
  /// Outputs in the making.
  static bool is_hidden(const std::string& path) {
    return path.find("/.") != std::string::npos || path.find(".partial") != std::string::npos;
  }
  static bool is_ours(const std::string& path) {
    return (path.rfind("disk/out", 0) == 0 || path.rfind("maps/", 0) == 0) && !is_foreign(path);
  }
  static Tree select(const Tree& tree, const std::function<bool(const std::string&)>& wanted) {
    Tree selected;
    for (const auto& item : tree) {
      if (wanted(item.first)) selected.insert(item);
    }
    return selected;
  }
  static Tree not_ours(const Tree& tree) {
    return select(tree, [](const std::string& path) { return !is_ours(path); });
  }
  static Tree comparable(const Tree& tree) {
    return without_empty_folders(without_measurements(tree));
  }
  static Tree results(const Tree& tree) {
    return comparable(
        select(tree, [](const std::string& path) { return is_ours(path) && !is_hidden(path); }));
  }
  bool is_earlier(const Tree& state) const { return results(state) == results_before_; }

  /// Whether each part is as before or as after the command, and the rest is as before. The marker
  /// may be between.
  bool is_between(const Tree& state) const {
    const auto is_in = [](const std::string& path, const std::string& part) {
      return path.rfind(part, 0) == 0;
    };
    const auto select_part = [&](const Tree& tree, const std::string& part) {
      return select(results(tree), [&](const std::string& path) { return is_in(path, part); });
    };
    const auto rest = [&](const Tree& tree) {
      return select(results(tree), [&](const std::string& path) {
        return path != "disk/out/report.json" &&
               std::none_of(scenario_.parts.begin(), scenario_.parts.end(),
                            [&](const std::string& part) { return is_in(path, part); });
      });
    };
    const auto is_whole = [&](const std::string& part) {
      const Tree found = select_part(state, part);
      return found == select_part(before_, part) || found == select_part(after_, part);
    };
    return !scenario_.parts.empty() && rest(state) == rest(before_) &&
           std::all_of(scenario_.parts.begin(), scenario_.parts.end(), is_whole);
  }

  /// Restores the disks to the state. The input is never written, so that a change is detected.
  void restore(const Tree& state) const {
    for (const char* disk : {"disk", "maps"}) write_tree(root_ + '/' + disk, below(state, disk));
  }

  Arguments with_root(Arguments arguments) const {
    for (std::string& argument : arguments) {
      if (argument.front() == '/') argument = root_ + argument;
    }
    return arguments;
  }
  Recorded disturb(const Arguments& arguments, const std::string& fault) const {
    return start_with_shim(with_root(arguments), root_, fault);
  }

  Scenario scenario_;
  TemporaryFolder folder_;
  std::string root_ = std::filesystem::canonical(folder_.path()).string() + "/root";
  Tree before_;
  Tree after_;
  Tree not_ours_before_;
  Tree results_before_;
  Tree results_after_;
  Tree comparable_after_;
  std::vector<shim::Entry> events_;
};

inline Arguments run_with(const Arguments& flags) {
  return Arguments{"run", "/seq", "--out", "/disk/out", "--quiet"} + flags;
}

/// A small simulation.
inline Arguments simulate_with(const Arguments& flags) {
  return Arguments{"simulate", "/disk/out",   "--quiet",  "--scans", "1",
                   "--scene",  "car-park",    "--sensor", "vlp16",   "--traffic",
                   "0",        "--max-range", "1"} +
         flags;
}

/// A run of the first three scans into a new folder.
inline Scenario fresh_run(const Arguments& flags) {
  const Arguments command = run_with(Arguments{"--end", "2"} + flags);
  return {{}, command, command + Arguments{"--force"}};
}

/// --force over the result of a longer run with more outputs.
inline Scenario replacing_run(const Arguments& earlier, const Arguments& flags) {
  Scenario scenario = fresh_run(flags);
  scenario.before = {run_with(Arguments{"--window", "2"} + earlier)};
  scenario.command = scenario.again;
  scenario.parts = {"maps/map.ply", "disk/out/"};
  return scenario;
}

/// A run that adds a session to a map of many sessions.
inline Scenario added_session() {
  Scenario scenario = fresh_run({"--update", "/maps/city", "--accept-poses"});
  scenario.before = {{"run", "/seq", "--out", "/disk/earlier", "--start", "2", "--update",
                      "/maps/city", "--session", "earlier", "--accept-poses", "--quiet"}};
  return scenario;
}

/// remap that moves the session of a run in a map of many sessions.
inline Scenario moved_session() {
  const Arguments command = {"remap",    "/seq",       "/disk/out", "--poses", "/seq/corrected.txt",
                             "--update", "/maps/city", "--quiet"};
  return {{run_with({"--update", "/maps/city", "--accept-poses"})},
          command,
          command,
          {"maps/city/seq.session", "disk/out/static_map_remapped.ply"}};
}

inline Scenario simulation() { return {{}, simulate_with({}), simulate_with({"--force"})}; }

inline Scenario replacing_simulation() {
  return {{simulate_with({"--seed", "2"})}, simulate_with({"--force"}), simulate_with({"--force"})};
}

}  // namespace dynains::test
