// DynaInsRemover with a configuration, scans, poses, times and calls that are read from bytes.

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "support/standard.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

using Config = DynaInsRemover::Config;
using Point = Eigen::Vector3f;

/// Reads values from bytes; zeros after the end.
class Stream {
 public:
  explicit Stream(Bytes bytes) : bytes_(bytes) {}

  bool empty() const { return at_ >= bytes_.size(); }
  unsigned byte() { return empty() ? 0U : bytes_[at_++]; }
  /// In [-range, range].
  double number(double range) {
    const unsigned low = byte();
    const int whole = static_cast<int>(low | byte() << 8U) - 32768;
    return range * whole / 32768.0;
  }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
};

float strange(unsigned which) {
  using Limits = std::numeric_limits<float>;
  const float values[] = {Limits::quiet_NaN(),  Limits::infinity(),
                          -Limits::infinity(),  Limits::max(),
                          Limits::denorm_min(), -0.0F,
                          Limits::lowest(),     1e6F};
  return values[which % 8];
}

/// A preset with few open and remembered scans: it needs little memory, and rings fill up soon.
Config small_preset(bool paper) {
  Config config = paper ? Config::paper() : Config();
  config.window = std::min(config.window, 3);
  config.clusterer.cluster_range = std::min(config.clusterer.cluster_range, 60.0);
  config.evidence.lookahead_scans = 2;
  config.evidence.lookback_scans = 4;
  return config;
}

/// Sets some parameters to random values, also out of bounds.
void change(Stream& stream, Config& config) {
  Config::visit(config, [&](const auto& parameter) {
    const unsigned choice = stream.byte();
    if (choice % 8 != 7) return;
    using Value = std::remove_reference_t<decltype(parameter.value)>;
    if constexpr (std::is_same_v<Value, bool>) {
      parameter.value = choice >= 128;
    } else if constexpr (std::is_enum_v<Value>) {
      parameter.value = static_cast<Value>(choice / 8 % (value_names(Value()).size() + 1));
    } else {
      const double share = 0.5 + stream.number(0.51);
      const double low = parameter.bounds.min;
      const double high = parameter.bounds.max;
      parameter.value = static_cast<Value>(low + share * share * share * (high - low));
    }
  });
  // Fine grids and long memories need more time without reaching more code.
  config.clusterer.voxel_range = std::max(config.clusterer.voxel_range, 0.4);
  if (config.clusterer.voxel_azimuth > 0.0) {
    config.clusterer.voxel_azimuth = std::max(config.clusterer.voxel_azimuth, 1.0);
  }
  if (config.clusterer.voxel_elevation > 0.0) {
    config.clusterer.voxel_elevation = std::max(config.clusterer.voxel_elevation, 2.0);
  }
  config.clusterer.cluster_range = std::min(config.clusterer.cluster_range, 60.0);
  config.evidence.lookahead_scans = std::min(config.evidence.lookahead_scans, 4);
  config.evidence.lookback_scans = std::min(config.evidence.lookback_scans, 8);
  config.window = std::min(config.window, 6);
  config.votes = std::min(config.votes, 7);
}

/// A floor around the sensor. A dense floor has enough points to derive a sensor model, one of few
/// beams, whose range images are small. Only a near floor shows the mounting of the sensor; its
/// estimation takes as long as ten scans.
void add_floor(Stream& stream, bool dense, std::vector<Point>& points) {
  const auto height = static_cast<float>(-1.7 + stream.number(1.0));
  const bool near = stream.byte() % 32 == 31;
  const float nearest = near ? 3.5F : 20.5F;
  const float step = near ? 1.5F : 0.75F;
  const int rings = dense ? 14 : 2;
  for (int ring = 0; ring < rings; ++ring) {
    for (int beam = 0; beam < 36; ++beam) {
      const float angle = 0.1745F * static_cast<float>(beam);
      const float range = nearest + step * static_cast<float>(ring);
      points.emplace_back(range * std::cos(angle), range * std::sin(angle), height);
    }
  }
}

