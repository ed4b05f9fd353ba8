// Writer of point clouds in LAS files.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "dynains/io/atomic_file.hpp"

namespace dynains {

/// Classes of ASPRS that maps use.
enum class LasClass : std::uint8_t { kUnclassified = 1, kGround = 2 };

/// One point of a map.
struct LasPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, world frame
  std::uint16_t intensity = 0;
  LasClass classification = LasClass::kUnclassified;
  double time = 0.0;           ///< s, in the field of the time of GPS
  float belief = 0.0F;         ///< extra bytes `belief`: probability of being dynamic, [0, 1]
  std::uint8_t cause = 0;      ///< extra bytes `cause`: see Cause
  std::uint32_t instance = 0;  ///< extra bytes `instance`: 0 for none
};

struct LasOptions {
  /// Origin of the integer coordinates, m. Points are within 2,147 km of it.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double scale = 0.001;  ///< m, step of the coordinates
  std::string wkt;       ///< coordinate reference system as WKT (OGC 01-009); empty: none
};

/// Writes LAS 1.4 with point format 6, point by point, without points in memory. `commit()` creates
/// or replaces the file atomically. All members throw IoError.
class LasWriter {
 public:
  explicit LasWriter(const std::filesystem::path& path, const LasOptions& options = {});

  /// Adds one point. Throws IoError for a position that is not finite or out of range.
  void add(const LasPoint& point);
  std::size_t size() const { return size_; }
  /// Puts the file in place, unless it was not written completely.
  void commit(AtomicFile::Sync sync = AtomicFile::Sync::kNow);

 private:
  std::string header() const;

  std::filesystem::path path_;
  LasOptions options_;
  std::size_t size_ = 0;
  std::array<std::int32_t, 3> least_{}, most_{};  ///< of the integer coordinates
  AtomicFile file_;
};

}  // namespace dynains
