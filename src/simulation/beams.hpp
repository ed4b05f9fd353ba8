// Directions in which a sensor measures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "simulation/config.hpp"
#include "simulation/vector.hpp"

namespace dynains::simulation {

/// Constants of a sensor type; angles in radians.
struct SensorTraits {
  int columns = 0;          ///< per turn; beams per scan for the rosette
  double height = 0;        ///< m, usual height over ground
  double max_range = 0;     ///< m
  double min_range = 0;     ///< m
  double dark_range = 0;    ///< m, where 10 % reflectivity is found nine times out of ten
  double yaw = 0;           ///< sensor x axis from the vehicle's forward direction
  double width = 2 * kPi;   ///< of the rings, around the x axis
  bool dome = false;        ///< without rings: all around instead of a rosette
  int lasers = 0;           ///< in turn, for beams without rings
  std::size_t packet = 12;  ///< columns that are sent together
};

struct SensorModel : SensorTraits {
  std::vector<double> elevations;  ///< of the rings, from the top; empty for the rosette

  /// Laser of the beam that is measured as number `i` of `columns` columns.
  int laser_of(std::size_t i, std::size_t measured_columns) const {
    return elevations.empty() ? static_cast<int>(i) % lasers
                              : static_cast<int>(i / measured_columns);
  }
};

/// `seed` determines the numbers of Sensor::kRings.
SensorModel sensor_model(Sensor sensor, std::uint64_t seed = 0);

/// Beams of one scan, grouped by direction so that all beams towards a small object are
/// contiguous row by row.
class BeamTable {
 public:
  static constexpr int kColumns = 720;  ///< cells of half a degree

  /// Columns of one turn: `first` to `last`, `last` excluded.
  struct Columns {
    int first = 0;
    int last = 0;
  };

  /// Beams of scan `scan` in these columns: every scan starts at another azimuth, every seed is
  /// another calibration, and the rosette never repeats.
  void fill(const SensorModel& model, std::uint64_t seed, std::size_t scan, Columns part);
  void fill(const SensorModel& model, std::uint64_t seed, std::size_t scan) {
    fill(model, seed, scan, {0, model.columns});
  }

  std::size_t size() const { return directions_.size(); }
  const Vec3& direction(std::size_t slot) const { return directions_[slot]; }
  /// Slots in the order of measurement.
  const std::vector<std::uint32_t>& measured_order() const { return slot_of_beam_; }
  /// First slot of a cell; cells of a row follow one another, azimuth from -pi.
  std::size_t first_slot(int row, int column) const {
    return first_[grid_index(row, column, kColumns)];
  }
  std::size_t last_slot(int row, int column) const {
    return first_[grid_index(row, column, kColumns) + 1];
  }
  static int row_of(double elevation);
  static int column_of(double azimuth);

 private:
  void add(double azimuth, double cos_elevation, double sin_elevation, int row);
  void add_free_beams(const SensorModel& model, std::size_t scan, Columns part);
  void add_rings(const SensorModel& model, std::uint64_t seed, std::size_t scan, Columns part);
  void sort_by_cell();

  std::vector<Vec3> unordered_;
  std::vector<std::uint32_t> cells_;
  std::vector<Vec3> directions_;
  std::vector<std::uint32_t> slot_of_beam_;
  std::vector<std::uint32_t> first_;
};

}  // namespace dynains::simulation
