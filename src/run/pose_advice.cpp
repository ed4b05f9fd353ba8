#include "pose_advice.hpp"

#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <sstream>
#include <utility>
#include <vector>

#include "dynains/io/extrinsic.hpp"
#include "io/text.hpp"

namespace dynains::program {
namespace {

constexpr double kDegreesPerRadian = 180.0 / 3.14159265358979323846;

std::string decimal(double value, int digits) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

/// "12 cm and 0.3 deg from one scan to the next".
std::string error_text(const Diagnosis& d) {
  return decimal(100.0 * d.translation_error, 0) + " cm and " +
         decimal(kDegreesPerRadian * d.rotation_error, 1) + " deg from one scan to the next";
}

std::string body_text(const Pose& T_body_sensor) {
  constexpr double kUpright = 0.98;
  const Eigen::AngleAxisd rotation(detail::Quaternion(T_body_sensor.linear()));
  const Eigen::Vector3d t = T_body_sensor.translation();
  std::string text;
  if (std::abs(rotation.angle()) > 1e-6) {
    const Eigen::Vector3d& axis = rotation.axis();
    const bool is_yaw = std::abs(axis.z()) > kUpright;
    const double degrees =
        kDegreesPerRadian * rotation.angle() * (is_yaw && axis.z() < 0.0 ? -1.0 : 1.0);
    text = std::string(is_yaw ? "is yawed by " : "is turned by ") + decimal(degrees, 1) + " deg";
  }
  if (t.norm() > 0.0) {
    text += std::string(text.empty() ? "" : " and ") + "lies at (" + decimal(t.x(), 2) + ' ' +
            decimal(t.y(), 2) + ' ' + decimal(t.z(), 2) + ") m";
  }
  return text;
}

/// What an option means, and its flag; empty if a given flag has to be left out.
struct Change {
  std::string meaning;
  std::string flag;
};

std::vector<Change> changes_of_poses(const Recording& recording, const RecordingOptions& proposal) {
  const PoseConvention &given = recording.convention(), &other = proposal.convention;
  std::vector<Change> changes;
  const auto add = [&](bool is_changed, std::string meaning, std::string flag) {
    if (is_changed) changes.push_back({std::move(meaning), std::move(flag)});
  };
  add(other.invert != given.invert, "the poses are inverse (from the world to the sensor)",
      "--invert-poses");
  const bool is_wxyz = other.quaternion == QuaternionOrder::kWxyz;
  add(other.quaternion != given.quaternion,
      std::string("quaternions are in the order ") + (is_wxyz ? "w x y z" : "x y z w"),
      std::string("--quaternion-order ") + (is_wxyz ? "wxyz" : "xyzw"));
  add(other.left_handed != given.left_handed, "the poses are left-handed", "--left-handed-poses");
  const bool is_camera = other.frame == PoseFrame::kCamera;
  add(other.frame != given.frame,
      is_camera ? "the poses are those of a camera"
                : "the poses are those of the lidar, not of the camera",
      std::string("--pose-frame ") + (is_camera ? "camera" : "lidar"));
  const bool is_mm = other.unit == 0.001;
  add(other.unit != given.unit,
      std::string("translations are in ") + (is_mm ? "millimetres" : "centimetres"),
      std::string("--pose-units ") + (is_mm ? "mm" : "cm"));
  add(other.scale != given.scale,
      "all ways of the poses are " + decimal(other.scale, 3) +
          " times as long, as after an odometry with a wrong radius of wheels",
      "--pose-scale " + text::to_text(other.scale));
  const int shift = other.shift - given.shift;
  add(shift != 0,
      "the poses are off by " + std::to_string(std::abs(shift)) +
          (shift * shift == 1 ? " scan" : " scans"),
      "--pose-shift " + std::to_string(other.shift));
  add(!other.T_body_sensor.isApprox(given.T_body_sensor, 1e-12),
      "the poses are those of a body, such as an IMU or a vehicle, in which the lidar " +
          body_text(other.T_body_sensor) + " (parts that the drive does not determine are 0)",
      "--extrinsic \"" + extrinsic_text(other.T_body_sensor) + '"');
  add(proposal.time_offset != recording.time_offset(),
      "poses are taken " + decimal(std::abs(proposal.time_offset), 3) + " s " +
          (proposal.time_offset > 0.0 ? "after" : "before") + " the times of the scans",
      "--time-offset " + decimal(proposal.time_offset, 3));
  return changes;
}

std::vector<Change> changes_of(const Recording& recording, const RecordingOptions& proposal) {
  std::vector<Change> changes = changes_of_poses(recording, proposal);
  const RecordingOptions& given = recording.options();
  if (proposal.deskew && !given.deskew) {
    changes.push_back(
        {"their points are moved to the place of the sensor at the time of the scan", "--deskew"});
  } else if (proposal.frame != given.frame) {
    const std::string name = proposal.frame == PointFrame::kWorld ? "world" : "sensor";
    changes.push_back({"points are in the frame of the " + name, "--frame " + name});
  } else if (given.deskew && !proposal.deskew) {
    changes.push_back({"points are not moved by their times: leave --deskew out", ""});
  }
  if (proposal.sensor_origin != given.sensor_origin) {
    changes.push_back(
        {"beams begin at the origin of the clouds: leave --sensor-origin or --sensor-frame out",
         ""});
  }
  return changes;
}

std::string text_on_proposal(const Recording& recording, const Diagnosis& d) {
  std::string text = "Scans agree if ";
  const std::vector<Change> changes = changes_of(recording, d.proposal);
  for (std::size_t i = 0; i < changes.size(); ++i) {
    text += (i > 0 ? ", and " : "") + changes[i].meaning;
  }
  const std::string flags = proposed_flags(recording, d.proposal);
  return text + (flags.empty() ? "." : ": pass " + flags + '.');
}

/// The reason of poses that are inexact or wrong, if they show it.
std::string text_on_flaws(const PoseFlaws& flaws) {
  if (flaws.period > 0) {
    return " Scans " + std::to_string(flaws.period) +
           " apart agree better than neighbours, as those of several sensors on one topic "
           "(--frame-id takes one), or of parts of a turn (record whole turns).";
  }
  if (flaws.has_equal_orientations) {
    return " All orientations of the poses are equal: they have positions alone, or are frozen.";
  }
  if (flaws.step > 0.0) {
    return " The coordinates of the poses are in steps of " + decimal(flaws.step, 2) +
           " m: write them with all digits.";
  }
  return "";
}

}  // namespace

std::string proposed_flags(const Recording& recording, const RecordingOptions& proposal) {
  std::string flags;
  for (const Change& change : changes_of(recording, proposal)) {
    flags += (flags.empty() || change.flag.empty() ? "" : " ") + change.flag;
  }
  return flags;
}

std::string advice(const Recording& recording, const Diagnosis& d) {
  switch (d.verdict) {
    case PoseVerdict::kAgree:
      // Without a known mounting, an option for it may be needed.
      return std::string(recording.frame() == PointFrame::kWorld
                             ? "Points are in the frame of the world and agree there"
                             : "Scans and poses agree as they are") +
             (d.mounting.known ? "; no option is needed." : ".");
    case PoseVerdict::kInexact:
      return "Scans and poses agree roughly, but the poses are inexact by about " + error_text(d) +
             ": expect losses; poses of a LiDAR odometry would do better." + text_on_flaws(d.flaws);
    case PoseVerdict::kNoMotion:
      if (d.step * static_cast<double>(d.stride) > 1.0) {
        return "Too little stands beside the way to tell what the poses mean; nothing speaks "
               "against them.";
      }
      return "The sensor hardly moves, so that scans agree whatever the poses mean; nothing speaks "
             "against them.";
    case PoseVerdict::kOtherwise:
      return text_on_proposal(recording, d);
    case PoseVerdict::kDisagree:
      return "Scans do not agree under these poses, nor under any usual mistake: they belong to "
             "another recording or clock, or are far too inexact" +
             (d.registered_pairs > 0 ? " (off by " + error_text(d) + ")." : std::string(".")) +
             text_on_flaws(d.flaws);
    case PoseVerdict::kUnknown:
      return "There is too little to compare: at least two scans with walls, poles or trees within "
             "40 m are needed.";
  }
  return {};
}

}  // namespace dynains::program
