#include <array>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/simulation/statistics.hpp"

namespace dynains::program {
namespace {

using simulation::ScanStatistics;

ScanStatistics statistics_of(const std::string& folder, std::size_t step) {
  const Recording recording(folder);
  ScanStatistics statistics;
  RecordedScan scan;
  for (std::size_t i = 0; i < recording.size(); i += step) {
    recording.read_scan(i, scan);
    std::vector<std::uint32_t> labels;
    if (recording.has_labels()) labels = recording.read_labels(i);
    statistics.add(scan.xyzi, labels);
  }
  return statistics;
}

void print_table(const std::vector<std::string>& folders, std::size_t step) {
  std::cout << "| sequence | points | <5 m | 5-10 | 10-20 | 20-30 | 30-50 | 50-80 | >80 | ground | "
               "moving | car at 10 m | 20 m | 40 m |\n|---|";
  for (int i = 0; i < 13; ++i) std::cout << "---:|";
  std::cout << '\n' << std::fixed;
  for (const std::string& folder : folders) {
    const ScanStatistics s = statistics_of(folder, step);
    std::cout << "| " << folder << " | " << std::setprecision(0) << s.points_per_scan() << " | "
              << std::setprecision(1);
    for (const double part : s.range_shares()) std::cout << 100 * part << " % | ";
    std::cout << 100 * s.ground_share() << " % | " << 100 * s.moving_share() << " % |"
              << std::setprecision(0);
    const auto points = s.points_per_car();
    const auto cars = s.cars();
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (cars[k] == 0) {
        std::cout << " - |";
      } else {
        std::cout << ' ' << points[k] << " |";
      }
    }
    std::cout << std::endl;
  }
}

}  // namespace

void add_statistics_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand(
      "statistics", "Numbers by which simulated and real scans can be compared");
  auto folders = std::make_shared<std::vector<std::string>>();
  auto step = std::make_shared<std::size_t>(1);
  command.add_option("SEQ", *folders, "recordings")->required()->type_name("");
  command.add_option("--step", *step, "look at every n-th scan only [1]")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}))
      ->type_name("INT");
  command.footer(
      "Prints a table in Markdown: points per scan, shares by range, of ground and of moving "
      "points, and the median number of points of a car about 10, 20 and 40 m away.");
  command.callback([folders, step] { print_table(*folders, *step); });
}

}  // namespace dynains::program