/// An upright wall, which may move from scan to scan.
void add_wall(Stream& stream, std::vector<Point>& points) {
  const auto x = static_cast<float>(stream.number(40.0));
  const auto y = static_cast<float>(stream.number(40.0));
  const auto width = static_cast<float>(stream.number(3.0));
  for (int column = 0; column < 8; ++column) {
    for (int row = 0; row < 6; ++row) {
      points.emplace_back(x, y + width * static_cast<float>(column) / 8.0F,
                          -1.5F + 0.4F * static_cast<float>(row));
    }
  }
}

/// `dense`: whether floors are dense.
std::vector<Point> points_of(Stream& stream, unsigned kind, bool dense) {
  std::vector<Point> points;
  if ((kind & 1U) != 0) add_floor(stream, dense, points);
  if ((kind & 2U) != 0) add_wall(stream, points);
  const unsigned single = (kind & 4U) != 0 ? stream.byte() % 32 : 0;
  for (unsigned i = 0; i < single; ++i) {
    Point point;
    for (int axis = 0; axis < 3; ++axis) {
      const unsigned odd = (kind & 8U) != 0 ? stream.byte() : 255U;
      point[axis] = odd < 64 ? strange(odd) : static_cast<float>(stream.number(100.0));
    }
    points.push_back(point);
  }
  return points;
}

Eigen::Isometry3d read_pose(Stream& stream, unsigned kind) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if ((kind & 1U) != 0) {
    const double unit = (kind & 2U) != 0 ? 3e7 : 30.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double share = stream.number(1.0);  // most walls are so near that scans overlap
      T.translation()[axis] = unit * share * share * share;
    }
    T.linear() = Eigen::AngleAxisd(stream.number(M_PI), Eigen::Vector3d::UnitZ()).matrix();
  }
  if ((kind & 12U) == 12U) {
    T.matrix()(stream.byte() % 4, stream.byte() % 4) = strange(stream.byte());
  }
  return T;
}

/// Checks every answer of a remover against its input. Begins with a reset, because the remover may
/// have been used before.
class Witness {
 public:
  explicit Witness(DynaInsRemover& remover) : remover_(remover) { reset(); }

  void push(const std::vector<Point>& points, const Eigen::Isometry3d& T, double time) {
    const std::size_t map_before = remover_.map().size();
    try {
      take(remover_.push(points, T, time), points, time);
    } catch (const PoseError&) {
      require(remover_.map().size() == map_before, "a refused scan leaves the map as it was");
    }
  }

  void flush() {
    remover_.flush([this](const ScanVerdict& verdict) { finish(verdict); });
    require(open_.empty(), "flush finishes every scan");
    check_map_size();
    check_map_points();
  }

  void reset() {
    remover_.reset();
    open_.clear();
    pushed_ = finished_ = kept_ = 0;
    require(remover_.map().empty(), "reset clears the map");
  }

  double time_step() const { return remover_.config().max_gap; }
  /// Whether no scan was taken since the last reset. The next scan then gives the sensor model.
  bool is_new() const { return pushed_ == 0; }
  /// Digest of all final verdicts so far.
  std::uint64_t digest() const { return digest_; }

 private:
  struct Open {
    std::vector<std::uint8_t> is_invalid;  // by point
    double time;
  };

