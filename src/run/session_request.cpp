#include "session_request.hpp"

#include <algorithm>

#include "dynains/city/city.hpp"
#include "dynains/city/session_aligner.hpp"
#include "dynains/errors.hpp"
#include "dynains/pose.hpp"
#include "recorded_scans.hpp"

namespace dynains::run {
namespace {

/// Whether a session was aligned as the request asks for.
bool has_alignment(const SessionRequest& request, const SessionInfo& session) {
  if (session.alignment.has_value() != request.T_city_start.has_value()) return false;
  return !session.alignment ||
         session.alignment->T_city_start.matrix() == request.T_city_start->matrix();
}

}  // namespace

bool SessionRequest::is_fulfilled() const {
  if (!std::filesystem::exists(city)) return false;
  const City opened = City::open_or_make(city, grid);
  const std::vector<SessionInfo>& sessions = opened.sessions();
  return std::any_of(sessions.begin(), sessions.end(), [&](const SessionInfo& session) {
    return session.name == info.name && session.fingerprint == info.fingerprint &&
           session.begin == info.begin && has_alignment(*this, session) &&
           session.config == info.config;
  });
}

SessionRequest reposed_session(const std::filesystem::path& folder, const std::string& name,
                               const std::string& fingerprint) {
  const City city(folder);
  SessionRequest request{folder, city.sessions()[city.number_of(name)], city.grid(), {}};
  request.info.fingerprint = fingerprint;
  request.info.alignment.reset();
  return request;
}

SessionRequest aligned(SessionRequest request, const Recording& recording, const ScanRange& range) {
  if (!request.T_city_start) return request;
  if (!std::filesystem::exists(request.city)) {
    throw ConfigError(request.city.string() +
                      ": there is no map to align with; add its first session without --align");
  }
  SessionAligner aligner(City::open_or_make(request.city, request.grid));
  RecordedScan scan;
  PointBuffer points;
  const std::size_t count = std::min(range.size(), SessionAligner::kMaxScans);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i =
        range.first + k * (range.size() - 1) / std::max<std::size_t>(count - 1, 1);
    recording.read_scan(i, scan);
    copy_points(scan, points);
    aligner.add(points, orthonormalized(recording.T_world_sensor(i)));
  }
  request.info.alignment = aligner.align(*request.T_city_start);
  return request;
}

}  // namespace dynains::run
