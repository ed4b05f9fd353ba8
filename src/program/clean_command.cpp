#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"
#include "io/points/point_sink.hpp"
#include "io/text.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"
#include "run/interrupt.hpp"
#include "run/map_file.hpp"
#include "run/output/output_folder.hpp"
#include "run/verdict_files.hpp"
#include "run/write_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// Counts the static and the moving points of scans in the voxels that hold points of a map.
class MapVotes {
 public:
  struct Counts {
    std::uint32_t rest = 0, moving = 0;  ///< static and moving points
  };

  /// `map`: positions in the world frame, m. `voxel`: edge of the voxels, m, above 0.
  MapVotes(Span<const Eigen::Vector3d> map, double voxel) : voxel_(voxel) {
    voxels_.reserve(map.size());
    for (const Eigen::Vector3d& point : map) {
      // The first point is the centre of its voxel.
      if (!origin_ && point.allFinite()) origin_ = point.array() - 0.5 * voxel;
      const std::optional<VoxelKey> key = key_of(point);
      voxels_.push_back(key ? table_.insert(*key) : kNoIndex);
    }
    counts_.resize(table_.size());
  }

  std::size_t voxel_count() const { return counts_.size(); }

  /// Adds a point of a scan, in the world frame.
  void add(const Eigen::Vector3d& point, bool is_moving) {
    const std::optional<VoxelKey> key = key_of(point);
    const std::uint32_t voxel = key ? table_.find(*key) : kNoIndex;
    if (voxel != kNoIndex) ++(is_moving ? counts_[voxel].moving : counts_[voxel].rest);
  }

  /// Counts in the voxel of point `i` of the map; zero if its coordinates are not finite.
  Counts counts(std::size_t i) const {
    return voxels_[i] == kNoIndex ? Counts() : counts_[voxels_[i]];
  }

 private:
  // Empty for points far from the map, and those that are not finite.
  std::optional<VoxelKey> key_of(const Eigen::Vector3d& point) const {
    if (!origin_) return std::nullopt;
    constexpr auto kEnd = static_cast<double>(kVoxelKeyOffset);
    std::int64_t index[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double scaled = std::floor((point[axis] - (*origin_)[axis]) / voxel_);
      if (!(scaled >= -kEnd && scaled < kEnd)) return std::nullopt;
      index[axis] = static_cast<std::int64_t>(scaled);
    }
    return voxel_key(index[0], index[1], index[2]);
  }

  double voxel_;
  std::optional<Eigen::Vector3d> origin_;  // a corner of the voxels
  VoxelHashTable<> table_;
  std::vector<std::uint32_t> voxels_;  // by point of the map
  std::vector<Counts> counts_;         // by voxel
};

/// Where the scans of a recording lie in a map that was made with other poses. A scan each 2 m of
/// way is aligned with the surfaces of the map around it; the scans up to the next one are moved
/// with it. Where the alignment is uncertain, the motion before it stays.
class MapAlignment {
 public:
  /// `map`: positions in the frame of the map, m; those that are not finite do not count.
  explicit MapAlignment(const std::vector<Eigen::Vector3d>& map) {
    std::copy_if(map.begin(), map.end(), std::back_inserter(map_),
                 [](const Eigen::Vector3d& point) { return point.allFinite(); });
    std::sort(map_.begin(), map_.end(), is_before);
  }

  /// Whether the next scan is 2 m or more from the latest one that align() took.
  bool is_due(const Pose& T_world_sensor) const {
    constexpr double kWay = 2.0;  // m
    return !latest_ || (T_world_sensor.translation() - *latest_).norm() >= kWay;
  }

  /// `standing`: m, sensor frame, points that do not move. The frame of the map has to be that of
  /// the poses but for about a metre and a few degrees.
  void align(PointsView standing, const Pose& T_world_sensor) {
    const Eigen::Vector3d sensor = T_world_sensor.translation();
    latest_ = sensor;
    const Eigen::Vector3d centre = T_map_world_ * sensor;
    const Pose T_map_centre(Eigen::Translation3d{centre});
    const Pose T_centre_map = T_map_centre.inverse();
    const Pose T_latest = T_centre_map * T_map_world_ * T_world_sensor;
    const RegistrationScan map(around(centre), kReach), scan(standing, kReach);
    const auto found =
        register_scans(map.surfaces(), scan.points(), {T_latest, T_centre_map * T_world_sensor});
    if (!found || found->score < kMinScore || found->uncertainty > kMaxUncertain) return;
    T_map_world_ = T_map_centre * found->T_a_b * T_world_sensor.inverse();
    ++aligned_;
    farthest_ = std::max(farthest_, (T_map_world_ * sensor - sensor).norm());
  }

