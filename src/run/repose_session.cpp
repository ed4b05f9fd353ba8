#include "repose_session.hpp"

#include <algorithm>
#include <cmath>

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_bytes.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"
#include "interrupt.hpp"
#include "labelled_sequence.hpp"

namespace dynains::program {
namespace {

SessionInfo session_of(const City& city, const std::string& name) {
  for (SessionInfo& session : city.sessions()) {
    if (session.name == name) return std::move(session);
  }
  throw ConfigError(city.folder().string() + ": has no session \"" + name +
                    "\"; name the session of the run by --session");
}

PointLabel label_of(std::uint32_t run_label, std::uint8_t cause, const float* point) {
  if (run_label == kRunMoving) return PointLabel::kDynamic;
  if (run_label == kRunStatic) {
    return cause == static_cast<std::uint8_t>(Cause::kGround) ? PointLabel::kGround
                                                              : PointLabel::kStatic;
  }
  const float sum = std::abs(point[0]) + std::abs(point[1]) + std::abs(point[2]);
  return std::isfinite(sum) && sum > 0.0F ? PointLabel::kOutOfRange : PointLabel::kInvalid;
}

}  // namespace

std::unique_ptr<SessionWriter> repose_session(const ReposedSession& request,
                                              const Recording& points, const Recording& corrected) {
  const City city(request.city);
  SessionInfo info = session_of(city, request.name);
  info.fingerprint = request.fingerprint;
  info.alignment.reset();
  auto writer = std::make_unique<SessionWriter>(city, info, SessionWriter::Mode::kReplace);
  RecordedScan scan;
  PointBuffer cloud;
  std::vector<PointLabel> verdicts;
  for (const std::size_t i : request.scans) {
    if (InterruptGuard::signal() != 0) throw Interrupted{InterruptGuard::signal()};
    points.read_scan(i, scan);
    const std::string& name = points.name(i);
    const std::filesystem::path file = request.run / "labels" / (name + ".label");
    const std::vector<std::uint32_t> run_labels = read_labels(file, scan.size());
    const std::vector<std::uint8_t> causes =
        read_point_bytes(request.run / "causes" / (name + ".cause"), scan.size());
    cloud.resize(scan.size());
    verdicts.resize(scan.size());
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const float* const p = scan.xyzi.data() + 4 * k;
      cloud.x[k] = p[0];
      cloud.y[k] = p[1];
      cloud.z[k] = p[2];
      verdicts[k] = label_of(run_class(run_labels[k], k, file), causes[k], p);
    }
    const auto labels = points.has_labels() ? points.read_labels(i) : std::vector<std::uint32_t>();
    writer->add(cloud, verdicts, labels, orthonormalized(corrected.T_world_sensor(i)),
                static_cast<std::uint32_t>(i));
  }
  writer->prepare();
  return writer;
}

}  // namespace dynains::program
