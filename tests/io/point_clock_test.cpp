// Units and outliers of the times of points.
#include "io/points/point_clock.hpp"

#include "ros_writer.hpp"
#include "support/catch.hpp"

namespace dynains::point_clock_test {

using namespace test;

namespace {

constexpr std::size_t kPoints = 200;
constexpr double kPeriod = 0.1;   // s
constexpr double kSpeed = 20.0;   // m/s along x
constexpr double kStart = 1.7e9;  // s
const double kNan = std::numeric_limits<double>::quiet_NaN();

/// Times of point k of a scan with this stamp, `offset` s after it.
using Stored = std::function<double(std::size_t k, double offset, double stamp)>;

double offset_of(std::size_t k) {
  return 0.0995 * static_cast<double>(k) / static_cast<double>(kPoints);
}

/// A scan of points that all see one place while the sensor moves; every tenth has no return.
RecordedScan scan_at(double stamp, const Stored& stored) {
  RecordedScan scan;
  for (std::size_t k = 0; k < kPoints; ++k) {
    const bool has_return = k % 10 != 9;
    const auto x = static_cast<float>(30.0 - kSpeed * offset_of(k));
    for (const float value : {has_return ? x : 0.0F, has_return ? 8.0F : 0.0F, 0.0F, 0.5F}) {
      scan.xyzi.push_back(value);
    }
    scan.time.push_back(stored(k, offset_of(k), stamp));
  }
  return scan;
}

PointClockFinding find(const Stored& stored, double period = kPeriod, double unit = 0.0) {
  std::vector<double> times;
  for (int i = 0; i < 8; ++i) times.push_back(kStart + period * i);
  RecordedScan scan;
  return find_clock(times, true, unit, [&](std::size_t i) -> const RecordedScan& {
    return scan = scan_at(times[i], stored);
  });
}

void check_unit(const Stored& stored, double unit, bool is_absolute, double period = kPeriod) {
  const PointClockFinding finding = find(stored, period);
  CAPTURE(finding.text, unit, period);
  REQUIRE(finding.clock);
  CHECK(finding.clock->unit == unit);
  CHECK(finding.clock->is_absolute == is_absolute);
}

/// A folder of scans with times, or a log with a field of this type.
void write_drive(const fs::path& folder, const Stored& stored) {
  PointColumns columns;
  columns.time = true;
  std::string times, poses;
  for (int i = 0; i < 6; ++i) {
    const double stamp = kStart + kPeriod * i;
    const RecordedScan scan = scan_at(stamp, stored);
    fs::create_directories(folder);
    PointFileWriter writer(folder / (std::to_string(i) + ".ply"), columns);
    for (std::size_t k = 0; k < scan.size(); ++k) writer.add(scan.point(k));
    writer.commit();
    times += std::to_string(stamp) + '\n';
    poses += std::to_string(stamp) + ' ' + std::to_string(kSpeed * kPeriod * i) + " 0 0 0 0 0 1\n";
  }
  write_text(folder / "times.txt", times);
  write_text(folder / "poses.tum", poses);
}

RecordingOptions with_deskewing() {
  RecordingOptions options;
  options.deskew = true;
  options.frame = PointFrame::kSensor;
  return options;
}

/// Largest distance of a de-skewed point from its place, m; points for which `counts` is false are
/// left out.
double error_of(const fs::path& folder, const std::function<bool(std::size_t)>& counts,
                const RecordingOptions& options = with_deskewing()) {
  const Recording recording(folder, options);
  double worst = 0.0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const RecordedScan scan = recording.read_scan(i);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      if (k % 10 == 9 || !counts(k)) continue;
      worst = std::max(worst, std::abs(scan.xyzi[4 * k] - 30.0));
    }
  }
  return worst;
}

bool every(std::size_t) { return true; }

}  // namespace

TEST_CASE("The unit of times is found for s, ms, us and ns, relative and absolute") {
  for (const double unit : {1.0, 1e-3, 1e-6, 1e-9}) {
    const auto relative = [&](std::size_t, double offset, double) { return offset / unit; };
    const auto absolute = [&](std::size_t, double offset, double stamp) {
      return (stamp + offset) / unit;
    };
    const auto before = [&](std::size_t, double offset, double) { return (offset - 0.1) / unit; };
    check_unit(relative, unit, false);
    check_unit(absolute, unit, true);
    check_unit(before, unit, false);
    // Keyframes 5 s apart, and packets of a sensor that turns in 0.1 s.
    check_unit(relative, unit, false, 5.0);
    check_unit([&](std::size_t, double offset, double) { return offset / 80.0 / unit; }, unit,
               false, 0.1 / 76.0);
  }
}

