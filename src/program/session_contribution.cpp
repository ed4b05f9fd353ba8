#include "session_contribution.hpp"

#include <algorithm>

#include "dynains/io/city.hpp"

namespace dynains::program {

bool SessionRequest::is_fulfilled() const {
  if (!std::filesystem::exists(city / "city.json")) return false;
  const std::vector<SessionInfo> sessions = City(city).sessions();
  return std::any_of(sessions.begin(), sessions.end(), [&](const SessionInfo& session) {
    return session.name == info.name && session.fingerprint == info.fingerprint &&
           session.begin == info.begin &&
           nlohmann::json::parse(session.config, nullptr, false) ==
               nlohmann::json::parse(info.config, nullptr, false);
  });
}

SessionContribution::SessionContribution(const SessionRequest& request)
    : writer_(City::open_or_make(request.city, request.grid), request.info) {}

void SessionContribution::add(const RecordedScan& scan, const ScanVerdict& verdict,
                              const std::vector<std::uint32_t>& labels, std::size_t number) {
  points_.resize(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    points_.x[i] = scan.xyzi[4 * i];
    points_.y[i] = scan.xyzi[4 * i + 1];
    points_.z[i] = scan.xyzi[4 * i + 2];
  }
  writer_.add(points_, verdict.labels, labels, verdict.T_world_sensor,
              static_cast<std::uint32_t>(number));
}

}  // namespace dynains::program
