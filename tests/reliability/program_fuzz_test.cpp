// Starts the program with random arguments in random folders. Files that do not belong to the
// result are unchanged, the program ends, and a failure has a message.
//
// DYNAINS_PROGRAM_STARTS=1000000 test_disturbed "*at random*" is the long run. With
// DYNAINS_PROGRAM_FIRST=N it begins at start N.
#include <fcntl.h>
#include <linux/capability.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "rehearsal.hpp"
#include "world.hpp"

namespace dynains::test {
namespace {

namespace fs = std::filesystem;

Tree recording_of_clouds() {
  Tree clouds;
  std::string poses;
  for (const std::string name : {"a", "b,\"1\"", "c\n\x1b[31m"}) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 60\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (int i = 0; i < 60; ++i) {
      text += std::to_string(4 + i % 10) + ' ' + std::to_string(i / 10 - 3) + " -1.7\n";
    }
    clouds[name + ".ply"] = {Kind::kFile, text};
    poses += "1 0 0 0 0 1 0 0 0 0 1 0\n";
  }
  clouds["poses.txt"] = {Kind::kFile, poses};
  return clouds;
}

Parts make_parts() {
  Parts parts;
  const Rehearsal run(fresh_run({"--write-online", "--write-clean"}));
  parts.kitti = below(run.after(), "seq");
  parts.complete = below(run.after(), "disk/out");
  parts.clouds = recording_of_clouds();
  parts.unfinished = parts.complete;
  auto report = nlohmann::ordered_json::parse(parts.complete.at("report.json").bytes.text());
  report["complete"] = false;
  parts.unfinished["report.json"].bytes = report.dump();
  parts.simulated = below(Rehearsal(simulation()).after(), "disk/out");
  return parts;
}

/// Runs in the new process. Drops the privileges of root, so that permissions have an effect.
void prepare(const Start& start, const std::string& root) {
  ::alarm(20);
  ::prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0);
  if (::chdir(root.c_str()) != 0) ::_exit(127);
  if (start.full) ::dup2(::open("/dev/full", O_WRONLY), STDOUT_FILENO);
  for (const int descriptor : start.closed) ::close(descriptor);
}

class RandomStart {
 public:
  RandomStart(const Parts& parts, const std::string& root, std::size_t number)
      : maker_(parts, number), root_(root), world_(maker_.world()), start_(maker_.start(world_)) {
    write_tree(root, world_.tree);
    set_permissions(fs::perm_options::remove);
    before_ = read_tree(root);
    out_ = start_.out.empty() ? std::nullopt : real_path(start_.out);
    for (const std::string& input : start_.inputs) {
      if (const auto path = real_path(input)) inputs_.push_back(*path);
    }
    for (const std::string& target : start_.targets) {
      if (const auto path = real_path(target)) targets_.push_back(*path);
    }
    const Environment environment({{"LD_PRELOAD", start_.fault.empty() ? "" : DYNAINS_SHIM},
                                   {"DYNAINS_SHIM_ROOT", root},
                                   {"DYNAINS_SHIM_FAULT", start_.fault},
                                   {"ASAN_OPTIONS", "verify_asan_link_order=0"}});
    outcome_ = test::start(start_.arguments, [&] { prepare(start_, root); });
    set_permissions(fs::perm_options::add);
    after_ = read_tree(root);
  }

  /// Description of a problem; empty if there is none.
  std::string problem() const {
    if (outcome_.code > 2 && outcome_.code != 130) return "exit code";
    const std::string message = problem_of_message();
    if (!message.empty()) return message;
    for (const auto& [path, item] : before_) {
      const auto now = after_.find(path);
      if (now != after_.end() && now->second == item) continue;
      if (!may_change(path)) return "not ours, but touched: " + path;
    }
    for (const auto& [path, item] : after_) {
      if (before_.count(path) == 0 && !may_appear(path)) return "appeared: " + path;
    }
    return problem_of_result();
  }

  std::string description() const {
    std::string text = start_.fault.empty() ? "" : '[' + start_.fault + "] ";
    for (const std::string& argument : start_.arguments) text += '\'' + argument + "' ";
    for (const int descriptor : start_.closed) text += std::to_string(descriptor) + ">&- ";
    if (start_.full) text += ">/dev/full ";
    return text + "-> " + std::to_string(outcome_.code) + ' ' + outcome_.err;
  }
  int code() const { return outcome_.code; }

 private:
  void set_permissions(fs::perm_options how) const {
    const fs::perms write =
        fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;
    for (const std::string& path : world_.locked) {
      std::error_code ignored;
      fs::permissions(root_ + '/' + path,
                      how == fs::perm_options::add ? fs::perms::owner_write : write, how, ignored);
    }
  }