TEST_CASE("Times from 0 to 1 are shares of a scan, unless scans may be missing") {
  const auto share = [](std::size_t, double offset, double) { return offset / 0.1; };
  const PointClockFinding finding = find(share);
  REQUIRE(finding.clock);
  CHECK(finding.clock->unit == Approx(kPeriod));
  CHECK_THAT(finding.text, ContainsSubstring("count as shares of a scan of 0.1"));
  for (const double period : {0.3, 1.0, 5.0}) {
    const PointClockFinding unknown = find(share, period);
    CHECK_FALSE(unknown.clock);
    CHECK_THAT(unknown.text, ContainsSubstring("found times of points from 0.04") &&
                                 ContainsSubstring("give the unit with --point-time-unit"));
    CHECK(find(share, period, 0.1).clock->unit == 0.1);
  }
}

TEST_CASE("Times that fit no unit are refused with numbers of the file, or by the given unit") {
  for (const double factor : {5.0, 50.0}) {
    const auto stored = [&](std::size_t, double offset, double) { return factor * offset; };
    const PointClockFinding finding = find(stored);
    CHECK_FALSE(finding.clock);
    CHECK_THAT(finding.text, ContainsSubstring("expected times in s, ms, us or ns") &&
                                 ContainsSubstring("scans that are 0.1"));
  }
  const auto overlapping = [](std::size_t, double offset, double) { return 5.0 * offset; };
  CHECK(find(overlapping, kPeriod, 1.0).clock->unit == 1.0);
  CHECK_FALSE(find(overlapping, kPeriod, 10.0).clock);
  const PointClockFinding constant = find([](std::size_t, double, double) { return 1.7e9; });
  CHECK_FALSE(constant.clock);
  CHECK_THAT(constant.text, ContainsSubstring("expected times that differ from point to point"));
  CHECK_FALSE(find([](std::size_t, double, double) { return kNan; }).clock);
}

TEST_CASE("Times that cannot be those of the scan are counted up to a tenth, and not used") {
  const auto with_outliers = [](std::size_t every, double outlier, double unit) {
    return [=](std::size_t k, double offset, double) {
      return k % every == 0 ? outlier : offset / unit;
    };
  };
  for (const double unit : {1.0, 1e-6}) {
    const PointClockFinding some = find(with_outliers(40, 3.9 / unit, unit));
    REQUIRE(some.clock);
    CHECK(some.clock->unit == unit);
    CHECK_THAT(some.text, StartsWith("25 of 900 points in 5 scans have times that cannot be"));
    CHECK(find(with_outliers(11, 3.9 / unit, unit)).clock);
    CHECK_FALSE(find(with_outliers(8, 3.9 / unit, unit)).clock);
    CHECK(find(with_outliers(8, 3.9 / unit, unit), kPeriod, unit).clock->unit == unit);
  }
  // Points without a return do not count, even if they have a time.
  const PointClockFinding finding =
      find([](std::size_t k, double offset, double) { return k % 10 == 9 ? 4.29 : offset; });
  REQUIRE(finding.clock);
  CHECK(finding.text.empty());
}

/// A scan of 360 points around the sensor, the first one behind it, in order or not. `share`: of a
/// turn that the points cover; `stored(azimuth, share)` gives the time of the point at this share
/// of the scan.
PointClockFinding find_around(bool is_sorted, double share, double unit,
                              const std::function<double(std::size_t, double)>& stored,
                              double period = kPeriod) {
  std::vector<double> times;
  for (int i = 0; i < 8; ++i) times.push_back(kStart + period * i);
  RecordedScan scan;
  constexpr std::size_t kAround = 360;
  for (std::size_t k = 0; k < kAround; ++k) {
    const std::size_t at = is_sorted ? k : 89 * k % kAround;
    const double turn = static_cast<double>(at) / kAround;
    const double azimuth = 2.0 * M_PI * share * turn - M_PI;
    for (const double value : {9.0 * std::cos(azimuth), 9.0 * std::sin(azimuth), 0.0, 0.5}) {
      scan.xyzi.push_back(static_cast<float>(value));
    }
    scan.time.push_back(stored(k, turn));
  }
  return find_clock(times, true, unit, [&](std::size_t) -> const RecordedScan& { return scan; });
}

