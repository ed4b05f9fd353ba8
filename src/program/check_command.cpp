#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "command.hpp"
#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/diagnosis.hpp"
#include "lone_scans.hpp"
#include "recording_options.hpp"

namespace dynains::program {
namespace {

std::string fixed(double value, int digits, const char* unit = "") {
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value << unit;
  return text.str();
}

void print_line(const std::string& what, const std::string& value) {
  std::cout << std::left << std::setw(20) << what << value << '\n';
}

std::string to_text(const Agreement& agreement) {
  if (agreement.points == 0) return "nothing to compare";
  return fixed(100.0 * agreement.share, 0, " %") + " of points agree, gap " +
         fixed(100.0 * agreement.gap, 0, " cm");
}

std::string text_of(const Mounting& mounting) {
  if (!mounting.known) return "no ground found";
  std::string text =
      fixed(mounting.height, 2, " m over ground, tilted by ") + fixed(mounting.tilt(), 1, " deg");
  if (mounting.tilt() > 90.0) text += " (upside down)";
  return text;
}

/// Prints possible problems of a run other than poses.
void print_remarks(const Diagnosis& d) {
  if (d.invalid_share > 0.5) {
    std::cout << "note: more than half of the points are NaN, infinite or zero\n";
  }
  if (d.farthest > 1000.0) {
    std::cout << "note: ranges beyond 1 km: points seem not to be in metres, or not in the frame "
                 "of the sensor (--frame world)\n";
  } else if (d.farthest > 0.0 && d.farthest < 2.0) {
    std::cout << "note: all ranges are below 2 m: points seem not to be in metres\n";
  }
  if (d.ego_share > 0.3) {
    std::cout << "note: many points are nearer than 2 m; see --min-range\n";
  }
  if (!d.mounting.known) {
    std::cout << "note: without ground in sight, height and tilt are not known\n";
  }
}

/// The diagnosis reads a sample; this looks at every file, for scans that were cut off. Throws
/// IoError of the first and counts the others.
void check_files(const Recording& recording) {
  std::string first;
  std::size_t broken = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    try {
      recording.check_scan(i);
    } catch (const IoError& error) {
      if (broken == 0) first = error.what();
      ++broken;
    }
  }
  if (broken == 0) return;
  if (broken > 1) first += "; " + std::to_string(broken - 1) + " more scan files are broken";
  throw IoError(first);
}

void check(const RecordingFlags& flags) {
  const Recording recording(flags.folder(), flags.options());
  check_files(recording);
  const Diagnosis d = diagnose(recording);
  print_line("scans", std::to_string(d.scan_files) + " files, " + std::to_string(d.pose_rows) +
                          " poses, " + std::to_string(d.scans) + " scans with a pose");
  for (const std::string& note : recording.notes()) print_line("", note);
  print_line("time", fixed(d.period, 3, " s from scan to scan"));
  print_line("points", fixed(d.points, 0, " a scan, ") + fixed(100.0 * d.invalid_share, 1) +
                           " % invalid, " + fixed(100.0 * d.ego_share, 1) +
                           " % nearer than 2 m, 99 % within " + fixed(d.farthest, 0, " m"));
  print_line("sensor", text_of(d.mounting));
  print_line("motion", "median " + fixed(d.step, 2, " m from scan to scan, longest ") +
                           fixed(d.longest_step, 2, " m"));
  if (d.registered_pairs > 0) {
    print_line("poses", "off by " + fixed(100.0 * d.translation_error, 1, " cm and ") +
                            fixed(180.0 / M_PI * d.rotation_error, 2, " deg") +
                            " from one scan to the next, by the registration of " +
                            std::to_string(d.registered_pairs) + " pairs of scans");
  }
  std::cout << "\nscans " << d.stride << " apart, placed by\n";
  print_line("  poses as given", to_text(d.as_given));
  print_line("  no motion at all", to_text(d.standing));
  constexpr std::size_t kShown = 3;
  for (std::size_t i = 0; i < std::min(kShown, d.readings.size()); ++i) {
    print_line("  " + d.readings[i].option, "");
    print_line("", to_text(d.readings[i].agreement));
  }
  std::cout << '\n';
  print_remarks(d);
  std::optional<std::string> lone;
  if (recording.size() > 1) {
    lone = remark_on_lone_scans(recording, 0, recording.size() - 1, RemoverConfig());
  }
  if (!lone || !d.sound()) std::cout << advice(d) << std::endl;
  if (!d.option.empty()) {
    std::cout << "    dynains run " << flags.as_given(d.option) << " --out OUT\n";
  }
  if (lone) std::cout << *lone << '.' << std::endl;
  if (lone || !d.sound()) throw Finding{};
}

}  // namespace

void add_check_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand(
      "check", "Tell in seconds whether a recording will work, and which option it needs");
  const auto flags = std::make_shared<RecordingFlags>(command, "recording");
  command.footer(
      "Looks at the size of every scan file, and at a sample of scans: counts, units, invalid "
      "points, "
      "height\nand tilt of the sensor, and whether scans agree under the poses or under the usual "
      "mistakes. Registers\nneighbouring scans, for the error of the poses in cm and deg, the "
      "extrinsic calibration and the offset of\nthe clocks. Exits with 1 if a file is cut off, if "
      "the "
      "poses need another option or fit under none, or if\nscans are too far apart to be "
      "compared.");
  command.callback([flags] { check(*flags); });
}

}  // namespace dynains::program
