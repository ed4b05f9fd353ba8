// Power cuts at every moment of a run, for every state of the file system in the model below.
// Afterwards each output is absent or complete. Other files are unchanged. A restart gives the
// bytes of an undisturbed run.
#include <fcntl.h>

#include "rehearsal.hpp"
#include "shim/log.hpp"
#include "support/standard.hpp"
#include "tree.hpp"

namespace dynains::test {
namespace {

// States of a file system after a power cut, computed from the recorded calls of a program.
//
// Names (files and folders that were created, renamed or removed): each folder loses all its
// changes after some moment since its last sync. A change of two folders is kept in both or lost in
// both. The contents of a lost folder are lost. Folders lose changes independently of each other.
// This model permits more losses than ext4 and xfs, whose journals keep one order for a whole file
// system.
//
// Data (bytes and size of a file): each write since the last sync of the file is kept, lost, kept
// up to some byte or replaced by zeros, independently of other writes and of names. A new name can
// lead to no data, even if it replaced a complete file.
//
// fsync of a file keeps its data. fsync of a folder keeps its names and the folder itself. syncfs
// keeps everything before the call. Each folder at the top of the root is a separate file
// system.

/// Loss of unsynced changes. kMixed chooses one of the others for each folder or file.
enum class NameLoss { kNothing, kAll, kTail, kMixed };
enum class DataLoss { kNothing, kAll, kZeros, kTorn, kMixed };

struct Crash {
  std::size_t length;  ///< number of events before the power cut
  NameLoss names;
  DataLoss data;
  unsigned seed;
};

class CrashModel {
 public:
  /// `before` is the content of the disk before the first event. Events are below `root`.
  CrashModel(const Tree& before, const std::vector<shim::Entry>& events, const std::string& root)
      : root_(root) {
    nodes_.push_back({Kind::kFolder, {}, 0, {}, {}});
    for (const auto& [path, item] : before) {
      const Place at = place_of(path);
      set_name(names_, {at.folder, at.name, add_node(item.kind, item.bytes, at.folder)});
    }
    before_ = names_;
    for (const shim::Entry& event : events) take(event);
  }

  /// Events that changed or synced something.
  std::size_t size() const { return size_; }

  Tree after(const Crash& crash) const {
    std::mt19937 random(crash.seed);
    const Names names = names_after(crash, random);
    Tree tree;
    add_contents(tree, names, 0, {}, [&](const Node& node) {
      return node.kind == Kind::kFile ? data_after(node, crash, random) : node.bytes;
    });
    return tree;
  }

 private:
  using NodeId = std::size_t;
  static constexpr NodeId kNone = static_cast<NodeId>(-1);
  using Names = std::map<NodeId, std::map<std::string, NodeId>>;  ///< contents of each folder

  struct Write {
    std::size_t at;
    std::size_t offset;
    std::string bytes;
    bool cuts = false;  ///< the file ends at the offset
  };
  /// By write: how the disk loses its bytes, and the number of bytes that reach it.
  using Fates = std::vector<std::pair<DataLoss, std::size_t>>;
  /// A file, a folder or a link, independent of its name.
  struct Node {
    Kind kind;
    Bytes bytes;  ///< before the first event
    NodeId file_system;
    std::vector<Write> writes;
    std::vector<std::size_t> syncs;          ///< events
    mutable std::map<Fates, Bytes> known{};  ///< contents after some fates of the writes
  };
  struct Place {
    NodeId folder;
    std::string name;
  };
  /// The name leads to the node, or to no node.
  struct Naming {
    NodeId folder;
    std::string name;
    NodeId node;
  };
  struct NameChange {
    std::size_t at;
    std::vector<Naming> namings;
    std::vector<NodeId> folders;  ///< each of them keeps the change, or each loses it
  };

