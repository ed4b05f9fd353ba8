// Random folders of a user and random starts of the program in them, from a seed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "rehearsal.hpp"
#include "support/random.hpp"
#include "tree.hpp"

namespace dynains::test {

inline bool is_below(const std::string& path, const std::string& folder) {
  return path.rfind(folder + '/', 0) == 0;
}

/// Parts of a world, each relative to its own folder.
struct Parts {
  Tree kitti;       ///< a recording
  Tree clouds;      ///< a recording of .ply files
  Tree complete;    ///< results of run over kitti
  Tree unfinished;  ///< results of a run, marked as unfinished
  Tree simulated;   ///< results of simulate
};

struct World {
  Tree tree;
  std::set<std::string> ours;       ///< names of files that a marker beside or above them lists
  std::vector<std::string> locked;  ///< without permission to write
  std::string kitti, clouds, out, other, foreign;  ///< names of folders
};

/// A start of the program in the folder of the world.
struct Start {
  Arguments arguments;
  std::vector<std::string> inputs;   ///< files and folders that the arguments name as input
  std::string out;                   ///< of run and simulate
  std::vector<std::string> targets;  ///< files that the arguments name as output
  bool replaces = false;             ///< --force
  std::vector<int> closed;           ///< descriptors
  bool full = false;                 ///< standard output is full
  std::string fault;                 ///< as in shim.cpp
};

class WorldMaker {
 public:
  WorldMaker(const Parts& parts, std::size_t seed) : parts_(parts), random_(seed) {}

