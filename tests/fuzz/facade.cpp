// DynaInsRemover driven by bytes: configuration, scans, poses, times and the order of calls.
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/remover.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

using Config = DynaInsRemover::Config;
using Point = Eigen::Vector3f;

/// Values from bytes; zeros behind the end.
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

/// A preset with some parameters set to any value, also beyond their bounds.
Config read_config(Stream& stream) {
  const unsigned kind = stream.byte();
  Config config = (kind & 1U) != 0 ? Config::paper() : Config();
  if ((kind & 2U) == 0) return config;
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
  // Fine grids take memory and time that say nothing here.
  config.clusterer.voxel_range = std::max(config.clusterer.voxel_range, 0.25);
  if (config.clusterer.voxel_azimuth > 0.0) {
    config.clusterer.voxel_azimuth = std::max(config.clusterer.voxel_azimuth, 0.5);
  }
  if (config.clusterer.voxel_elevation > 0.0) {
    config.clusterer.voxel_elevation = std::max(config.clusterer.voxel_elevation, 1.0);
  }
  config.clusterer.cluster_range = std::min(config.clusterer.cluster_range, 120.0);
  config.evidence.lookahead_scans = std::min(config.evidence.lookahead_scans, 12);
  config.evidence.lookback_scans = std::min(config.evidence.lookback_scans, 20);
  return config;
}

/// A floor around the sensor: enough points to tell a sensor, one of few beams, whose range images
/// are small.
void add_floor(Stream& stream, std::vector<Point>& points) {
  const auto height = static_cast<float>(-1.7 + stream.number(1.0));
  for (int ring = 0; ring < 14; ++ring) {
    for (int step = 0; step < 36; ++step) {
      const float angle = 0.1745F * static_cast<float>(step);
      const float range = 3.5F + 1.5F * static_cast<float>(ring);
      points.emplace_back(range * std::cos(angle), range * std::sin(angle), height);
    }
  }
}

/// An upright wall, which may move from scan to scan.
void add_wall(Stream& stream, std::vector<Point>& points) {
  const auto x = static_cast<float>(stream.number(40.0));
  const auto y = static_cast<float>(stream.number(40.0));
  const auto width = static_cast<float>(stream.number(3.0));
  for (int column = 0; column < 12; ++column) {
    for (int row = 0; row < 8; ++row) {
      points.emplace_back(x, y + width * static_cast<float>(column) / 12.0F,
                          -1.5F + 0.3F * static_cast<float>(row));
    }
  }
}

std::vector<Point> read_points(Stream& stream, unsigned kind) {
  std::vector<Point> points;
  if ((kind & 1U) != 0) add_floor(stream, points);
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
    for (int axis = 0; axis < 3; ++axis) T.translation()[axis] = stream.number(unit);
    T.linear() = Eigen::AngleAxisd(stream.number(M_PI), Eigen::Vector3d::UnitZ()).matrix();
  }
  if ((kind & 12U) == 12U) {
    T.matrix()(stream.byte() % 4, stream.byte() % 4) = strange(stream.byte());
  }
  return T;
}

