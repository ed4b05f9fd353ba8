// Directions in which a sensor measures, and the nearest surface along every beam of a scan.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "simulation/config.hpp"
#include "simulation/primitive.hpp"
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

/// Distance from the origin that no part of the primitive undercuts.
inline float nearest_distance(const Primitive& primitive) {
  const Vec3 p = primitive.to_unit * (-1.0F * primitive.centre);
  const Vec3 inside{std::clamp(p.x, -1.0F, 1.0F), std::clamp(p.y, -1.0F, 1.0F),
                    std::clamp(p.z, -1.0F, 1.0F)};
  return norm(primitive.centre + primitive.from_unit * inside);
}

inline std::uint64_t cell_hash(Vec3 p, float size, std::uint64_t salt) {
  const auto ix = static_cast<std::int64_t>(std::floor(p.x / size));
  const auto iy = static_cast<std::int64_t>(std::floor(p.y / size));
  const auto iz = static_cast<std::int64_t>(std::floor(p.z / size));
  const auto key = static_cast<std::uint64_t>((ix * 73856093) ^ (iy * 19349663) ^ (iz * 83492791));
  return mix(key ^ salt);
}

/// Range (m) at which a beam ends within a porous shape, or a negative number. Beams collide at
/// random with constant density; collisions in lasting gaps are void (Woodcock tracking).
inline float porous_hit(const Primitive& primitive, std::uint64_t salt, Vec3 direction, float enter,
                        float leave, std::uint64_t random) {
  const Material& material = *primitive.material;
  const bool clumped = material.clump > 0;
  const float density = clumped ? 1.7F * material.density : material.density;
  float t = enter;
  for (int i = 0; i < 32; ++i) {
    random = mix(random + 0x9e3779b97f4a7c15ULL);
    t -= std::log(unit_float(random) + 3e-8F) / density;
    if (t >= leave) return -1;
    if (!clumped) return t;
    // Gaps stay where they are in the shape's own frame.
    const Vec3 unit = primitive.to_unit * (t * direction - primitive.centre);
    const Vec3 metres{unit.x * norm(transposed(primitive.from_unit).x),
                      unit.y * norm(transposed(primitive.from_unit).y),
                      unit.z * norm(transposed(primitive.from_unit).z)};
    if (unit_float(cell_hash(metres, material.clump, salt)) < 0.6F) return t;
  }
  return -1;
}

/// A hit on a facade: windows lie deeper, and some let the beam into the room.
inline void look_through_window(const Primitive& primitive, std::uint64_t salt, Vec3 direction,
                                float leave, std::uint64_t random, float& range, float& loss) {
  const Vec3 unit = primitive.to_unit * (range * direction - primitive.centre);
  const float ax = std::abs(unit.x), ay = std::abs(unit.y), az = std::abs(unit.z);
  if (az >= ax && az >= ay) return;
  const Mat3 half_axes = transposed(primitive.from_unit);
  const bool front = ay >= ax;
  const float along = (front ? unit.x : unit.y) * norm(front ? half_axes.x : half_axes.y);
  const float up = (unit.z + 1) * norm(half_axes.z) - 1.0F;
  const float u = along / primitive.material->window_spacing, v = up / 3.0F;
  const float part_u = u - std::floor(u), part_v = v - std::floor(v);
  if (part_u < 0.28F || part_u > 0.72F || part_v < 0.3F || part_v > 0.8F || up < 0.5F) return;
  const Vec3 normal = surface_normal(primitive, range * direction);
  const float cosine = std::max(0.05F, -dot(normal, direction));
  const std::uint64_t room =
      mix(salt ^ mix(static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(u)) * 1009 +
                                                static_cast<std::int64_t>(std::floor(v)))));
  const float which = unit_float(random);
  float deeper = 0.15F;
  if (which < 0.2F) {
    deeper = 0.6F + 3.0F * unit_float(room);
  } else if (which < 0.6F) {
    loss = 1.0F;
  }
  range = std::min(range + deeper / cosine, leave);
}

/// All beams start in one point, so the scan is drawn like a picture: every primitive meets only
/// the beams within its solid angle and keeps those that it shortens.
class Renderer {
 public:
  struct Drawn {
    Primitive primitive;      ///< sensor frame
    std::uint32_t label = 0;  ///< as of a point; without a class: that of the material
    std::uint64_t salt = 0;   ///< lasting identity, for gaps in leaves and rooms behind windows
  };

  struct Hit {
    float range = 0;
    const Drawn* drawn = nullptr;  ///< valid until start(); null: nothing
    float extra_loss = 0;          ///< chance of no return at all: glass
  };

  /// Forgets the last scan; every beam can see as far as `max_range`. A share of the beams passes
  /// through the panes of vehicles.
  void start(const BeamTable& beams, float max_range, std::uint64_t seed, float glass_passes = 0) {
    beams_ = &beams;
    max_range_ = max_range;
    seed_ = seed;
    glass_passes_ = glass_passes;
    drawn_.clear();
    order_.clear();
    hits_.assign(beams.size(), Hit{max_range, nullptr, 0});
  }

