// Verdicts in the files of a run, and while they wait outside of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dynains/recording/byte_store.hpp"
#include "judged_scan.hpp"

namespace dynains::run {

/// Files of verdicts in the folder of a run. All members throw IoError.
class VerdictFiles {
 public:
  /// `kind`: "labels", to which causes belong, or "online".
  explicit VerdictFiles(std::filesystem::path run, std::string kind = "labels",
                        bool has_beliefs = false)
      : run_(std::move(run)), kind_(std::move(kind)), has_beliefs_(has_beliefs) {}

  /// Folder of the label files.
  std::filesystem::path folder() const { return run_ / kind_; }
  /// The labels of the scan with this name.
  std::filesystem::path file(const std::string& name) const { return folder() / (name + ".label"); }

  void create_folders() const;
  void write(const std::string& name, const PackedVerdict& verdict) const;

  /// Labels of `count` points. Throws also for labels that no run writes.
  std::vector<std::uint32_t> labels(const std::string& name, std::size_t count) const;
  /// Causes and beliefs are empty if there is no file.
  PackedVerdict read(const std::string& name, std::size_t count) const;

 private:
  std::filesystem::path run_;
  std::string kind_;
  bool has_beliefs_;
};

/// Values of points that wait outside of memory, in a file without a name. All members throw
/// IoError.
class PointStore {
 public:
  /// The file is on the file system of `folder`.
  explicit PointStore(const std::filesystem::path& folder) : store_(folder) {}

  template <class Value>
  void add(const std::vector<Value>& values) {
    bytes_.clear();
    add_bytes(values.data(), values.size(), bytes_);
    places_.emplace_back(store_.append(bytes_), bytes_.size());
  }
  /// Those of call `number` of add(), from 0.
  template <class Value>
  void read(std::size_t number, std::vector<Value>& values) const {
    std::vector<std::uint8_t> bytes;
    store_.read(places_.at(number).first, places_[number].second, bytes);
    values.resize(bytes.size() / sizeof(Value));
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  }

 private:
  ByteStore store_;
  std::vector<std::pair<std::uint64_t, std::size_t>> places_;  // offsets and sizes
  std::vector<std::uint8_t> bytes_;
};

}  // namespace dynains::run