  static void set_name(Names& names, const Naming& naming) {
    if (naming.node == kNone) {
      names[naming.folder].erase(naming.name);
    } else {
      names[naming.folder][naming.name] = naming.node;
    }
  }

  NodeId add_node(Kind kind, const Bytes& bytes, NodeId folder) {
    const NodeId id = nodes_.size();
    nodes_.push_back({kind, bytes, folder == 0 ? id : nodes_[folder].file_system, {}, {}});
    return id;
  }

  NodeId find(const std::string& path) {
    if (path.empty()) return 0;
    const Place at = place_of(path);
    const auto found = names_[at.folder].find(at.name);
    return found == names_[at.folder].end() ? kNone : found->second;
  }
  /// Relative to the root. Throws if the folder is not there.
  Place place_of(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    const NodeId folder = slash == std::string::npos ? 0 : find(path.substr(0, slash));
    if (folder == kNone) throw std::runtime_error(path + " has no folder in the model");
    return {folder, path.substr(slash + 1)};
  }
  std::string relative(const std::string& path) const {
    if (path.compare(0, root_.size(), root_) != 0) throw std::runtime_error(path + ": not below");
    return path.size() == root_.size() ? std::string() : path.substr(root_.size() + 1);
  }

  void take(const shim::Entry& event) {
    switch (event.event) {
      case shim::Event::kOpen:
        return open(event);
      case shim::Event::kWrite:
        nodes_[open_.at(event.descriptor)].writes.push_back(
            {size_++, static_cast<std::size_t>(event.number), event.second});
        return;
      case shim::Event::kSync:
        nodes_[open_.at(event.descriptor)].syncs.push_back(size_++);
        return;
      case shim::Event::kSyncAll:
        for (Node& node : nodes_) {
          if (node.file_system == nodes_[open_.at(event.descriptor)].file_system) {
            node.syncs.push_back(size_);
          }
        }
        ++size_;
        return;
      case shim::Event::kFault:
        return;
      default:
        return change_names(event);
    }
  }

  void open(const shim::Entry& event) {
    const std::string path = relative(event.path);
    NodeId node = find(path);
    if (node == kNone) {
      const Place at = place_of(path);
      node = add_node(Kind::kFile, {}, at.folder);
      record({{at.folder, at.name, node}}, {at.folder});
    } else if ((event.number & O_TRUNC) != 0) {
      nodes_[node].writes.push_back({size_++, 0, {}, true});
    }
    open_[event.descriptor] = node;
  }

  void change_names(const shim::Entry& event) {
    const NodeId node = find(relative(event.path));
    const Place at = place_of(relative(event.path));
    if (event.event == shim::Event::kMakeFolder) {
      const NodeId folder = add_node(Kind::kFolder, {}, at.folder);
      return record({{at.folder, at.name, folder}}, {at.folder, folder});
    }
    if (event.event == shim::Event::kRemove) {
      return record({{at.folder, at.name, kNone}}, {at.folder, node});
    }
    const NodeId replaced = find(relative(event.second));
    const Place to = place_of(relative(event.second));
    const bool swaps = event.event == shim::Event::kExchange;
    record({{at.folder, at.name, swaps ? replaced : kNone}, {to.folder, to.name, node}},
           {at.folder, to.folder});
  }

  void record(const std::vector<Naming>& namings, const std::vector<NodeId>& folders) {
    for (const Naming& naming : namings) set_name(names_, naming);
    changes_.push_back({size_++, namings, folders});
  }

  /// Changes before this moment are on the disk for certain.
  static std::size_t last_sync(const Node& node, const Crash& crash) {
    const auto after = std::lower_bound(node.syncs.begin(), node.syncs.end(), crash.length);
    return after == node.syncs.begin() ? 0 : *(after - 1);
  }

