#include "repose_session.hpp"

#include <utility>

#include "dynains/errors.hpp"
#include "dynains/pose.hpp"
#include "interrupt.hpp"
#include "label_writer.hpp"

namespace dynains::program {
namespace {

SessionInfo session_of(const City& city, const std::string& name) {
  for (SessionInfo& session : city.sessions()) {
    if (session.name == name) return std::move(session);
  }
  throw ConfigError(city.folder().string() + ": has no session \"" + name +
                    "\"; name the session of the run by --session");
}

}  // namespace

std::unique_ptr<SessionWriter> repose_session(const ReposedSession& request,
                                              const Recording& points, const Recording& corrected,
                                              ByteStore& store) {
  const City city(request.city);
  SessionInfo info = session_of(city, request.name);
  info.fingerprint = request.fingerprint;
  info.alignment.reset();
  auto writer = std::make_unique<SessionWriter>(city, std::move(info), store, SessionConfig(),
                                                SessionWriter::Mode::kReplace);
  RecordedScan scan;
  PointBuffer cloud;
  VerdictArrays verdict;
  const LabelFiles files(request.run / "labels", request.run / "causes");
  for (const std::size_t i : request.scans) {
    if (InterruptGuard::signal() != 0) throw Interrupted{InterruptGuard::signal()};
    points.read_scan(i, scan);
    files.read(points.name(i), scan, verdict);
    cloud.clear();
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const float* const p = scan.xyzi.data() + 4 * k;
      cloud.push_back(p[0], p[1], p[2]);
    }
    const auto labels = points.has_labels() ? points.read_labels(i) : std::vector<std::uint32_t>();
    writer->add(cloud, verdict.labels, labels, orthonormalized(corrected.T_world_sensor(i)),
                static_cast<std::uint32_t>(i));
  }
  writer->prepare();
  return writer;
}

}  // namespace dynains::program
