#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "evaluation_options.hpp"
#include "experiment.hpp"
#include "progress.hpp"
#include "recording_options.hpp"
#include "remover_options.hpp"
#include "run/finished_run.hpp"
#include "run/labelled_sequence.hpp"
#include "run/output_folder.hpp"
#include "run/verdict_cloud.hpp"
#include "variants.hpp"
#include "verdict_figure.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

struct FiguresOptions {
  explicit FiguresOptions(CLI::App& command)
      : sequence(command, "labelled sequence"),
        remover(command, "default"),
        evaluation(command, "ignore", "eval-") {}

  RecordingFlags sequence;
  std::string out;
  std::string run;
  RemoverOptions remover;
  EvaluationOptions evaluation;
  ScanWindow window;
  double resolution = 0.1;
  int pixels = 1600;
  bool quiet = false;
};

VerdictCloud collect(const FiguresOptions& options) {
  if (!options.run.empty() && options.remover.given()) {
    throw ConfigError("--run draws what a run found: flags of the remover change nothing there");
  }
  const evaluation::EvaluationConfig config = options.evaluation.config();
  const double max_range = config.point_max_range > 0 ? config.point_max_range : 1e6;
  VerdictCloud cloud(options.resolution, config.min_range, max_range, config.truth);

  std::vector<RunLabels> runs;
  if (!options.run.empty()) {
    check_run_is_finished(options.run);
    runs.push_back({options.run});
  }
  LabelledSequence sequence(options.sequence.open(), options.window, runs);
  VariantVerdicts verdicts;
  evaluation::ScanSource source = [&](std::size_t i, evaluation::LabelledScan& scan) {
    return sequence.read(i, scan);
  };
  if (options.run.empty()) {
    Progress progress(sequence.size(), "scans", options.quiet);
    verdicts = run_variants(sequence, {{"run", options.remover.config()}}, Answer::kFinal,
                            [&](std::size_t done) { progress.update(done); });
    source = judged_source(sequence, verdicts);
  }
  evaluation::LabelledScan scan;
  for (std::size_t i = 0; source(i, scan); ++i) cloud.add(scan);
  cloud.drop_covered();
  return cloud;
}

void write_ply(const VerdictCloud& cloud, Content content, const fs::path& path) {
  PointColumns columns;
  columns.rgb = true;
  columns.double_xyz = cloud.origin().cwiseAbs().maxCoeff() > kFloatCoordinateLimit;
  PointFileWriter writer(path, columns);
  for (const VerdictCloud::Point& point : cloud.points()) {
    if (!is_shown(point.fate, content)) continue;
    const Colour colour = colour_of(point.fate, content);
    FilePoint out;
    out.position = cloud.origin() + point.local.cast<double>();
    out.rgb = {colour.r, colour.g, colour.b};
    writer.add(out);
  }
  writer.commit();
}

void figures(const FiguresOptions& options) {
  const fs::path folder = options.out;
  create_folder(folder);
  const VerdictCloud cloud = collect(options);
  const std::pair<Content, std::string> kinds[] = {
      {Content::kRaw, "raw"}, {Content::kVerdict, "cleaned"}, {Content::kMap, "map"}};
  std::vector<std::string> names;
  for (const auto& [content, name] : kinds) {
    write_ply(cloud, content, folder / (name + ".ply"));
    names.insert(names.end(), {name + "_above", name + "_perspective"});
    write_figure(view_from_above(cloud, content, options.pixels), folder, name + "_above");
    write_figure(view_in_perspective(cloud, content, options.pixels), folder,
                 name + "_perspective");
  }
  for (const std::string& name : names) draw_figure(folder, name);
  std::cout << cloud.points().size() << " points in " << folder.string()
            << ": raw, cleaned and map, each as _above.png, _perspective.png and .ply; .gp and "
               ".dat draw them again\n";
}

}  // namespace

void add_figures_command(CLI::App& experiment) {
  CLI::App& command = *experiment.add_subcommand(
      "figures",
      "Fig. 1, 6 and 8: raw map, verdicts and map from above and in perspective, PNG and PLY");
  const auto options = std::make_shared<FiguresOptions>(command);
  command.add_option("--out", options->out, "folder to write to")->required();
  command.add_option("--run", options->run,
                     "draw the labels of this output folder of `dynains run` instead of running");
  add_window_options(command, options->window);
  command.add_option("--resolution", options->resolution, "one point per voxel of this edge [m]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  command.add_option("--pixels", options->pixels, "longer side of the pictures")
      ->check(CLI::Range(16, 16384))
      ->capture_default_str();
  command.add_flag("--quiet", options->quiet, "no progress");
  command.callback([options] { figures(*options); });
}

}  // namespace dynains::program