  /// Takes note of a primitive, unless it is out of reach.
  void add(const Primitive& primitive, std::uint32_t label, std::uint64_t salt) {
    const float near = nearest_distance(primitive);
    if (near > max_range_) return;
    order_.push_back({near, static_cast<std::uint32_t>(drawn_.size())});
    drawn_.push_back({primitive, label, salt});
  }

  /// Finds the nearest primitive of every beam; random numbers depend on seed, beam and salt only.
  void draw() {
    // From near to far: most beams are short when a distant primitive comes.
    std::sort(order_.begin(), order_.end());
    for (const auto& [near, index] : order_) {
      const Drawn& drawn = drawn_[index];
      const Bounds bounds = bounds_of(drawn.primitive);
      const int first_row = BeamTable::row_of(bounds.low),
                last_row = BeamTable::row_of(bounds.high);
      int first = 0, last = BeamTable::kColumns - 1;
      bool split = false;
      if (bounds.half_azimuth < kPi - 0.01) {
        first = BeamTable::column_of(wrap(bounds.azimuth - bounds.half_azimuth));
        last = BeamTable::column_of(wrap(bounds.azimuth + bounds.half_azimuth));
        split = first > last || (first == last && bounds.half_azimuth > 1);
      }
      for (int row = first_row; row <= last_row; ++row) {
        if (split)
          draw_slots(drawn, near, beams_->first_slot(row, 0), beams_->last_slot(row, last));
        draw_slots(drawn, near, beams_->first_slot(row, first),
                   beams_->last_slot(row, split ? BeamTable::kColumns - 1 : last));
      }
    }
  }

  const std::vector<Hit>& hits() const { return hits_; }

 private:
  struct Bounds {
    double azimuth = 0, half_azimuth = 0, low = 0, high = 0;
  };

  static Bounds bounds_of(const Primitive& primitive) {
    // Extremes of the eight corners, seen from the origin.
    const Vec3 c = primitive.centre;
    const double middle = std::atan2(static_cast<double>(c.y), static_cast<double>(c.x));
    const double cos_middle = std::cos(middle), sin_middle = std::sin(middle);
    double left = -10, right = 10, z_low = 1e9, z_high = -1e9, near = 1e9, far = 0;
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner = c + primitive.from_unit * Vec3{i & 1 ? 1.0F : -1.0F, i & 2 ? 1.0F : -1.0F,
                                                         i & 4 ? 1.0F : -1.0F};
      const auto x = static_cast<double>(corner.x), y = static_cast<double>(corner.y);
      const double forward = x * cos_middle + y * sin_middle;
      const double sideways = y * cos_middle - x * sin_middle;
      const double angle = std::atan2(sideways, forward);
      left = std::max(left, angle);
      right = std::min(right, angle);
      near = std::min(near, forward);
      far = std::max(far, std::sqrt(x * x + y * y));
      z_low = std::min(z_low, static_cast<double>(corner.z));
      z_high = std::max(z_high, static_cast<double>(corner.z));
    }
    near = std::max(near, 1e-3);
    Bounds bounds;
    if (left - right >= kPi) {
      // The z axis may pass through.
      bounds = {0, kPi, -kPi / 2, kPi / 2};
      near = 1e-3;
    } else {
      bounds.azimuth = wrap(middle + 0.5 * (left + right));
      bounds.half_azimuth = 0.5 * (left - right);
    }
    bounds.high = std::atan2(z_high, z_high > 0 ? near : far);
    bounds.low = std::atan2(z_low, z_low < 0 ? near : far);
    return bounds;
  }

  /// `near`: m, no part of it lies nearer.
  void draw_slots(const Drawn& drawn, float near, std::size_t begin, std::size_t end) {
    const Primitive& primitive = drawn.primitive;
    const bool porous = primitive.material->density > 0;
    const bool windows = primitive.material->window_spacing > 0;
    const bool pane = glass_passes_ > 0 && primitive.material == &kMaterials.glass;
    for (std::size_t slot = begin; slot < end; ++slot) {
      Hit& hit = hits_[slot];
      if (hit.range <= near) continue;
      const Vec3 direction = beams_->direction(slot);
      const Interval interval = intersect(primitive, {}, direction);
      if (interval.empty() || interval.leave <= 0) continue;
      if (pane && unit_float(mix(~seed_ ^ drawn.salt, slot)) < glass_passes_) continue;
      float range = interval.enter, loss = 0;
      if (porous) {
        range = porous_hit(primitive, drawn.salt, direction, std::max(range, 0.0F),
                           std::min(interval.leave, hit.range), mix(seed_ ^ drawn.salt, slot));
      } else if (windows && range > 0 && range < hit.range) {
        look_through_window(primitive, drawn.salt, direction, interval.leave,
                            mix(seed_ ^ drawn.salt, slot), range, loss);
      }
      if (range <= 0 || range >= hit.range) continue;
      hit = {range, &drawn, loss};
    }
  }

  const BeamTable* beams_ = nullptr;
  float max_range_ = 0;
  std::uint64_t seed_ = 0;
  float glass_passes_ = 0;
  std::vector<Drawn> drawn_;
  std::vector<std::pair<float, std::uint32_t>> order_;
  std::vector<Hit> hits_;
};

}  // namespace dynains::simulation
