// Starts the program with random arguments in random folders. Files that do not belong to the
// result are unchanged, the program ends, and a failure has a message.
//
// DYNAINS_PROGRAM_STARTS=1000000 test_disturbed "*at random*" is the long run. With
// DYNAINS_PROGRAM_FIRST=N it begins at start N.
#include <fcntl.h>
#include <linux/capability.h>
#include <sys/prctl.h>

#include "rehearsal.hpp"
#include "support/random.hpp"
#include "support/standard.hpp"

namespace dynains::test {
namespace {

using Words = std::vector<std::string>;

bool is_below(const std::string& path, const std::string& folder) {
  return path.rfind(folder + '/', 0) == 0;
}

/// Parts of a world, each relative to its own folder.
struct Parts {
  Tree kitti;       ///< a recording
  Tree complete;    ///< results of run over kitti
  Tree unfinished;  ///< the same, marked as unfinished
  Tree simulated;   ///< results of simulate
};

Parts make_parts() {
  Parts parts;
  const Rehearsal run(fresh_run({"--write-online", "--write-clean"}));
  parts.kitti = below(run.after(), "seq");
  parts.complete = below(run.after(), "disk/out");
  parts.unfinished = parts.complete;
  auto report = nlohmann::ordered_json::parse(parts.complete.at("report.json").bytes.text());
  report["complete"] = false;
  parts.unfinished["report.json"].bytes = report.dump();
  parts.simulated = below(Rehearsal(simulation()).after(), "disk/out");
  return parts;
}

struct World {
  Tree tree;
  std::set<std::string> ours;  ///< names of files that a marker beside or above them lists
  Words locked;                ///< without permission to write
  std::string kitti, out;      ///< names of folders, beside "other" and "foreign"
};

/// A start of the program in the folder of the world.
struct Start {
  Arguments arguments;
  Words inputs;             ///< files and folders that the arguments name as input
  std::string out;          ///< of run and simulate
  Words targets;            ///< files that the arguments name as output
  std::vector<int> closed;  ///< descriptors
  bool full = false;        ///< standard output is full
};

/// Random folders of a user and random starts of the program in them, from a seed.
class WorldMaker {
 public:
  WorldMaker(const Parts& parts, std::size_t seed) : parts_(parts), random_(seed) {}

  World world() {
    const std::string strange = chance(0.6) ? ""
                                            : pick({" x", "\n", "\x1b[31m", ",\"", "\xc3\xb6",
                                                    "\xff", std::string(200, 'l'), ".tmp"});
    World world;
    world.kitti = "seq" + strange;
    world.out = pick({"out", "out", ".out", "-out"}) + (chance(0.3) ? strange : "");
    add(world, world.kitti, parts_.kitti, false);
    add(world, "foreign",
        {{"mine.txt", {Kind::kFile, "mine"}},
         {"mine.ply", {Kind::kFile, "ply, mine"}},
         {"000000.label", {Kind::kFile, "by hand"}}},
        false);
    const auto result = [&]() -> const Tree& {
      const Tree* const all[] = {&parts_.complete, &parts_.complete, &parts_.unfinished,
                                 &parts_.simulated};
      return *all[random_.index(4)];
    };
    if (chance(0.7)) add(world, world.out, result(), true);
    if (chance(0.4)) add(world, "other", result(), true);
    for (std::size_t i = random_.index(4); i > 0; --i) change(world);
    return world;
  }

  Start start(const World& world) {
    Start start;
    const std::size_t kind = random_.index(20);
    if (kind < 13) {
      run(world, start);
    } else if (kind < 17) {
      eval(world, start);
    } else if (kind == 17) {
      start.out = output(world);
      start.arguments = {"simulate",       start.out,     "--scans=1",    "--scene=car-park",
                         "--sensor=vlp16", "--traffic=0", "--max-range=1"};
      if (chance(0.6)) start.arguments.emplace_back("--force");
    } else {
      const std::vector<Arguments> others = {
          {"check", input(world)}, {"config"}, {"--help"}, {}, {"rum"}};
      start.arguments = others[random_.index(others.size())];
    }
    if (chance(0.05)) start.arguments.push_back(pick({"", "-1", "--", "nan", "--x"}));
    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      if (chance(0.06)) start.closed.push_back(descriptor);
    }
    start.full = chance(0.05);
    return start;
  }

