// Least-squares plane of a point set, from its moments.
#pragma once

#include <cmath>
#include <cstddef>

namespace dynains::detail {

/// Moments of a point set: sums of the weights, coordinates and products of coordinates. The origin
/// of the coordinates should be near the points, for accurate sums.
struct PlaneMoments {
  double count = 0.0;
  double x = 0.0, y = 0.0, z = 0.0;
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  /// Adds a point with a weight.
  void add(double px, double py, double pz, double weight) {
    const double wx = weight * px;
    const double wy = weight * py;
    const double wz = weight * pz;
    *this += {weight, wx, wy, wz, wx * px, wx * py, wx * pz, wy * py, wy * pz, wz * pz};
  }
  PlaneMoments& operator+=(const PlaneMoments& other) {
    count += other.count;
    x += other.x;
    y += other.y;
    z += other.z;
    xx += other.xx;
    xy += other.xy;
    xz += other.xz;
    yy += other.yy;
    yz += other.yz;
    zz += other.zz;
    return *this;
  }
};

/// Variance (m^2) of a point set along the unit vector `u`. Requires `count` > 0.
inline double variance_along(const PlaneMoments& m, const double (&u)[3]) {
  const double mean = (u[0] * m.x + u[1] * m.y + u[2] * m.z) / m.count;
  const double square = (u[0] * u[0] * m.xx + u[1] * u[1] * m.yy + u[2] * u[2] * m.zz +
                         2.0 * (u[0] * u[1] * m.xy + u[0] * u[2] * m.xz + u[1] * u[2] * m.yz)) /
                        m.count;
  return square - mean * mean;
}

/// Whether a plane with the unit normal `n` is the trace of a beam: the points of one beam in
/// foliage, on persons or on a rough wall spread over a plane that contains the beam, and so does
/// the noise of its ranges. Such a plane moves with the sensor. A surface at a small angle to the
/// beams is longer along them than the noise. `beam`: from the sensor to the points, m. `edge_on`:
/// sine of the angle below which a plane contains the beam.
inline bool is_trace_of_beam(const double (&beam)[3], const double (&n)[3],
                             const PlaneMoments& points, double edge_on = 0.04) {
  constexpr double kGrazing = 0.3;    // sine of the angle between beam and plane
  constexpr double kMinLength = 0.2;  // m, standard deviation along the beam
  const double range = std::sqrt(beam[0] * beam[0] + beam[1] * beam[1] + beam[2] * beam[2]);
  const double across = beam[0] * n[0] + beam[1] * n[1] + beam[2] * n[2];
  if (std::abs(across) >= kGrazing * range) return false;
  if (std::abs(across) < edge_on * range) return true;
  const double length = std::sqrt(range * range - across * across);
  double along[3];
  for (std::size_t k = 0; k < 3; ++k) along[k] = (beam[k] - across * n[k]) / length;
  return variance_along(points, along) < kMinLength * kMinLength;
}

/// Plane through a mean point with an upward unit normal, in the frame of the moments.
struct Plane {
  double normal_x = 0.0, normal_y = 0.0, normal_z = 1.0;
  double mean_x = 0.0, mean_y = 0.0, mean_z = 0.0;
  double spread = 0.0;    ///< sum of the eigenvalues of the covariance
  double flatness = 0.0;  ///< smallest eigenvalue of the covariance, divided by their sum: [0, 1/3]
};

/// Fits a plane by total least squares: the normal is the eigenvector of the smallest eigenvalue of
/// the covariance. Newton's method from zero converges monotonically to this eigenvalue, the
/// smallest root of a cubic. Requires `count` >= 3. If all points are equal or on a line, the
/// normal is one of the many solutions.
inline Plane fit_plane(const PlaneMoments& m) {
  Plane plane;
  const double inverse = 1.0 / m.count;
  plane.mean_x = m.x * inverse;
  plane.mean_y = m.y * inverse;
  plane.mean_z = m.z * inverse;
  const double xx = m.xx * inverse - plane.mean_x * plane.mean_x;
  const double xy = m.xy * inverse - plane.mean_x * plane.mean_y;
  const double xz = m.xz * inverse - plane.mean_x * plane.mean_z;
  const double yy = m.yy * inverse - plane.mean_y * plane.mean_y;
  const double yz = m.yz * inverse - plane.mean_y * plane.mean_z;
  const double zz = m.zz * inverse - plane.mean_z * plane.mean_z;

  const double trace = xx + yy + zz;
  if (!(trace > 0.0)) return plane;
  const double minors = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz;
  const double determinant =
      xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  double lambda = 0.0;
  for (int i = 0; i < 12; ++i) {
    const double value = ((lambda - trace) * lambda + minors) * lambda - determinant;
    const double slope = (3.0 * lambda - 2.0 * trace) * lambda + minors;
    if (!(slope > 0.0) || !(value < 0.0)) break;
    const double step = value / slope;
    lambda -= step;
    if (-step <= 1e-12 * trace) break;
  }
  plane.spread = trace;
  plane.flatness = lambda / trace;

  // The normal is orthogonal to each row of (covariance - lambda I). The longest cross product of
  // two rows is the most accurate.
  const double a = xx - lambda;
  const double b = yy - lambda;
  const double c = zz - lambda;
  const double cross[3][3] = {
      {xy * yz - xz * b, xz * xy - a * yz, a * b - xy * xy},
      {xy * c - xz * yz, xz * xz - a * c, a * yz - xy * xz},
      {b * c - yz * yz, yz * xz - xy * c, xy * yz - b * xz},
  };
  double best = 0.0;
  for (const auto& n : cross) {
    const double squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (squared > best) {
      best = squared;
      const double scale = (n[2] < 0.0 ? -1.0 : 1.0) / std::sqrt(squared);
      plane.normal_x = n[0] * scale;
      plane.normal_y = n[1] * scale;
      plane.normal_z = n[2] * scale;
    }
  }
  return plane;
}

}  // namespace dynains::detail