  static bool is_invalid(const Point& p) {
    const bool finite = std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z());
    return !finite || (p.x() == 0.0F && p.y() == 0.0F && p.z() == 0.0F);
  }

  void take(const FrameResult& frame, const std::vector<Point>& points, double time) {
    Open scan{std::vector<std::uint8_t>(points.size()), time};
    std::transform(points.begin(), points.end(), scan.is_invalid.begin(), is_invalid);
    open_.push_back(std::move(scan));
    if (pushed_ % 3 != 0) check(frame.newest(), open_.back(), pushed_);  // others are not read
    require(frame.newest().time == time, "the time is that of the push");
    ++pushed_;
    require(frame.finished.has_value() == (open_.size() > remover_.latency()),
            "a scan is final after the latency");
    if (frame.finished) finish(*frame.finished);
    check_map_size();
  }

  static void check(const ScanVerdict& verdict, const Open& pushed, std::uint64_t scan) {
    require(verdict.scan == scan, "scans are numbered by pushes");
    const std::size_t count = pushed.is_invalid.size();
    require(verdict.labels.size() == count && verdict.instances.size() == count &&
                verdict.beliefs.size() == count,
            "one answer for each point");
    bool labels_invalid = true, knows_labels = true, bounds_beliefs = true, spares_unjudged = true;
    for (std::size_t i = 0; i < count; ++i) {
      const PointLabel label = verdict.labels[i];
      const float belief = verdict.beliefs[i];
      labels_invalid &= (label == PointLabel::kInvalid) == (pushed.is_invalid[i] != 0);
      knows_labels &= label <= PointLabel::kDynamic;
      bounds_beliefs &= belief >= 0.0F && belief <= 1.0F;
      spares_unjudged &= label > PointLabel::kOutOfRange || verdict.instances[i] == kNoInstance;
    }
    require(labels_invalid, "invalid points are called that");
    require(knows_labels, "a label is one of five");
    require(bounds_beliefs, "a belief is in [0, 1]");
    require(spares_unjudged, "what is not judged has no instance");
  }

  void finish(const ScanVerdict& verdict) {
    require(!open_.empty(), "a scan is final once");
    check(verdict, open_.front(), finished_);
    require(verdict.time == open_.front().time, "scans become final in order");
    for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
      kept_ += is_static(verdict.labels[i]) ? 1U : 0U;
      std::uint32_t belief = 0;
      std::memcpy(&belief, &verdict.beliefs[i], sizeof(belief));
      for (const std::uint32_t value :
           {static_cast<std::uint32_t>(verdict.labels[i]), verdict.instances[i], belief}) {
        digest_ = (digest_ ^ value) * 0x100000001B3U;
      }
    }
    open_.pop_front();
    ++finished_;
  }

  void check_map_size() const {
    const std::size_t size = remover_.map().size();
    const std::size_t kept = remover_.config().build_map ? kept_ : 0;
    require(size <= kept, "the map has at most the points that were kept");
    require(remover_.config().map.map_voxel > 0.0 || size == kept,
            "without voxels it has all of them");
  }

  void check_map_points() const {
    std::size_t visited = 0;
    bool finite = true;
    remover_.map().for_each([&](const Eigen::Vector3d& p) {
      finite &= std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z());
      ++visited;
    });
    require(finite, "points of the map are finite");
    require(visited == remover_.map().size(), "the map gives out as many points as it counts");
  }

  DynaInsRemover& remover_;
  std::deque<Open> open_;
  std::uint64_t pushed_ = 0;
  std::uint64_t finished_ = 0;
  std::size_t kept_ = 0;
  std::uint64_t digest_ = 0;
};

constexpr char kPush = 0;
constexpr char kFlush = 13;
constexpr char kReset = 14;
constexpr char kPushAlone = 15;  ///< any scan, also as the first one

/// Makes the calls that the rest of the stream encodes; returns the digest of all final verdicts.
std::uint64_t play(Stream stream, DynaInsRemover& remover) {
  Witness witness(remover);
  double time = 0.0;
  constexpr int kMaxCalls = 5;
  for (int call = 0; call < kMaxCalls && !stream.empty(); ++call) {
    const unsigned what = stream.byte() % 16;
    if (what == kFlush) {
      witness.flush();
    } else if (what == kReset) {
      witness.reset();
    } else {
      const unsigned kind = stream.byte();
      // The scan that gives the sensor model is only a floor, so that range images have few rows.
      const bool tells_sensor = what != kPushAlone && witness.is_new();
      const std::vector<Point> points =
          points_of(stream, tells_sensor ? 1U : kind & 15U, tells_sensor);
      const Eigen::Isometry3d T = read_pose(stream, kind >> 4U);
      const unsigned clock = stream.byte();
      if (clock == 255) {
        time = static_cast<double>(strange(stream.byte()));
      } else if (clock >= 250) {
        time += stream.number(3.0 * witness.time_step());
      } else {
        time += 0.1;
      }
      witness.push(points, T, time);
      if (!std::isfinite(time)) time = 0.0;
    }
  }
  witness.flush();
  return witness.digest();
}

