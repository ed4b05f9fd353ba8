#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "dynains/evaluation/text_table.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/parameters.hpp"
#include "io/points/point_file_copy.hpp"
#include "parameter_flags.hpp"
#include "progress.hpp"
#include "recording_options.hpp"
#include "run/input_files.hpp"
#include "run/interrupt.hpp"
#include "run/labelled_sequence.hpp"
#include "run/map_alignment.hpp"
#include "run/map_votes.hpp"
#include "run/output_folder.hpp"
#include "run/write_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

struct CleanOptions {
  explicit CleanOptions(CLI::App& command)
      : map_option(command.add_option("MAP", map, "map of the recording, .ply or .pcd")),
        run_option(command.add_option("OUT", run, "folder of `dynains run` over the recording")),
        sequence(command, "recording of the run", false) {
    map_option->required()->type_name("");
    run_option->required()->type_name("");
  }

  std::string map, run;
  CLI::Option* map_option;  // the first positional arguments
  CLI::Option* run_option;
  RecordingFlags sequence;
  std::string cleaned;
  double voxel = 0.2;  // m
  CLI::Option* voxel_option = nullptr;
  bool force = false;
  bool quiet = false;
};

fs::path target_of(const CleanOptions& options) {
  const fs::path map = options.map;
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

/// The edge of voxels that hold about one point of the map, m; at least `least`.
double edge_by_spacing(const std::vector<Eigen::Vector3d>& map, double least) {
  constexpr double kMost = 2.0;     // m
  constexpr double kDouble = 1.42;  // edge of voxels that hold twice as many points of a surface
  double edge = least;
  while (edge < kMost && map.size() < 2 * MapVotes(map, kDouble * edge).voxel_count()) edge *= 1.2;
  return edge;
}

/// Adds the points of all scans of the run with their labels, where they lie in the map. Throws
/// Interrupted.
void add_scans(const Recording& recording, const ResultFolder& out, bool quiet,
               MapAlignment& alignment, MapVotes& votes) {
  const std::vector<std::size_t> scans = scans_of_run(out, recording);
  Progress progress(scans.size(), "scans", quiet);
  RecordedScan scan;
  PointBuffer standing;
  std::size_t done = 0;
  for (const std::size_t i : scans) {
    if (InterruptGuard::signal() != 0) throw Interrupted{InterruptGuard::signal()};
    recording.read_scan(i, scan);
    const fs::path file = out.path() / "labels" / (recording.name(i) + ".label");
    const std::vector<std::uint32_t> labels = read_run_labels(file, scan.size());
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
    const MapVotes::Verdict verdict = votes.verdict(i);
    verdicts.keep.push_back(verdict == MapVotes::Verdict::kMoving ? 0 : 1);
    if (verdict == MapVotes::Verdict::kMoving) ++verdicts.moving;
    if (verdict == MapVotes::Verdict::kUnseen) ++verdicts.unseen;
  }
  if (count > 0 && verdicts.unseen == count) {
    throw IoError(map.string() +
                  ": no point lies near a point of the scans; expected a map in the frame of the "
                  "poses of the run");
  }
  return verdicts;
}

void clean(CleanOptions& options) {
  const fs::path target = whole_path(target_of(options));
  const ResultFolder out = open_finished_run(options.run);
  const Recording recording =
      options.sequence.open_of_run(out, "dynains clean " + options.map + ' ' + options.run);
  InputFiles inputs(recording);
  for (const fs::path& read :
       {fs::path(options.map), recording.scan_folder(), out.path(), out.path() / "labels"}) {
    inputs.add(read);
  }
  OutputFile cleaned(target, options.force, inputs);
  const std::vector<Eigen::Vector3d> positions = read_points(options.map).positions;

  const InterruptGuard interrupt;
  const bool is_given = options.voxel_option->count() > 0;
  MapVotes votes(positions, is_given ? options.voxel : edge_by_spacing(positions, options.voxel));
  MapAlignment alignment(positions);
  add_scans(recording, out, options.quiet, alignment, votes);
  const Verdicts verdicts = judge(votes, positions.size(), options.map);
  AtomicFile file(cleaned.path());
  copy_points(options.map, verdicts.keep, file.stream());
  file.commit();
  cleaned.put_in_place();

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
    print_warning("the map lies up to " + evaluation::format_number(alignment.farthest(), 2) +
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
  CLI::App& command = *app.add_subcommand(
      "clean", "Remove moving points from a map that another program has made of a recording");
  const auto options = std::make_shared<CleanOptions>(command);
  command
      .add_option("--map", options->cleaned,
                  "the cleaned map, in the format of MAP [MAP with _static before its ending]")
      ->type_name("FILE");
  SettingFlags{command}(Parameter{"voxel", options->voxel, closed(0.01, 10.0), "m",
                                  "edge of the voxels in which points of the scans decide about "
                                  "those of the map; more by default if the map is coarser"});
  options->voxel_option = command.get_option("--voxel");
  command.add_flag("--force", options->force, "replace the cleaned map if it exists");
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  command.footer(
      "A point of the map leaves if its voxel holds more moving than static points of the scans.\n"
      "The map must lie in the frame of the poses of the run, but for about a metre.\n"
      "All columns of the points stay.");
  command.callback([options] { clean(*options); });
}

}  // namespace dynains::program
