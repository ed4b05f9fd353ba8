// A folder with all its contents, as a value.
#pragma once

#include "io/files.hpp"
#include "support/standard.hpp"

namespace dynains::test {

// Contents of a file that many trees share.

/// Immutable bytes. Copies share them, and most comparisons need only their hash.
class Bytes {
 public:
  Bytes() = default;
  Bytes(std::string text)
      : text_(std::make_shared<const std::string>(std::move(text))),
        hash_(std::hash<std::string>()(*text_)) {}
  Bytes(const char* text) : Bytes(std::string(text)) {}

  const std::string& text() const { return *text_; }
  std::size_t size() const { return text_->size(); }
  /// Different for different bytes.
  std::size_t hash() const { return hash_; }

  bool operator==(const Bytes& other) const {
    return text_ == other.text_ || (hash_ == other.hash_ && *text_ == *other.text_);
  }

 private:
  static const std::shared_ptr<const std::string>& nothing() {
    static const auto text = std::make_shared<const std::string>();
    return text;
  }

  std::shared_ptr<const std::string> text_ = nothing();
  std::size_t hash_ = std::hash<std::string>()({});
};

enum class Kind { kFolder, kFile, kLink };

/// Bytes of a file, target of a link, nothing for a folder.
struct Item {
  Kind kind;
  Bytes bytes;

  bool operator==(const Item& other) const { return kind == other.kind && bytes == other.bytes; }
  bool operator!=(const Item& other) const { return !(*this == other); }
};

/// Items by their path relative to the folder, which is not in it. A folder precedes its contents.
using Tree = std::map<std::string, Item>;

inline Tree read_tree(const std::filesystem::path& folder) {
  Tree tree;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    Item item{Kind::kFile, {}};
    if (entry.is_symlink()) {
      item = {Kind::kLink, fs::read_symlink(entry.path()).string()};
    } else if (entry.is_directory()) {
      item.kind = Kind::kFolder;
    } else if (entry.is_regular_file()) {
      item.bytes = read_text(entry.path());
    }
    tree[entry.path().string().substr(folder.string().size() + 1)] = item;
  }
  return tree;
}

/// Replaces the contents of the folder by the tree.
inline void write_tree(const std::filesystem::path& folder, const Tree& tree) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [name, item] : tree) {
    if (item.kind == Kind::kFolder) fs::create_directory(folder / name);
    if (item.kind == Kind::kLink) fs::create_symlink(item.bytes.text(), folder / name);
    if (item.kind == Kind::kFile) {
      std::ofstream(folder / name, std::ios::binary) << item.bytes.text();
    }
  }
}

/// Items of the tree below the folder, by their path relative to it.
inline Tree below(const Tree& tree, const std::string& folder) {
  Tree part;
  const std::string prefix = folder + '/';
  for (auto item = tree.lower_bound(prefix);
       item != tree.end() && item->first.compare(0, prefix.size(), prefix) == 0; ++item) {
    part[item->first.substr(prefix.size())] = item->second;
  }
  return part;
}

/// Empty folders are no results. A failed command may leave them.
inline Tree without_empty_folders(Tree tree) {
  for (auto item = tree.begin(); item != tree.end();) {
    const bool empty = item->second.kind == Kind::kFolder && below(tree, item->first).empty();
    item = empty ? tree.erase(item) : std::next(item);
  }
  return tree;
}

/// Different for different trees.
inline std::size_t fingerprint(const Tree& tree) {
  std::string all;
  for (const auto& [name, item] : tree)
    all += name + '\0' + std::to_string(item.bytes.hash()) + '\0';
  return std::hash<std::string>()(all);
}

/// Text about the first difference; empty if there is none.
inline std::string difference(const Tree& found, const Tree& expected) {
  for (const auto& [name, item] : expected) {
    const auto other = found.find(name);
    if (other == found.end()) return name + " is missing";
    if (other->second != item) {
      return name + " has other contents (" + std::to_string(other->second.bytes.size()) +
             " bytes, not " + std::to_string(item.bytes.size()) + ')';
    }
  }
  for (const auto& [name, item] : found) {
    if (expected.count(name) == 0) return name + " should not be there";
  }
  return {};
}

}  // namespace dynains::test
