// Final verdicts, packed, what takes them, and their files and stores.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/verdict.hpp"

namespace dynains::run {

/// Class ids that `dynains run` writes (SemanticKITTI-MOS).
enum RunClass : std::uint32_t { kRunNotJudged = 0, kRunStatic = 9, kRunMoving = 251 };

/// Without branches, for vectors.
constexpr std::uint32_t mos_class(PointLabel label) {
  static_assert(kRunNotJudged == 0);
  return kRunMoving * std::uint32_t{label == PointLabel::kDynamic} +
         kRunStatic * std::uint32_t{is_static(label)};
}

/// Lower 16 bits: class id. Upper 16 bits: instance, 0 for none; ids beyond 65535 start again at 1.
std::uint32_t mos_label(PointLabel label, std::uint32_t instance);
constexpr std::uint32_t class_of(std::uint32_t label) { return label & 0xffffU; }
constexpr std::uint32_t instance_of(std::uint32_t label) { return label >> 16U; }

/// The verdict on a scan as the files of a run hold it.
struct PackedVerdict {
  std::vector<std::uint32_t> labels;  ///< mos_label()
  std::vector<std::uint8_t> causes;   ///< may be empty
  std::vector<std::uint8_t> beliefs;  ///< 255 is a belief of 1; may be empty

  void pack_labels(const ScanVerdict& verdict);
  void pack(const ScanVerdict& verdict, bool with_beliefs);
  /// Ids as far as labels hold them; Cause::kUnknown without causes. `scan`: of the verdict.
  void unpack(const RecordedScan& scan, VerdictArrays& verdict) const;
};

/// A scan with its final verdict.
struct JudgedScan {
  std::size_t index = 0;  ///< in the recording
  RecordedScan scan;
  PointBuffer points;  ///< of the scan
  VerdictArrays arrays;
  ScanVerdict verdict;               ///< with these arrays
  PackedVerdict packed;              ///< of the verdict
  std::vector<std::uint32_t> truth;  ///< labels of the recording, see RunResults::add()
};

/// Takes the final verdicts of a run, in the order of the scans. Throws IoError.
using Sink = std::function<void(const JudgedScan& judged)>;

/// Calls `visit(i)` for each point with the label kDynamic, in their order. They are few: the time
/// is that of a search for bytes.
template <class Visit>
void for_each_moving(Span<const PointLabel> labels, Visit&& visit) {
  static_assert(sizeof(PointLabel) == 1);
  const PointLabel* const first = labels.data();
  const PointLabel* const last = first + labels.size();
  for (const PointLabel* next = first; next != last; ++next) {
    next = static_cast<const PointLabel*>(std::memchr(next, static_cast<int>(PointLabel::kDynamic),
                                                      static_cast<std::size_t>(last - next)));
    if (next == nullptr) return;
    visit(static_cast<std::size_t>(next - first));
  }
}

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
