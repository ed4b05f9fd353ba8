// A part of a recording whose scans test each other.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/places.hpp"
#include "dynains/recording/references.hpp"
#include "dynains/recording/static_policy.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

struct SecondPassConfig {
  StaticPolicy static_policy = StaticPolicy::kAlways;
  /// Bytes of places and ground in memory, unless those near the sensor take more.
  std::size_t memory = std::size_t{160} << 20U;
  /// By sensor, its pose in the frame of the points, m: RemoverConfig::sensors.
  std::vector<Pose> sensors = {Pose::Identity()};
  /// Configuration of the first pass: its margins also hold for the second pass, and its lookback
  /// and lookahead determine which scans it has compared.
  FreeSpaceConfig evidence;
};

/// Numbers of points that were removed, and that were restored.
struct RevisedPoints {
  std::uint64_t removed = 0, restored = 0;
};

/// Scans whose poses fit to each other. All of them test the places of their points above the
/// ground. Points of objects that came or left are removed (see RecordingPlaces), removed ground is
/// restored. Scans of the visit are numbered from 0. Functions throw IoError if the store fails.
class Visit {
 public:
  /// `store` holds packed references, and places and ground far from the sensor; it must outlive
  /// this object.
  Visit(ByteStore& store, const SecondPassConfig& config);

  /// Takes the next scan with its first verdict. `points`: m, sensor frame, all of the scan.
  /// `sensor_of`: by point; empty: the first sensor.
  void add(PointsView points, const ScanVerdict& verdict, Span<const std::uint8_t> sensor_of);
  /// Moves all data into the store.
  void rest();
  /// Tests all places. Returns false, without a result, as soon as `keep_going()` does.
  bool test(const std::function<bool()>& keep_going);
  /// Revises the first verdict on a scan, after test().
  RevisedPoints revise(PointsView points, std::uint32_t number, VerdictArrays& verdict);

  std::uint32_t scans() const { return static_cast<std::uint32_t>(scans_.size()); }
  /// Scans of the recording from the first one of the visit to the last one.
  std::uint32_t length() const { return last_ - first_ + 1; }
  /// Whether the first pass has doubted a scan: its poses, rays or units.
  bool is_suspicious() const { return is_suspicious_; }
  std::size_t place_count() const { return places_.size(); }

 private:
  struct Scan {
    Pose T_level_sensor;  // as it was compared
    std::uint16_t epoch;
  };
  struct Reference {
    std::uint32_t scan;
    std::size_t sensor;
    std::uint64_t offset;  // in the store
    std::size_t size;      // bytes
  };
  void keep_reference(std::size_t sensor, PointsView points, Span<const PointLabel> labels);
  void select_own(std::size_t sensor, PointsView points, Span<const PointLabel> labels,
                  Span<const std::uint8_t> sensor_of);
  bool belongs_to_object(PointLabel label, const Eigen::Vector3d& point);
  bool restore(std::size_t i, bool stands, const Eigen::Vector3d& point, VerdictArrays& verdict);

  SecondPassConfig config_;
  ByteStore& store_;
  RecordingPlaces places_;
  std::deque<RecordingReferences> references_;  // by sensor
  Pose T_level_world_ = Pose::Identity();       // z up, origin and heading of the first sensor
  Epochs epochs_;
  std::vector<Scan> scans_;
  std::uint32_t first_ = 0, last_ = 0;  // scans of the recording
  bool is_suspicious_ = false;
  std::vector<Reference> kept_;
  std::vector<std::uint8_t> packed_;
  PointBuffer own_;  // points of one of several sensors, in its frame
  std::vector<PointLabel> own_labels_;
};

}  // namespace dynains