  /// Relative to the root; nothing if the path leads to no file.
  std::optional<std::string> real_path(const std::string& path) const {
    std::error_code error;
    fs::path whole = fs::weakly_canonical(fs::path(root_) / path, error).lexically_normal();
    if (error) return std::nullopt;
    if (!whole.has_filename()) whole = whole.parent_path();
    return is_below(whole, root_) ? whole.string().substr(root_.size() + 1) : std::string();
  }

  std::string command() const { return start_.arguments.empty() ? "" : start_.arguments.front(); }
  bool is_input(const std::string& path) const {
    return std::any_of(inputs_.begin(), inputs_.end(), [&](const std::string& input) {
      return path == input || is_below(path, input);
    });
  }
  bool is_target(const std::string& path) const {
    return std::find(targets_.begin(), targets_.end(), path) != targets_.end();
  }

  bool may_change(const std::string& path) const {
    const bool is_eval = command() == "eval";
    if (is_input(path)) return false;
    if (is_target(path) && is_eval) return true;
    if (!out_ || !is_below(path, *out_)) return false;
    const Kind kind = before_.at(path).kind;
    // A folder may be removed if it is empty or holds only files of the program.
    return kind == Kind::kFolder || (kind == Kind::kFile && world_.ours.count(path) > 0);
  }

  bool may_appear(const std::string& path) const {
    if (is_target(path)) return true;
    const std::string name = path.substr(path.rfind('/') + 1);
    // After a failed call, a temporary file and an unfinished output may stay.
    const bool is_partial = path.find(".partial") != path.npos || ends_with(name, ".tmp");
    if (!start_.fault.empty() && is_partial) return true;
    if (!out_) return false;
    if (path == *out_ || is_below(*out_, path)) return true;
    if (!is_below(path, *out_)) return false;
    const Tree results = below(before_, *out_);
    const bool was_result = std::any_of(world_.ours.begin(), world_.ours.end(),
                                        [&](const auto& file) { return is_below(file, *out_); });
    return results.empty() || was_result;
  }

  std::string problem_of_message() const {
    if (std::count(start_.closed.begin(), start_.closed.end(), STDERR_FILENO) > 0) return {};
    const std::string& text = outcome_.err;
    if (std::any_of(text.begin(), text.end(), [](char c) {
          return std::iscntrl(static_cast<unsigned char>(c)) && c != '\n';
        })) {
      return "control characters in a message";
    }
    const bool failed = outcome_.code == 1 || outcome_.code == 2;
    const bool is_check = command() == "check";
    const std::size_t at = text.find("dynains: error: ");
    if (failed && !is_check && (at == std::string::npos || text.size() < at + 30)) {
      return "no message";
    }
    return {};
  }

  std::string problem_of_result() const {
    if (!out_ || command() != "run") return {};
    const Claim claim = claim_of(below(after_, *out_));
    if (outcome_.code == 0) return claim == Claim::kComplete ? "" : "exit code 0, but not complete";
    // A call that failed after the new results were in place is an error, too.
    const bool is_disturbed = start_.full || !start_.closed.empty() || !start_.fault.empty();
    if (claim != Claim::kComplete || is_disturbed) return {};
    for (const std::string& path : world_.ours) {
      const auto earlier = before_.find(path);
      const auto now = after_.find(path);
      if (earlier != before_.end() && (now == after_.end() || now->second != earlier->second)) {
        return "complete, but touched by a run that failed: " + path;
      }
    }
    return {};
  }

  WorldMaker maker_;
  std::string root_;
  World world_;
  Start start_;
  Tree before_;
  std::optional<std::string> out_;    ///< of the result, links resolved
  std::vector<std::string> targets_;  ///< links resolved
  std::vector<std::string> inputs_;   ///< links resolved
  Outcome outcome_;
  Tree after_;
};

}  // namespace

TEST_CASE("the program is started at random") {
  const Parts parts = make_parts();
  const TemporaryFolder folder;
  const std::string root = fs::canonical(folder.path()).string() + "/root";
  const std::size_t first = number_in("DYNAINS_PROGRAM_FIRST", 0);
  const std::size_t count = number_in("DYNAINS_PROGRAM_STARTS", 200);
  std::size_t succeeded = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t number = first; number < first + count; ++number) {
    const RandomStart start(parts, root, number);
    INFO("start " << number << ": " << start.description());
    CHECK(start.problem() == "");
    if (start.code() == 0) ++succeeded;
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  WARN(static_cast<double>(count) / time.count()
       << " starts a second, " << succeeded << " of " << count << " with exit code 0");
  CHECK(succeeded > count / 10);
}

}  // namespace dynains::test
