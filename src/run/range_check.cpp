#include "range_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <locale>
#include <sstream>
#include <string>
#include <vector>

#include "dynains/errors.hpp"

namespace dynains::program {
namespace {

/// Ranges in the x-y plane of the points with a return.
void add_ranges(const RecordedScan& scan, std::vector<double>& ranges) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const float* p = scan.xyzi.data() + 4 * i;
    const double range = std::hypot(p[0], p[1]);
    if (std::isfinite(range) && std::isfinite(p[2]) && range > 0.0) ranges.push_back(range);
  }
}

}  // namespace

void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given) {
  constexpr double kFarthestReturn = 250.0;  // m, of most points of a LiDAR
  std::vector<double> ranges;
  for (const std::size_t i : {range.first, range.first + range.size() / 2, range.last}) {
    add_ranges(recording.read_scan(i), ranges);
  }
  if (ranges.empty()) return;
  std::sort(ranges.begin(), ranges.end());
  const auto count_within = [&](double most) {
    return static_cast<double>(std::upper_bound(ranges.begin(), ranges.end(), most) -
                               ranges.begin());
  };
  const auto count = static_cast<double>(ranges.size());
  const double judged = (count_within(config.max_range) - count_within(config.min_range)) / count;
  const bool is_far = !unit_is_given && count_within(kFarthestReturn) < 0.1 * count;
  if (judged >= 0.01 && !is_far) return;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed << std::setprecision(1) << recording.folder().string() << ": "
       << 100.0 * judged << " % of the points can be judged, those from " << config.min_range
       << " m (--min-range) to " << config.max_range
       << " m (--max-range) from the sensor; half of the points are beyond "
       << ranges[ranges.size() / 2]
       << " m. If coordinates are in millimetres or centimetres: --point-units mm, --point-units "
          "cm; in the frame of the world: --frame world; else --point-units m runs unless nothing "
          "can be judged";
  throw ConfigError(text.str());
}

}  // namespace dynains::program