  World world() {
    World world = names();
    add(world, world.kitti, parts_.kitti, false);
    add(world, world.clouds, parts_.clouds, false);
    add(world, world.foreign, mine(), false);
    if (chance(0.7)) add(world, world.out, result(), true);
    if (chance(0.4)) add(world, world.other, result(), true);
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
      simulate(world, start);
    } else {
      start.arguments = pick<Arguments>(
          {{"check", input(world)}, {"config"}, {"config", "--markdown"}, {"--help"}, {}, {"rum"}});
    }
    if (chance(0.05)) start.arguments.push_back(pick<std::string>({"", "-1", "--", "nan", "--x"}));
    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      if (chance(0.06)) start.closed.push_back(descriptor);
    }
    start.full = chance(0.05);
    if (chance(0.2)) {
      const std::string error = pick<std::string>({"28", "5", "13", "24", "4"});
      // The program repeats an interrupted call, so that an endless EINTR would never end.
      const std::string how = error == "4" ? "once" : pick<std::string>({"once", "on"});
      start.fault = pick<std::string>({"open", "write", "read", "sync", "rename", "remove", "mkdir",
                                       "stat", "list", "lock", "close"}) +
                    ' ' + std::to_string(1 + random_.index(40)) + ' ' + error + ' ' + how;
    }
    return start;
  }

 private:
  bool chance(double share) { return random_.uniform(0.0, 1.0) < share; }
  template <class T>
  T pick(const std::vector<T>& from) {
    return from[random_.index(from.size())];
  }

  World names() {
    const std::string strange = chance(0.6)
                                    ? ""
                                    : pick<std::string>({" x", "\n", "\x1b[31m", ",\"", "\xc3\xb6",
                                                         "\xff", std::string(200, 'l'), ".tmp"});
    World world;
    world.kitti = "seq" + strange;
    world.clouds = "clouds";
    world.out = pick<std::string>({"out", "out", ".out", "-out"}) + (chance(0.3) ? strange : "");
    world.other = "other";
    world.foreign = "foreign";
    return world;
  }

  static Tree mine() {
    return {{"mine.txt", {Kind::kFile, "mine"}},
            {"mine.ply", {Kind::kFile, "ply, mine"}},
            {"000000.label", {Kind::kFile, "by hand"}}};
  }

  const Tree& result() {
    return *pick<const Tree*>(
        {&parts_.complete, &parts_.complete, &parts_.unfinished, &parts_.simulated});
  }

  static void add(World& world, const std::string& folder, const Tree& part, bool ours) {
    erase(world, folder);
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

  /// Removes the paths below the folder from `ours`.
  static void disown(World& world, const std::string& folder) {
    for (auto name = world.ours.begin(); name != world.ours.end();) {
      name = is_below(*name, folder) ? world.ours.erase(name) : std::next(name);
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

  /// A name of a file or folder of the program in OUT.
  std::string name_in_out(const World& world) {
    return world.out + '/' +
           pick<std::string>({"report.json", "static_map.ply", "dynamic_points.ply", "timing.csv",
                              "labels", "causes", "clean", "online", "velodyne", "simulation.json",
                              "labels/000000.label", "causes/000001.cause", "clean/000000.bin",
                              "poses.txt"});
  }

  void change(World& world) {
    const std::string name = name_in_out(world);
    const std::string up(static_cast<std::size_t>(std::count(name.begin(), name.end(), '/')), '.');
    std::string above;
    for (std::size_t i = 0; i < up.size(); ++i) above += "../";
    switch (random_.index(9)) {
      case 0:
        return put(world, name, {Kind::kFile, "mine"});
      case 1:
        put(world, name, {Kind::kFolder, {}});
        return put(world, name + "/mine.txt", {Kind::kFile, "mine"});
      case 2:
        return put(world, name,
                   {Kind::kLink, above + world.foreign +
                                     pick<std::string>({"", "/mine.txt", "/mine.ply", "/none"})});
      case 3:
        return put(world,
                   world.out + '/' +
                       pick<std::string>({"notes.txt", ".notes.2024.tmp", "labels/mine.txt",
                                          "labels/.x.0123456789abcdef.tmp", "a/b/c.txt"}),
                   {Kind::kFile, "mine"});
      case 4:
        disown(world, world.out);
        return put(world, world.out,
                   {Kind::kLink, pick<std::string>({world.other, world.foreign, world.kitti,
                                                    "nothing", world.out})});
      case 5:
        return damage_marker(world);
      case 6:
        return damage_input(world);
      case 7:
        world.locked.push_back(pick<std::string>({world.out, world.out + "/labels", name, "."}));
        return;
      default:
        return put(
            world, "link",
            {Kind::kLink, pick<std::string>({world.out, world.kitti, world.kitti + "/velodyne"})});
    }
  }

  /// Damages the markers, so that no result in OUT belongs to the program.
  void damage_marker(World& world) {
    const std::string program = "{\"program\": \"dynains\"";
    for (const char* marker : {"/report.json", "/simulation.json"}) {
      const std::string path = world.out + marker;
      if (world.tree.count(path) == 0 || world.tree[path].kind != Kind::kFile) continue;
      const std::string bytes = pick<std::string>(
          {"", "{}", "[", "null", std::string(50000, '['), "{\"a\":" + std::string(300, '['),
           program + "}", program + ", \"complete\": true}", program + ", \"files\": 3}",
           program + ", \"complete\": true, \"files\": [\"../" + world.foreign + "/mine.txt\"]}",
           world.tree[path].bytes.text().substr(0, world.tree[path].bytes.size() / 2)});
      world.tree[path].bytes = bytes;
    }
    disown(world, world.out);
  }

  void damage_input(World& world) {
    const std::string path =
        world.kitti + pick<std::string>({"/velodyne/000001.bin", "/poses.txt", "/times.txt",
                                         "/labels/000000.label", "/run.cfg"});
    const std::string bytes = world.tree[path].bytes.text();
    erase(world, path);
    switch (random_.index(4)) {
      case 0:
        return;
      case 1:
        return put(world, path, {Kind::kFile, bytes.substr(0, random_.index(bytes.size() + 1))});
      case 2:
        return put(world, path, {Kind::kFolder, {}});
      default:
        return put(world, path, {Kind::kFile, std::string(7, '\0') + bytes});
    }
  }

  /// One of the ways to write a path.
  std::string spelled(const std::string& path) {
    switch (random_.index(5)) {
      case 0:
        return "./" + path;
      case 1:
        return "foreign/../" + path;
      case 2:
        return path + '/';
      default:
        return path;
    }
  }

  std::string input(const World& world) {
    return spelled(chance(0.85)
                       ? pick<std::string>({world.kitti, world.kitti, world.clouds})
                       : pick<std::string>({world.out + "/clean", world.out, "link", "none",
                                            world.kitti + "/velodyne", world.foreign}));
  }

  std::string output(const World& world) {
    return spelled(chance(0.7) ? world.out
                               : pick<std::string>({world.other, "link", "new/a", world.kitti,
                                                    world.kitti + "/velodyne", world.foreign,
                                                    world.clouds, world.kitti + "/labels", ""}));
  }

  std::string target(const World& world) {
    return pick<std::string>({"map.ply", "map.pcd", "foreign/mine.ply", world.out + "/map.ply",
                              world.out + "/dynamic_points.ply", world.other + "/static_map.ply",
                              world.clouds + "/a.ply", "none/map.ply", world.kitti + "/poses.txt",
                              world.out + "/labels/000000.label", world.out + "/report.json",
                              "link/map.ply", world.kitti + "/velodyne/000000.bin",
                              world.out + "/clean/000000.ply"});
  }

  void add_target(const World& world, Start& start, const std::string& flag) {
    start.targets.push_back(target(world));
    start.arguments.insert(start.arguments.end(), {flag, start.targets.back()});
  }

  void run(const World& world, Start& start) {
    start.out = output(world);
    start.inputs = {input(world)};
    start.arguments = {"run", start.inputs[0], "--out", start.out};
    if (chance(0.6)) {
      start.arguments.emplace_back("--force");
      start.replaces = true;
    }
    if (chance(0.3)) add_target(world, start, "--map");
    const std::vector<Arguments> flags = {{"--write-online"},
                                          {"--write-clean"},
                                          {"--quiet"},
                                          {"--end", "2"},
                                          {"--start", "1"},
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
    const std::string run = chance(0.8) ? world.out : world.other;
    const bool online = chance(0.2);
    start.arguments = {"eval", spelled(world.kitti), spelled(run)};
    start.inputs = {world.kitti + "/velodyne", world.kitti + "/labels", world.kitti + "/poses.txt",
                    run + (online ? "/online" : "/labels")};
    if (online) start.arguments.push_back("--online");
    if (chance(0.6)) add_target(world, start, "--json");
    if (chance(0.3)) add_target(world, start, "--csv");
    if (chance(0.2)) start.arguments.push_back("--errors");
  }

  void simulate(const World& world, Start& start) {
    start.out = output(world);
    start.arguments = {"simulate",       start.out,     "--scans=1",    "--scene=car-park",
                       "--sensor=vlp16", "--traffic=0", "--max-range=1"};
    start.replaces = chance(0.6);
    if (start.replaces) start.arguments.push_back("--force");
  }

  const Parts& parts_;
  Random random_;
};

}  // namespace dynains::test