  /// From the frame of the poses, at the latest certain alignment.
  const Pose& T_map_world() const { return T_map_world_; }
  std::size_t aligned() const { return aligned_; }  ///< scans whose alignment was certain
  double farthest() const { return farthest_; }     ///< m, most that a sensor was moved

 private:
  static constexpr double kReach = 40.0;  // m, points that count

  static bool is_before(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.x() < b.x();
  }

  // Points of the map relative to `centre`, along the axes of the map.
  PointBuffer around(const Eigen::Vector3d& centre) const {
    PointBuffer points;
    const Eigen::Vector3d reach(kReach, 0.0, 0.0);
    auto point = std::lower_bound(map_.begin(), map_.end(), centre - reach, is_before);
    const auto end = std::upper_bound(point, map_.end(), centre + reach, is_before);
    for (; point != end; ++point) {
      const Eigen::Vector3f p = (*point - centre).cast<float>();
      if (p.norm() < kReach) points.push_back(p.x(), p.y(), p.z());
    }
    return points;
  }

  std::vector<Eigen::Vector3d> map_;  // by x
  Pose T_map_world_ = Pose::Identity();
  std::optional<Eigen::Vector3d> latest_;  // m, sensor of the latest scan that align() took
  std::size_t aligned_ = 0;
  double farthest_ = 0.0;
};

struct CleanOptions {
  explicit CleanOptions(CLI::App& command)
      : map(command, "MAP", "map of the recording, .ply or .pcd"),
        run(command, "OUT", "folder of `dynains run` over the recording"),
        sequence(command, "recording of the run", false) {
    const SettingFlags flags{command};
    flags(plain_text("map", cleaned, "FILE",
                     "the cleaned map, in the format of MAP [MAP with _static before its ending]"));
    flags(Parameter{"voxel", voxel, closed(0.01, 10.0), "m",
                    "edge of the voxels in which points of the scans decide about those of the "
                    "map; more by default if the map is coarser"});
    voxel_option = command.get_option("--voxel");
    command.add_flag("--force", force, "replace the cleaned map if it exists");
    command.add_flag("-q,--quiet", quiet, "print errors only");
  }

  Argument map, run;
  RecordingFlags sequence;
  std::string cleaned;
  double voxel = 0.2;  // m
  CLI::Option* voxel_option;
  bool force = false;
  bool quiet = false;
};

fs::path target_of(const CleanOptions& options) {
  const fs::path map = options.map.value;
  const fs::path target =
      options.cleaned.empty()
          ? map.parent_path() / (map.stem().string() + "_static" + map.extension().string())
          : fs::path(options.cleaned);
  if (target.extension() != map.extension()) {
    throw ConfigError("--map " + target.string() + ": expected a name that ends in " +
                      map.extension().string() + ", as that of the map");
  }
  return target;
}

/// The edge of voxels that hold about one point of the map, m: from `least` to 2 m.
double voxel_of(const std::vector<Eigen::Vector3d>& map, double least) {
  return edge_by_spacing(map.size(), least, 2.0,
                         [&](double edge) { return MapVotes(map, edge).voxel_count(); });
}

