#include "odd_scans.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/threads/in_two_threads.hpp"
#include "io/points/finite_points.hpp"

namespace dynains::run {
namespace {

constexpr std::size_t kBeside = 4;  // scans on each side that are compared with each other

/// "3 scans from 000010 to 000014".
std::string text_of(const std::vector<std::size_t>& scans, std::size_t first,
                    const Recording& recording) {
  const std::string& name = recording.name(first + scans.front());
  if (scans.size() == 1) return "scan " + name;
  return std::to_string(scans.size()) + " scans from " + name + " to " +
         recording.name(first + scans.back());
}

/// Scans that do not fit as both beside, and up to 20 in which much more seems to move than in
/// both.
std::set<std::size_t> suspects(const std::vector<ScanCounts>& counts) {
  constexpr std::size_t kMaxPeaks = 20;
  constexpr double kTimesUsual = 4.0;  // changes from scan to scan
  std::set<std::size_t> scans;
  std::vector<double> changes;
  std::vector<std::pair<double, std::size_t>> peaks;
  for (std::size_t i = 1; i + 1 < counts.size(); ++i) {
    const ScanCounts &before = counts[i - 1], &scan = counts[i], &after = counts[i + 1];
    if (!scan.fits && before.fits && after.fits) scans.insert(i);
    changes.push_back(std::abs(scan.moving_share() - before.moving_share()));
    peaks.emplace_back(scan.moving_share() - std::max(before.moving_share(), after.moving_share()),
                       i);
  }
  const double least = kTimesUsual * median(std::move(changes));
  std::sort(peaks.rbegin(), peaks.rend());
  peaks.resize(std::min(kMaxPeaks, peaks.size()));
  for (const auto& [height, i] : peaks) {
    if (height > least) scans.insert(i);
  }
  return scans;
}

/// The ratio of points of each scan from `first`, at least 1, to `last` that agree with the scan
/// before under the poses; 1 if there is too little to compare.
std::vector<double> agreements(const Recording& recording, std::size_t first, std::size_t last) {
  std::vector<double> shares;
  std::optional<Landmarks> before;
  Mounting mounting;
  for (std::size_t i = first - 1; i <= last; ++i) {
    const PointBuffer points = sampled_points(recording.read_scan(i));
    if (!mounting.known) mounting = estimate_mounting(points);
    Landmarks scan(points, mounting);
    if (before) {
      const bool is_known = std::min(before->size(), scan.size()) >= kMinLandmarks;
      shares.push_back(is_known ? before->compare(scan, motion_between(recording, i - 1, i)).share
                                : 1.0);
    }
    before = std::move(scan);
  }
  return shares;
}

/// Those of the scans from `first` to `last`, neither the first nor the last of the recording, that
/// agree with neither scan beside them half as well as the scans around them usually do.
std::vector<std::size_t> misplaced_in(const Recording& recording, std::size_t first,
                                      std::size_t last) {
  const std::size_t begin = first > kBeside ? first - kBeside : 1;
  const std::size_t end = std::min(recording.size() - 1, last + kBeside);
  const std::vector<double> shares = agreements(recording, begin, end);
  std::vector<std::size_t> misplaced;
  for (std::size_t i = first; i <= last; ++i) {
    const std::size_t at = i - begin;  // with the scan before
    const std::size_t from = at + 1 > kBeside ? at + 1 - kBeside : 0;
    const std::size_t to = std::min(shares.size(), at + 1 + kBeside);
    const double usual = median(std::vector<double>(shares.begin() + std::ptrdiff_t(from),
                                                    shares.begin() + std::ptrdiff_t(to)));
    if (std::max(shares[at], shares[at + 1]) < 0.5 * usual) misplaced.push_back(i);
  }
  return misplaced;
}

/// All misplaced scans of the recording.
std::vector<std::size_t> misplaced_scans(const Recording& recording) {
  constexpr std::size_t kBlock = 64;
  if (recording.size() < 3) return {};
  const std::size_t last = recording.size() - 2;
  const auto blocks = in_two_threads((last + kBlock - 1) / kBlock, [&](std::size_t k) {
    return misplaced_in(recording, k * kBlock + 1, std::min(last, (k + 1) * kBlock));
  });
  std::vector<std::size_t> misplaced;
  for (const auto& block : blocks) misplaced.insert(misplaced.end(), block.begin(), block.end());
  return misplaced;
}

}  // namespace

std::vector<ScanCounts> count_points(const Recording& recording, const ScanRange& range) {
  std::vector<ScanCounts> counts;
  std::string first;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    try {
      counts.push_back({recording.point_count(i), 0});
    } catch (const IoError& error) {
      if (first.empty()) first = error.what();
    }
  }
  const std::size_t others = range.size() - counts.size() - (first.empty() ? 0 : 1);
  if (others > 0) first += "; " + std::to_string(others) + " more scan files are broken";
  if (!first.empty()) throw IoError(first + "; --accept-missing leaves such files out");
  return counts;
}

std::vector<std::size_t> thin_scans(const std::vector<ScanCounts>& counts) {
  constexpr std::size_t kBefore = 9;  // scans that are not thin
  constexpr double kFew = 0.6;        // ratio
  std::vector<double> before;
  for (std::size_t i = 0; i < std::min(kBefore, counts.size()); ++i) {
    before.push_back(static_cast<double>(counts[i].points));
  }
  // At the beginning, the larger half of the first scans.
  std::sort(before.begin(), before.end());
  before.erase(before.begin(), before.begin() + std::ptrdiff_t(before.size() / 2));
  std::vector<std::size_t> thin;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const auto points = static_cast<double>(counts[i].points);
    std::vector<double> sorted = before;
    std::sort(sorted.begin(), sorted.end());
    const double low = sorted[sorted.size() / 4];
    const double high = sorted[sorted.size() - 1 - sorted.size() / 4];
    if (points * high < kFew * low * low) {
      thin.push_back(i);
      continue;
    }
    if (before.size() == kBefore) before.erase(before.begin());
    before.push_back(points);
  }
  return thin;
}

std::vector<std::string> remarks_on_odd_scans(const Recording& recording, std::size_t first,
                                              const std::vector<ScanCounts>& counts,
                                              bool compares_all) {
  std::vector<std::string> remarks;
  const std::vector<std::size_t> thin = thin_scans(counts);
  if (!thin.empty()) {
    remarks.push_back(text_of(thin, first, recording) +
                      ": far fewer points than the scans before, as if cut off");
  }
  std::vector<std::size_t> misplaced;
  if (compares_all) {
    misplaced = misplaced_scans(recording);
  } else {
    for (const std::size_t i : suspects(counts)) {
      if (!misplaced_in(recording, first + i, first + i).empty()) misplaced.push_back(first + i);
    }
  }
  if (!misplaced.empty()) {
    remarks.push_back(text_of(misplaced, 0, recording) +
                      ": surfaces do not lie where the pose places them among the scans beside; is "
                      "the file, or the pose, that of another scan?");
  }
  return remarks;
}

}  // namespace dynains::run
