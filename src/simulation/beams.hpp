// Directions in which a sensor measures.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "simulation/config.hpp"
#include "simulation/random.hpp"
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

inline constexpr double kDegree = kPi / 180;

/// `count` elevations from `top` downwards, degrees.
struct Rings {
  double top = 0, step = 0;
  int count = 0;
};

struct KnownSensor {
  SensorTraits traits;
  Rings rings[6];
};

/// Sensors in the order of their names, but the last.
inline const KnownSensor& known_sensor(Sensor sensor) {
  static constexpr KnownSensor sensors[] = {
      {{2083, 1.73, 120, 0.9, 50}, {{2.0, 1.0 / 3.0, 32}, {-8.83, 0.5, 32}}},
      {{1800, 1.2, 100, 0.5, 40}, {{15, 2, 16}}},
      {{2083, 1.85, 100, 0.9, 45}, {{10.67, 4.0 / 3.0, 32}}},
      {{1024, 1.5, 100, 0.5, 45}, {{22.5, 45.0 / 63, 64}}},
      {{1024, 1.5, 50, 0.3, 20}, {{45, 90.0 / 127, 128}}},
      {{1800, 1.85, 150, 0.9, 80, kPi / 2},
       {{15, 4, 2}, {8, 3, 2}, {3, 0, 1}, {2, 1.0 / 6.0, 48}, {-6, 1, 9}, {-19, 6, 2}}},
      {{30000, 1.2, 100, 0.5, 60, 0, 2 * kPi, false, 6, 96}, {}},
      {{20000, 0.6, 70, 0.3, 40, 0, 2 * kPi, true, 4, 96}, {}},
      {{630, 1.6, 150, 0.5, 70, 0, 120 * kDegree}, {{12.5, 0.2, 126}}},
  };
  return sensors[static_cast<std::size_t>(sensor)];
}

/// A sensor with rings as it may be built: number of beams, field of view, spacing, range.
inline void draw_rings(SensorModel& model, Random random) {
  const int numbers[] = {16, 32, 32, 40, 64, 64, 80, 128}, columns[] = {900, 1024, 1800, 2048};
  const int beams = numbers[random.index(std::size(numbers))];
  const double shape = random.unit();
  const bool wide = shape < 0.25, even = shape < 0.6;  // sensors for indoors, symmetric, for cars
  const double top = wide   ? random.uniform(22, 45)
                     : even ? random.uniform(10, 22.5)
                            : random.uniform(2, 15);
  const double bottom = even ? -top : -random.uniform(16, 30);
  const double gather = random.chance(0.4) ? random.uniform(0.3, 0.8) : 0;  // about the horizon
  for (int i = 0; i < beams; ++i) {
    const double u = static_cast<double>(i) / (beams - 1);
    const double horizon = top / (top - bottom);
    const double from = u < horizon ? horizon : 1 - horizon;
    const double v = std::abs(u - horizon) / from;
    const double away = from * ((1 - gather) * v + gather * v * v * v);
    const double at = u < horizon ? horizon - away : horizon + away;
    model.elevations.push_back((top + (bottom - top) * at) * kDegree);
  }
  model.columns = beams > 64 ? 1024 : columns[random.index(std::size(columns))];
  model.height = random.uniform(1.2, 2.2);
  model.max_range = wide ? random.uniform(30, 60) : random.uniform(60, 150);
  model.min_range = random.uniform(0.3, 1.0);
  model.dark_range = model.max_range * random.uniform(0.35, 0.6);
  model.yaw = random.chance(0.5) ? 0 : kPi / 2 * std::floor(random.uniform(-1, 3));
}