  /// The first change that each folder loses.
  std::vector<std::size_t> cuts(const Crash& crash, std::mt19937& random) const {
    std::vector<std::size_t> synced(nodes_.size());
    std::transform(nodes_.begin(), nodes_.end(), synced.begin(),
                   [&](const Node& node) { return last_sync(node, crash); });
    // A change that one folder keeps for certain is kept by the other folder, too.
    for (auto change = changes_.rbegin(); change != changes_.rend(); ++change) {
      const auto is_safe = [&](NodeId folder) { return synced[folder] > change->at; };
      if (std::none_of(change->folders.begin(), change->folders.end(), is_safe)) continue;
      for (const NodeId folder : change->folders) {
        synced[folder] = std::max(synced[folder], change->at + 1);
      }
    }
    for (std::size_t& cut : synced) {
      NameLoss loss = crash.names;
      if (loss == NameLoss::kMixed) loss = static_cast<NameLoss>(random() % 3);
      if (loss == NameLoss::kNothing) cut = crash.length;
      if (loss == NameLoss::kTail) cut += random() % (crash.length - cut + 1);
    }
    return synced;
  }

  Names names_after(const Crash& crash, std::mt19937& random) const {
    Names names = before_;
    std::vector<std::size_t> cut = cuts(crash, random);
    for (const NameChange& change : changes_) {
      const auto is_lost = [&](NodeId folder) { return cut[folder] <= change.at; };
      if (std::any_of(change.folders.begin(), change.folders.end(), is_lost)) {
        for (const NodeId folder : change.folders) cut[folder] = std::min(cut[folder], change.at);
      } else {
        for (const Naming& naming : change.namings) set_name(names, naming);
      }
    }
    return names;
  }

  static Bytes data_after(const Node& node, const Crash& crash, std::mt19937& random) {
    const std::size_t synced = last_sync(node, crash);
    DataLoss of_file = crash.data;
    if (of_file == DataLoss::kMixed) of_file = static_cast<DataLoss>(random() % 4);
    Fates fates;
    for (const Write& write : node.writes) {
      if (write.at >= crash.length) break;
      DataLoss loss = write.at < synced ? DataLoss::kNothing : of_file;
      std::size_t kept = write.bytes.size();
      if (loss == DataLoss::kTorn) {
        loss = static_cast<DataLoss>(random() % 4);
        if (loss == DataLoss::kTorn) kept = random() % (kept + 1);
      }
      fates.push_back({loss, kept});
    }
    const auto known = node.known.find(fates);
    if (known != node.known.end()) return known->second;
    return node.known[fates] = data_after(node, fates);
  }

  static std::string data_after(const Node& node, const Fates& fates) {
    std::string bytes = node.bytes.text();
    for (std::size_t i = 0; i < fates.size(); ++i) {
      const Write& write = node.writes[i];
      const auto [loss, kept] = fates[i];
      if (loss == DataLoss::kAll) continue;
      std::string written = write.bytes.substr(0, kept);
      if (loss == DataLoss::kZeros) written.assign(written.size(), '\0');
      if (write.cuts) {
        bytes.resize(write.offset);
      } else {
        bytes.resize(std::max(bytes.size(), write.offset + written.size()));
        bytes.replace(write.offset, written.size(), written);
      }
    }
    return bytes;
  }

  template <class BytesOf>
  void add_contents(Tree& tree, const Names& names, NodeId folder, const std::string& prefix,
                    const BytesOf& bytes_of) const {
    const auto contents = names.find(folder);
    if (contents == names.end()) return;
    for (const auto& [name, id] : contents->second) {
      const Node& node = nodes_[id];
      tree[prefix + name] = {node.kind, bytes_of(node)};
      if (node.kind == Kind::kFolder) {
        add_contents(tree, names, id, prefix + name + '/', bytes_of);
      }
    }
  }