/// Adds the points of all scans of the run with their labels, where they lie in the map. Throws
/// Interrupted.
void add_scans(const Recording& recording, const ResultFolder& out, bool quiet,
               MapAlignment& alignment, MapVotes& votes) {
  const std::vector<std::size_t> scans = scans_of_run(out, recording);
  Progress progress(scans.size(), "scans", quiet);
  RecordedScan scan;
  PointBuffer standing;
  const VerdictFiles files(out.path());
  std::size_t done = 0;
  for (const std::size_t i : scans) {
    InterruptGuard::check();
    recording.read_scan(i, scan);
    const std::vector<std::uint32_t> labels = files.labels(recording.name(i), scan.size());
    const Pose& T_world_sensor = recording.T_world_sensor(i);
    if (alignment.is_due(T_world_sensor)) {
      standing.clear();
      for (std::size_t k = 0; k < labels.size(); ++k) {
        const float* const p = &scan.xyzi[4 * k];
        if (class_of(labels[k]) != kRunMoving) standing.push_back(p[0], p[1], p[2]);
      }
      alignment.align(standing, T_world_sensor);
    }
    const Pose T_map_sensor = alignment.T_map_world() * T_world_sensor;
    for (std::size_t k = 0; k < labels.size(); ++k) {
      const std::uint32_t label = class_of(labels[k]);
      if (label == kRunNotJudged) continue;
      const float* const p = &scan.xyzi[4 * k];
      votes.add(T_map_sensor * Eigen::Vector3d(p[0], p[1], p[2]), label == kRunMoving);
    }
    progress.update(++done);
  }
}

struct Verdicts {
  std::vector<std::uint8_t> keep;  // by point of the map
  std::size_t moving = 0;
  std::size_t unseen = 0;
};

/// Throws IoError if no point of the map is near a point of a scan.
Verdicts judge(const MapVotes& votes, std::size_t count, const fs::path& map) {
  Verdicts verdicts;
  for (std::size_t i = 0; i < count; ++i) {
    const MapVotes::Counts counts = votes.counts(i);
    const bool is_moving = counts.moving > counts.rest;
    verdicts.keep.push_back(is_moving ? 0 : 1);
    verdicts.moving += is_moving ? 1 : 0;
    verdicts.unseen += counts.rest + counts.moving == 0 ? 1 : 0;
  }
  if (count > 0 && verdicts.unseen == count) {
    throw IoError(map.string() +
                  ": no point lies near a point of the scans; expected a map in the frame of the "
                  "poses of the run");
  }
  return verdicts;
}

void clean(CleanOptions& options) {
  const std::string& map = options.map.value;
  const fs::path target = whole_path(target_of(options));
  const ResultFolder out = open_finished_run(options.run.value);
  const Recording recording =
      options.sequence.open_of_run(out, "dynains clean " + map + ' ' + options.run.value);
  InputFiles inputs(recording, map);
  inputs.add_results(out);
  OutputFile cleaned(target, existing_by(options.force), inputs);
  const std::vector<Eigen::Vector3d> positions = read_points(map).positions;

  const InterruptGuard interrupt;
  const bool is_given = options.voxel_option->count() > 0;
  MapVotes votes(positions, is_given ? options.voxel : voxel_of(positions, options.voxel));
  MapAlignment alignment(positions);
  add_scans(recording, out, options.quiet, alignment, votes);
  const Verdicts verdicts = judge(votes, positions.size(), map);
  cleaned.write([&](std::ostream& file) { copy_points(map, verdicts.keep, file); });

  if (2 * verdicts.unseen > positions.size()) {
    print_warning(std::to_string(verdicts.unseen) + " of " + std::to_string(positions.size()) +
                  " points of the map lie near no point of the scans and stay: the map is that of "
                  "another recording, or its poses are not those of the run");
  }
  if (alignment.aligned() == 0) {
    print_warning(
        "the distance of the map and the scans is not known: too few surfaces are in "
        "both; points of scans count where their poses put them");
  } else if (2.0 * alignment.farthest() > options.voxel) {
    print_warning("the map lies up to " + text::fixed(alignment.farthest(), 2) +
                  " m from the scans, as if it was made with other poses; points of scans count "
                  "where they fit to it");
  }
  if (options.quiet) return;
  std::cout << positions.size() << " points, " << verdicts.moving << " left as moving, "
            << verdicts.unseen
            << " stay without a point of a scan near them\nstatic map: " << target.string()
            << std::endl;
}

}  // namespace

void add_clean_command(CLI::App& app) {
  add_command<CleanOptions>(
      app, "clean", "Remove moving points from a map that another program has made of a recording",
      "A point of the map leaves if its voxel holds more moving than static points of the scans.\n"
      "The map must lie in the frame of the poses of the run, but for about a metre.\n"
      "All columns of the points stay.",
      clean);
}

}  // namespace dynains::program