TEST_CASE("Times that follow neither order nor direction of the points are told") {
  const auto by_direction = [](std::size_t, double turn) { return 0.0995 * turn; };
  const auto by_order = [](std::size_t k, double) { return 0.0995 * static_cast<double>(k) / 360; };
  const auto random = [](std::size_t k, double) {
    return 0.0995 * static_cast<double>(211 * k % 360) / 360;
  };
  CHECK(find_around(true, 1.0, 0.0, by_direction).text.empty());
  CHECK(find_around(false, 1.0, 0.0, by_direction).text.empty());
  CHECK(find_around(false, 1.0, 0.0, by_order).text.empty());
  for (const bool is_sorted : {true, false}) {
    const PointClockFinding finding = find_around(is_sorted, 1.0, 0.0, random);
    REQUIRE(finding.clock);
    CHECK_THAT(finding.text, StartsWith("times of points follow neither the order"));
  }
}

TEST_CASE("Scans that take another time than the interval of scans are told") {
  const auto of_duration = [](double duration, double unit = 1.0) {
    return [=](std::size_t, double turn) { return duration * turn / unit; };
  };
  for (const double duration : {0.05, 0.0995, 0.11}) {
    CHECK(find_around(true, 1.0, 0.0, of_duration(duration)).text.empty());
  }
  for (const double duration : {0.01, 0.04, 0.13}) {
    const PointClockFinding finding = find_around(true, 1.0, 0.0, of_duration(duration));
    REQUIRE(finding.clock);
    CHECK_THAT(finding.text, StartsWith("times of points in units of 1 s give a scan"));
  }
  // Hundredths of a second look like milliseconds.
  CHECK_THAT(find_around(true, 1.0, 0.0, of_duration(0.0995, 0.01)).text,
             StartsWith("times of points in units of 0.001 s"));
  CHECK(find_around(true, 1.0, 0.01, of_duration(0.0995, 0.01)).text.empty());
  // A unit that is given is told, too.
  CHECK_THAT(find_around(true, 1.0, 1e-4, of_duration(0.0995, 1e-3)).text,
             StartsWith("times of points in units of"));
  // A quarter of a turn takes a quarter of the time, and keyframes are farther apart.
  CHECK(find_around(true, 0.25, 0.0, of_duration(0.025)).text.empty());
  CHECK(find_around(true, 1.0, 0.0, of_duration(0.0995), 1.0).text.empty());
}

TEST_CASE("Files are de-skewed by times of any unit, and garbage keeps its place") {
  const TemporaryFolder folder;
  const fs::path drive = folder / "drive";
  const auto check = [&](const Stored& stored, const std::function<bool(std::size_t)>& counts) {
    fs::remove_all(drive);
    write_drive(drive, stored);
    CHECK(error_of(drive, counts) < 0.01);
  };
  check([](std::size_t, double offset, double) { return offset; }, every);
  check([](std::size_t, double offset, double) { return 1e6 * offset; }, every);
  check([](std::size_t, double offset, double stamp) { return 1e6 * (stamp + offset); }, every);
  check([](std::size_t, double offset, double) { return 10.0 * offset; }, every);
  const auto is_good = [](std::size_t k) { return k % 40 != 1; };
  check([&](std::size_t k, double offset, double) { return is_good(k) ? offset : 3.6; }, is_good);
  CHECK(Recording(drive, with_deskewing()).warnings().size() == 1);
  check(
      [&](std::size_t k, double offset, double stamp) { return is_good(k) ? stamp + offset : 0.0; },
      is_good);
  check([](std::size_t k, double offset, double) { return k % 10 == 9 ? 4.29 : offset; }, every);

  fs::remove_all(drive);
  write_drive(drive, [](std::size_t, double offset, double) { return 5.0 * offset; });
  CHECK_THAT(message_of<IoError>([&] { Recording(drive, with_deskewing()); }),
             StartsWith(drive.string() + ": cannot be de-skewed: expected times in s") &&
                 ContainsSubstring("--point-time-unit"));
  CHECK_NOTHROW(Recording(drive).read_scan(0));
  RecordingOptions options = with_deskewing();
  options.point_time_unit = 0.2;
  CHECK(error_of(drive, every, options) < 0.01);
}

}  // namespace dynains::point_clock_test
