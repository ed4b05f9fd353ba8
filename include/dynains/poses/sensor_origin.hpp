// Position of the sensor in the clouds of a recording, found in its scans.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Where the rays of scans begin, if that is not the origin of their frame.
struct RayOrigin {
  enum class Known {
    kNothing,     ///< rays begin elsewhere, but the scans do not show where
    kHorizontal,  ///< x and y; z is 0, since only beams of fixed elevations show it
    kPosition
  };
  Known known = Known::kNothing;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, frame of the clouds
  double hidden_as_given = 0.0;  ///< ratio of points behind nearer ones, seen from the given origin
  double hidden = 0.0;           ///< the same, seen from `position`
};

/// Looks for the point at which the rays of scans begin: from there, points of one beam have one
/// elevation, and no point is behind nearer ones. `scans`: a few scans of one sensor, m, finite
/// points. Empty if that point is the origin, or if the scans do not show it.
std::optional<RayOrigin> find_ray_origin(const std::vector<PointBuffer>& scans);

/// As above, for a sample of the scans `first` to `last` (inclusive). The position is relative to
/// the clouds as recorded; Recording::sensor_origin() does not change it. Empty, too, if
/// compensated motion during a scan explains what the scans show. Throws IoError.
std::optional<RayOrigin> find_ray_origin(const Recording& recording, std::size_t first,
                                         std::size_t last);

/// The flag of `dynains run` for that position, such as `--sensor-origin "1.00 0.00 1.50"`; empty
/// if nothing is known of it.
std::string option_for(const RayOrigin& origin);

/// One sentence on the finding and its option.
std::string advice(const RayOrigin& origin);

}  // namespace dynains