 private:
  bool chance(double share) { return random_.uniform(0.0, 1.0) < share; }
  std::string pick(const Words& from) { return from[random_.index(from.size())]; }

  static void add(World& world, const std::string& folder, const Tree& part, bool ours) {
    world.tree[folder] = {Kind::kFolder, {}};
    for (const auto& [name, item] : part) {
      world.tree[folder + '/' + name] = item;
      if (ours && item.kind == Kind::kFile) world.ours.insert(folder + '/' + name);
    }
  }

  static void erase(World& world, const std::string& path) {
    for (auto item = world.tree.begin(); item != world.tree.end();) {
      const bool within = item->first == path || is_below(item->first, path);
      item = within ? world.tree.erase(item) : std::next(item);
    }
  }

  /// Removes the paths below OUT from `ours`.
  static void disown(World& world) {
    for (auto name = world.ours.begin(); name != world.ours.end();) {
      name = is_below(*name, world.out) ? world.ours.erase(name) : std::next(name);
    }
  }

  /// Puts an item of another owner there if its folder exists.
  static void put(World& world, const std::string& path, const Item& item) {
    const std::size_t slash = path.rfind('/');
    if (slash != std::string::npos) {
      const std::string folder = path.substr(0, slash);
      if (world.tree.count(folder) == 0) put(world, folder, {Kind::kFolder, {}});
      if (world.tree.count(folder) == 0 || world.tree[folder].kind != Kind::kFolder) return;
    }
    erase(world, path);
    world.tree[path] = item;
  }

  void change(World& world) {
    const std::string name =
        world.out + '/' +
        pick({"report.json", "static_map.ply", "dynamic_points.ply", "timing.csv", "labels",
              "clean", "online", "velodyne", "simulation.json", "labels/000000.label",
              "causes/000001.cause", "clean/000000.bin", "poses.txt", "notes.txt",
              ".notes.2024.tmp", "labels/mine.txt", "labels/.x.0123456789abcdef.tmp", "a/b/c.txt"});
    std::string above;
    for (std::ptrdiff_t i = std::count(name.begin(), name.end(), '/'); i > 0; --i) above += "../";
    const std::string input =
        world.kitti + pick({"/velodyne/000001.bin", "/poses.txt", "/times.txt",
                            "/labels/000000.label", "/run.cfg"});
    const std::string bytes = world.tree[input].bytes.text();
    switch (random_.index(10)) {
      case 0:
        return put(world, name, {Kind::kFile, "mine"});
      case 1:
        put(world, name, {Kind::kFolder, {}});
        return put(world, name + "/mine.txt", {Kind::kFile, "mine"});
      case 2:
        return put(
            world, name,
            {Kind::kLink, above + "foreign" + pick({"", "/mine.txt", "/mine.ply", "/none"})});
      case 3:
        disown(world);
        return put(world, world.out,
                   {Kind::kLink, pick({"other", "foreign", world.kitti, "nothing", world.out})});
      case 4:
        return damage_marker(world);
      case 5:
        return erase(world, input);
      case 6:
        return put(world, input, {Kind::kFile, bytes.substr(0, random_.index(bytes.size() + 1))});
      case 7:
        return put(world, input, {Kind::kFolder, {}});
      case 8:
        world.locked.push_back(pick({world.out, world.out + "/labels", name, "."}));
        return;
      default:
        return put(world, "link",
                   {Kind::kLink, pick({world.out, world.kitti, world.kitti + "/velodyne"})});
    }
  }

  /// Damages the markers, so that no result in OUT belongs to the program.
  void damage_marker(World& world) {
    const std::string program = "{\"program\": \"dynains\"";
    for (const char* marker : {"/report.json", "/simulation.json"}) {
      const auto item = world.tree.find(world.out + marker);
      if (item == world.tree.end() || item->second.kind != Kind::kFile) continue;
      const std::string bytes = item->second.bytes.text();
      item->second.bytes =
          pick({"", "[", "null", std::string(50000, '['), program + "}",
                program + ", \"complete\": true, \"files\": [\"../foreign/mine.txt\"]}",
                bytes.substr(0, bytes.size() / 2)});
    }
    disown(world);
  }