/// Checks every answer of one remover against what it was given.
class Witness {
 public:
  explicit Witness(const Config& config) : remover_(config), config_(config) {}

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
    check_map();
  }

  void reset() {
    remover_.reset();
    open_.clear();
    pushed_ = finished_ = kept_ = 0;
    require(remover_.map().empty(), "reset clears the map");
  }

  double time_step() const { return config_.max_gap; }

 private:
  struct Open {
    std::vector<Point> points;
    double time;
  };

  void take(const FrameResult& frame, const std::vector<Point>& points, double time) {
    open_.push_back({points, time});
    check(frame.newest, points, pushed_);
    require(frame.newest.time == time, "the time is that of the push");
    ++pushed_;
    require(frame.finished.has_value() == (open_.size() > remover_.latency()),
            "a scan is final after the latency");
    if (frame.finished) finish(*frame.finished);
    check_map();
  }

  static void check(const ScanVerdict& verdict, const std::vector<Point>& points,
                    std::uint64_t scan) {
    require(verdict.scan == scan, "scans are numbered by pushes");
    require(verdict.labels.size() == points.size() && verdict.instances.size() == points.size() &&
                verdict.beliefs.size() == points.size(),
            "one answer for each point");
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PointLabel label = verdict.labels[i];
      const bool invalid = !points[i].allFinite() || points[i].isZero(0.0F);
      require((label == PointLabel::kInvalid) == invalid, "invalid points are called that");
      require(label <= PointLabel::kDynamic, "a label is one of five");
      require(verdict.beliefs[i] >= 0.0F && verdict.beliefs[i] <= 1.0F, "a belief is in [0, 1]");
      if (label <= PointLabel::kOutOfRange) {
        require(verdict.instances[i] == kNoInstance, "what is not judged has no instance");
      }
    }
  }

  void finish(const ScanVerdict& verdict) {
    require(!open_.empty(), "a scan is final once");
    check(verdict, open_.front().points, finished_);
    require(verdict.time == open_.front().time, "scans become final in order");
    for (const PointLabel label : verdict.labels) kept_ += is_static(label) ? 1U : 0U;
    open_.pop_front();
    ++finished_;
  }

  void check_map() const {
    const std::size_t size = remover_.map().size();
    const std::size_t kept = config_.build_map ? kept_ : 0;
    require(size <= kept, "the map has at most the points that were kept");
    require(config_.map.map_voxel > 0.0 || size == kept, "without voxels it has all of them");
    std::size_t visited = 0;
    remover_.map().for_each([&](const Eigen::Vector3d& p) {
      require(p.allFinite(), "points of the map are finite");
      ++visited;
    });
    require(visited == size, "the map gives out as many points as it counts");
  }

  DynaInsRemover remover_;
  Config config_;
  std::deque<Open> open_;
  std::uint64_t pushed_ = 0;
  std::uint64_t finished_ = 0;
  std::size_t kept_ = 0;
};

constexpr char kPush = 0;
constexpr char kFlush = 13;
constexpr char kReset = 14;

}  // namespace

void run_facade(Bytes bytes) {
  Stream stream(bytes);
  std::optional<Witness> witness;
  try {
    witness.emplace(read_config(stream));
  } catch (const ConfigError&) {
    return;
  }
  double time = 0.0;
  constexpr int kMaxCalls = 16;
  for (int call = 0; call < kMaxCalls && !stream.empty(); ++call) {
    const unsigned what = stream.byte() % 16;
    if (what == kFlush) {
      witness->flush();
    } else if (what == kReset) {
      witness->reset();
    } else {
      const unsigned kind = stream.byte();
      const std::vector<Point> points = read_points(stream, kind & 15U);
      const Eigen::Isometry3d T = read_pose(stream, kind >> 4U);
      const unsigned clock = stream.byte();
      if (clock == 255) {
        time = static_cast<double>(strange(stream.byte()));
      } else if (clock >= 250) {
        time += stream.number(3.0 * witness->time_step());
      } else {
        time += 0.1;
      }
      witness->push(points, T, time);
      if (!std::isfinite(time)) time = 0.0;
    }
  }
  witness->flush();
}

std::vector<std::string> facade_seeds() {
  std::vector<std::string> seeds;
  for (const char preset : {'\0', '\1'}) {
    // Floor and a wall that moves, six scans; then a flush, a reset and a pose that is none.
    std::string seed(1, preset);
    for (int i = 0; i < 6; ++i) {
      seed += {kPush, '\x13', '\0', '\x80'};                      // floor and wall, a pose
      seed += {'\0', static_cast<char>(0xA0 + i), '\0', '\x98'};  // wall at x, y
      seed += {'\0', '\xE0', '\0', '\x80', '\0', '\x80', '\0', '\x80', '\0', '\x80', '\0'};
    }
    seed += {kFlush, kPush, '\x0C', '\2', '\1', '\2', '\3', kReset};
    seed += {kPush, '\xD4', '\1', '\x90', '\x90', '\x90', '\x90', '\x90', '\x90', '\1', '\1', '\1'};
    seeds.push_back(seed);
  }
  // Every parameter set to something.
  std::string changed = "\2";
  for (int i = 0; i < 200; ++i) changed += {'\x47', static_cast<char>(i), '\x70'};
  seeds.push_back(changed);
  return seeds;
}

}  // namespace dynains::fuzz
