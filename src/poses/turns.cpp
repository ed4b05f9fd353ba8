#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/median.hpp"
#include "dynains/poses/diagnosis.hpp"

namespace dynains {
namespace {

/// Azimuths (deg) of the points of a scan without jumps by a turn, if the points are in the order
/// of their measurement, and so the mean directions of its parts go around. NaN for invalid points.
/// Empty for other orders.
std::vector<double> azimuths_onward(const RecordedScan& scan) {
  constexpr std::size_t kParts = 36;
  constexpr double kMaxStep = 60.0, kDegrees = 180.0 / M_PI;  // deg; other patterns jump
  std::vector<double> azimuths(scan.size(), std::numeric_limits<double>::quiet_NaN());
  double direction = 0.0, onward = 0.0;  // of the part before, and the sign of the steps
  bool is_first = true;
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t begin = part * scan.size() / kParts, end = (part + 1) * scan.size() / kParts;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector2d p = scan.point(i).position.head<2>();
      if (!p.allFinite() || p.isZero(0.0)) continue;
      sum += p.normalized();
      azimuths[i] = kDegrees * std::atan2(p.y(), p.x());
    }
    if (sum.isZero(0.0)) continue;
    const double step = std::remainder(kDegrees * std::atan2(sum.y(), sum.x()) - direction, 360.0);
    if (!is_first && (std::abs(step) > kMaxStep || step * onward < 0.0)) return {};
    if (!is_first) onward = step;
    is_first = false;
    direction += step;
    for (std::size_t i = begin; i < end; ++i) {
      azimuths[i] = direction + std::remainder(azimuths[i] - direction, 360.0);
    }
  }
  return azimuths;
}

/// Angle (deg) by which the beams of a scan go around, if its points are in the order of their
/// measurement. Beams have azimuths of their own, so that it is the middle one of single beams.
std::optional<double> swept_angle(const RecordedScan& scan) {
  constexpr double kBeams = 600.0;     // per rad of elevation
  constexpr double kMaxAngle = 720.0;  // deg; other patterns only seem to go around
  struct Beam {
    double first = std::numeric_limits<double>::infinity(), last = -first;  // deg
    std::size_t count = 0;
  };
  const std::vector<double> azimuths = azimuths_onward(scan);
  std::map<long, Beam> beams;
  std::size_t most = 0;
  for (std::size_t i = 0; i < azimuths.size(); ++i) {
    if (std::isnan(azimuths[i])) continue;
    const Eigen::Vector3d p = scan.point(i).position;
    Beam& beam = beams[std::lround(kBeams * std::atan2(p.z(), p.head<2>().norm()))];
    beam.first = std::min(beam.first, azimuths[i]);
    beam.last = std::max(beam.last, azimuths[i]);
    most = std::max(most, ++beam.count);
  }
  std::vector<double> angles;
  for (const auto& [elevation, beam] : beams) {
    if (2 * beam.count > most) angles.push_back(beam.last - beam.first);
  }
  const double angle = median(std::move(angles));
  if (angle == 0.0 || angle > kMaxAngle) return std::nullopt;
  return angle;
}

}  // namespace

double overlap_of_turns(const Recording& recording, std::size_t first, std::size_t last) {
  constexpr double kMinOverlap = 1.5;  // deg
  constexpr std::size_t kScans = 12;
  if (recording.is_deskewed() || !recording.sensors().empty()) return 0.0;
  const std::size_t size = last - first + 1, count = std::min(kScans, size);
  double sum = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto angle = swept_angle(recording.read_scan(first + (2 * k + 1) * size / (2 * count)));
    if (!angle) return 0.0;
    sum += *angle;
  }
  // Some recorders cut by packets, now before and now behind a whole turn.
  const double overlap = sum / static_cast<double>(count) - 360.0;
  return overlap < kMinOverlap ? 0.0 : overlap / 360.0;
}

}  // namespace dynains