  /// One of the ways to write a path.
  std::string spelled(const std::string& path) {
    return pick({"./" + path, "foreign/../" + path, path + '/', path, path});
  }

  std::string input(const World& world) {
    return spelled(chance(0.85) ? world.kitti
                                : pick({world.out + "/clean", world.out, "link", "none",
                                        world.kitti + "/velodyne", "foreign"}));
  }

  std::string output(const World& world) {
    return spelled(chance(0.7)
                       ? world.out
                       : pick({"other", "link", "new/a", world.kitti, world.kitti + "/velodyne",
                               "foreign", world.kitti + "/labels", ""}));
  }

  void add_target(const World& world, Start& start, const std::string& flag) {
    start.targets.push_back(pick(
        {"map.ply", "map.pcd", "foreign/mine.ply", world.out + "/map.ply",
         world.out + "/dynamic_points.ply", "other/static_map.ply", "none/map.ply",
         world.kitti + "/poses.txt", world.out + "/labels/000000.label", world.out + "/report.json",
         "link/map.ply", world.kitti + "/velodyne/000000.bin", world.out + "/clean/000000.ply"}));
    start.arguments.insert(start.arguments.end(), {flag, start.targets.back()});
  }

  void run(const World& world, Start& start) {
    start.out = output(world);
    start.inputs = {input(world)};
    start.arguments = {"run", start.inputs[0], "--out", start.out};
    if (chance(0.6)) start.arguments.emplace_back("--force");
    if (chance(0.3)) add_target(world, start, "--map");
    const std::vector<Arguments> flags = {{"--write-online"},
                                          {"--write-clean"},
                                          {"--quiet"},
                                          {"--end", "2"},
                                          {"--window", "3"},
                                          {"--preset", "paper"},
                                          {"--poses", world.kitti + "/poses.txt"},
                                          {"--times", world.kitti + "/times.txt"},
                                          {"--config", world.kitti + "/run.cfg"},
                                          {"--build-map", "false"}};
    for (const Arguments& flag : flags) {
      if (!chance(0.08)) continue;
      start.arguments.insert(start.arguments.end(), flag.begin(), flag.end());
      if (is_below(flag.back(), world.kitti)) start.inputs.push_back(flag.back());
    }
  }

  void eval(const World& world, Start& start) {
    const std::string run = chance(0.8) ? world.out : "other";
    const bool online = chance(0.2);
    start.arguments = {"eval", spelled(world.kitti), spelled(run)};
    start.inputs = {world.kitti + "/velodyne", world.kitti + "/labels", world.kitti + "/poses.txt",
                    run + (online ? "/online" : "/labels")};
    if (online) start.arguments.emplace_back("--online");
    if (chance(0.6)) add_target(world, start, "--json");
    if (chance(0.3)) add_target(world, start, "--csv");
    if (chance(0.6)) start.arguments.emplace_back("--force");
  }

  const Parts& parts_;
  Random random_;
};

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
    std::string text;
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
    if (is_input(path)) return false;
    if (is_target(path) && command() == "eval") return true;
    if (!out_ || !is_below(path, *out_)) return false;
    const Kind kind = before_.at(path).kind;
    // A folder may be removed if it is empty or holds only files of the program.
    return kind == Kind::kFolder || (kind == Kind::kFile && world_.ours.count(path) > 0);
  }

  bool may_appear(const std::string& path) const {
    if (is_target(path)) return true;
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
    const std::size_t at = text.find(": error: ");
    if (failed && !is_check && (at == std::string::npos || text.size() < at + 23)) {
      return "no message";
    }
    return {};
  }

  std::string problem_of_result() const {
    if (!out_ || command() != "run") return {};
    const Claim claim = claim_of(below(after_, *out_));
    if (outcome_.code == 0) return claim == Claim::kComplete ? "" : "exit code 0, but not complete";
    // A call that failed after the new results were in place is an error, too.
    const bool is_disturbed = start_.full || !start_.closed.empty();
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