/// `seed` determines the numbers of Sensor::kRings.
inline SensorModel sensor_model(Sensor sensor, std::uint64_t seed = 0) {
  SensorModel model;
  if (sensor == Sensor::kRings) {
    draw_rings(model, Random(mix(seed, 14)));
    return model;
  }
  static_cast<SensorTraits&>(model) = known_sensor(sensor).traits;
  for (const Rings& rings : known_sensor(sensor).rings) {
    for (int i = 0; i < rings.count; ++i) {
      model.elevations.push_back((rings.top - rings.step * i) * kDegree);
    }
  }
  return model;
}

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
  void fill(const SensorModel& model, std::uint64_t seed, std::size_t scan, Columns part) {
    unordered_.clear();
    cells_.clear();
    if (model.elevations.empty()) {
      add_free_beams(model, scan, part);
    } else {
      add_rings(model, seed, scan, part);
    }
    sort_by_cell();
  }

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

  static int row_of(double elevation) {
    const double row = (elevation + kPi / 2) * (kColumns / (2 * kPi));
    return std::clamp(static_cast<int>(row), 0, kColumns / 2 - 1);
  }

  static int column_of(double azimuth) {
    const double column = (azimuth + kPi) * (kColumns / (2 * kPi));
    return std::clamp(static_cast<int>(column), 0, kColumns - 1);
  }

 private:
  void add(double azimuth, double cos_elevation, double sin_elevation, int row) {
    unordered_.push_back({static_cast<float>(cos_elevation * std::cos(azimuth)),
                          static_cast<float>(cos_elevation * std::sin(azimuth)),
                          static_cast<float>(sin_elevation)});
    cells_.push_back(static_cast<std::uint32_t>(row * kColumns + column_of(azimuth)));
  }

  /// Patterns that never repeat: their turns a scan are incommensurate.
  void add_free_beams(const SensorModel& model, std::size_t scan, Columns part) {
    const auto fraction = [](double turns) { return turns - std::floor(turns); };
    const double first = static_cast<double>(scan) * model.columns;
    for (int i = part.first; i < part.last; ++i) {
      const double t = (first + i) / model.columns;
      if (model.dome) {
        // A fast turn, and lasers that swing up and down between two elevations.
        const double bottom = -7 * kDegree, top = 52 * kDegree;
        const double laser = static_cast<double>(i % model.lasers) / model.lasers;
        const double share = std::abs(2 * fraction(t * 79.6180339887 + 0.5 * laser) - 1);
        const double elevation = bottom + (top - bottom) * share;
        add(2 * kPi * fraction(t * 17.4142135624 + 0.02 * laser) - kPi, std::cos(elevation),
            std::sin(elevation), row_of(elevation));
        continue;
      }
      // Two mirrors: petals that precess from scan to scan.
      const double angle = 35 * kDegree * std::cos(2 * kPi * fraction(t * 61.6180339887));
      const double spin = 2 * kPi * fraction(t * 17.4142135624);
      const double y = std::sin(angle) * std::cos(spin), z = std::sin(angle) * std::sin(spin);
      add(std::atan2(y, std::cos(angle)), std::sqrt(1 - z * z), z, row_of(std::asin(z)));
    }
  }

  void add_rings(const SensorModel& model, std::uint64_t seed, std::size_t scan, Columns part) {
    const double step = model.width / model.columns;
    const double phase = static_cast<double>(unit_float(mix(mix(seed, 11), scan)));
    Random calibration(mix(seed, 12));
    // Trigonometry once per column and ring.
    std::vector<double> sines, cosines;
    for (int i = part.first; i < part.last; ++i) {
      const double azimuth = model.width / 2 - step * (i + phase);
      sines.push_back(std::sin(azimuth));
      cosines.push_back(std::cos(azimuth));
    }
    for (const double nominal : model.elevations) {
      const double elevation = nominal + 0.03 * kDegree * calibration.normal();
      const double turn = 0.5 * step * calibration.normal();
      const double c = std::cos(elevation), s = std::sin(elevation);
      const double cos_turn = std::cos(turn), sin_turn = std::sin(turn);
      const int row = row_of(elevation);
      for (int i = part.first; i < part.last; ++i) {
        const auto k = static_cast<std::size_t>(i - part.first);
        const double azimuth = model.width / 2 - step * (i + phase) + turn;
        const double x = cosines[k] * cos_turn - sines[k] * sin_turn;
        const double y = sines[k] * cos_turn + cosines[k] * sin_turn;
        unordered_.push_back(
            {static_cast<float>(c * x), static_cast<float>(c * y), static_cast<float>(s)});
        cells_.push_back(static_cast<std::uint32_t>(row * kColumns + column_of(wrap(azimuth))));
      }
    }
  }

  /// Counting sort, stable.
  void sort_by_cell() {
    first_.assign(grid_index(kColumns / 2, 0, kColumns) + 1, 0);
    for (const std::uint32_t cell : cells_) ++first_[cell + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    directions_.resize(unordered_.size());
    slot_of_beam_.resize(unordered_.size());
    for (std::size_t i = 0; i < unordered_.size(); ++i) {
      const std::uint32_t slot = next[cells_[i]]++;
      directions_[slot] = unordered_[i];
      slot_of_beam_[i] = slot;
    }
  }

  std::vector<Vec3> unordered_;
  std::vector<std::uint32_t> cells_;
  std::vector<Vec3> directions_;
  std::vector<std::uint32_t> slot_of_beam_;
  std::vector<std::uint32_t> first_;
};

}  // namespace dynains::simulation