constexpr unsigned kPooled = 64;          ///< number of configurations with their own remover
constexpr unsigned kWithDynamicGrid = 8;  ///< number of them with a dynamic grid of 2 MB
constexpr unsigned kMinCompared = 250;    ///< from here on, a new remover has to give equal answers
constexpr unsigned kMinChanged = 253;     ///< from here on, the stream encodes the configuration

/// The two presets, then presets with some parameters changed at random.
Config pooled_config(unsigned number) {
  Config config = small_preset(number % 2 == 1);
  if (number < 2) return config;
  std::mt19937 random(number);
  std::vector<std::uint8_t> bytes(1000);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  Stream stream(bytes);
  change(stream, config);
  if (number >= kWithDynamicGrid) config.evidence.dynamic_grid_ratio = 1.0;
  return config;
}

std::optional<DynaInsRemover> built(const Config& config) {
  try {
    return DynaInsRemover(config);
  } catch (const ConfigError&) {
    return std::nullopt;
  }
}

/// Built once, because a run begins with a reset; null if its configuration is refused.
DynaInsRemover* pooled_remover(unsigned number) {
  static std::map<unsigned, std::optional<DynaInsRemover>> pool;
  auto entry = pool.find(number);
  if (entry == pool.end()) entry = pool.emplace(number, built(pooled_config(number))).first;
  return entry->second ? &*entry->second : nullptr;
}

void run_facade(Bytes bytes) {
  Stream stream(bytes);
  const unsigned kind = stream.byte();
  if (kind >= kMinChanged) {
    Config config = small_preset(kind % 2 == 1);
    change(stream, config);
    config.evidence.dynamic_grid_ratio = 1.0;
    if (std::optional<DynaInsRemover> remover = built(config)) play(stream, *remover);
    return;
  }
  const unsigned number = kind % kPooled;
  DynaInsRemover* const remover = pooled_remover(number);
  if (remover == nullptr) return;
  const std::uint64_t digest = play(stream, *remover);
  if (kind < kMinCompared) return;
  DynaInsRemover fresh(pooled_config(number));
  require(play(stream, fresh) == digest, "reset brings back the state after construction");
}

}  // namespace

Target facade_target() {
  std::vector<std::string> seeds;
  for (const char kind : {'\0', '\1', '\x40', '\xFB'}) {
    std::string seed(1, kind);
    // A floor, three scans of a floor and a moving wall, then a flush.
    for (int i = 0; i < 4; ++i) {
      seed += {kPush, '\x13', '\0', '\x80', kind == '\x40' ? '\x1F' : '\0'};   // floor
      if (i > 0) seed += {'\0', static_cast<char>(0xA0 + i), '\0', '\x98'};    // wall at x, y
      if (i > 0) seed += {'\0', '\xE0'};                                       // its width
      seed += {'\0', '\x80', '\0', '\x80', '\0', '\x80', '\0', '\x80', '\0'};  // pose, time
    }
    seed += kFlush;
    seeds.push_back(seed);
  }
  // An invalid pose, a reset, invalid points.
  seeds.push_back({'\0',   kPush,  '\xD4', '\0',   '\0',   '\0', '\x90', '\x90', '\x90',
                   '\x90', '\x90', '\x90', '\x90', '\x90', '\1', '\1',   '\1',   kReset,
                   '\xF',  '\xC',  '\2',   '\1',   '\2',   '\3', '\4',   '\5',   '\6'});
  // A changed value for every parameter.
  std::string changed = "\xFE";
  for (int i = 0; i < 200; ++i) changed += {'\x47', static_cast<char>(i), '\x70'};
  seeds.push_back(changed);
  return {"facade", run_facade, seeds};
}

}  // namespace dynains::fuzz