  std::string root_;
  std::vector<Node> nodes_;  ///< the root first
  std::vector<NameChange> changes_;
  std::map<int, NodeId> open_;
  Names before_;
  Names names_;  ///< after the events taken so far
  std::size_t size_ = 0;
};

struct State {
  Crash crash;
  Tree tree;
};

/// Distinct states: for each moment the plain losses, then mixtures.
std::vector<State> crash_states(const CrashModel& model) {
  constexpr unsigned kMixtures = 128;
  std::vector<State> states;
  std::set<std::size_t> known;
  const auto add = [&](const Crash& crash) {
    Tree tree = model.after(crash);
    if (known.insert(fingerprint(tree)).second) states.push_back({crash, std::move(tree)});
  };
  for (std::size_t length = 0; length <= model.size(); ++length) {
    for (const NameLoss names : {NameLoss::kNothing, NameLoss::kAll, NameLoss::kTail}) {
      for (const DataLoss data :
           {DataLoss::kNothing, DataLoss::kAll, DataLoss::kZeros, DataLoss::kTorn}) {
        add({length, names, data, static_cast<unsigned>(length)});
      }
    }
    for (unsigned seed = 0; seed < kMixtures; ++seed) {
      add({length, NameLoss::kMixed, DataLoss::kMixed, seed});
    }
  }
  return states;
}

/// Whether the test detects a program that never syncs.
bool needs_syncs(const Rehearsal& rehearsal) {
  std::vector<shim::Entry> events = rehearsal.events();
  events.erase(std::remove_if(events.begin(), events.end(),
                              [](const shim::Entry& entry) {
                                return entry.event == shim::Event::kSync ||
                                       entry.event == shim::Event::kSyncAll;
                              }),
               events.end());
  const CrashModel model(rehearsal.before(), events, rehearsal.root());
  const std::vector<State> states = crash_states(model);
  return std::any_of(states.begin(), states.end(),
                     [&](const State& state) { return !rehearsal.problem(state.tree).empty(); });
}

void check_crashes(const Scenario& scenario) {
  Rehearsal rehearsal(scenario);
  const CrashModel model(rehearsal.before(), rehearsal.events(), rehearsal.root());
  // A difference means that the shim missed a change.
  const Tree end = model.after({model.size(), NameLoss::kNothing, DataLoss::kNothing, 0});
  REQUIRE(difference(end, rehearsal.after()) == "");

  CHECK(needs_syncs(rehearsal));

  const std::vector<State> states = crash_states(model);
  constexpr std::size_t kRestarts = DYNAINS_CRASH_STATES;
  const std::size_t step = (states.size() + kRestarts - 1) / kRestarts;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Crash& crash = states[i].crash;
    CAPTURE(crash.length, int(crash.names), int(crash.data), crash.seed);
    CHECK(rehearsal.problem(states[i].tree) == "");
    if (i % step == 0) CHECK(rehearsal.problem_after_restart(states[i].tree) == "");
  }
  WARN(model.size() << " events, " << states.size() << " different states, started again from "
                    << (states.size() + step - 1) / step);
}

}  // namespace

TEST_CASE("power cut during a run") { check_crashes(fresh_run({})); }

TEST_CASE("power cut during a run that writes all outputs") {
  check_crashes(fresh_run({"--write-online", "--write-clean"}));
}

TEST_CASE("power cut during a run with its map in another folder") {
  check_crashes(fresh_run({"--map", "/maps/map.ply"}));
}

TEST_CASE("power cut while a result is replaced") {
  check_crashes(replacing_run({"--write-online", "--write-clean"}, {}));
}

TEST_CASE("power cut while a result with its map in another folder is replaced") {
  check_crashes(replacing_run({"--map", "/maps/map.ply"}, {"--map", "/maps/map.ply"}));
}

TEST_CASE("power cut while a session of a map is moved to corrected poses") {
  check_crashes(moved_session());
}

TEST_CASE("power cut during a simulation") { check_crashes(simulation()); }

TEST_CASE("power cut while a simulation is replaced") { check_crashes(replacing_simulation()); }

}  // namespace dynains::test
