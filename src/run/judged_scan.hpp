// A final verdict, packed, and what takes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
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

}  // namespace dynains::run
