// Loop closure: a drive around a block of houses, with an odometry that drifts. Scans that come
// back to a place are registered to the scans of the first visit, and a pose graph corrects all
// poses. Verdicts compare neighbouring scans, so a loop closure does not change them: the static
// map is built again from the static points of each scan.
//
//   example_loop_closure [scans]
//
// The world is made of boxes, so the program needs no data.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <dynains/dyna_ins_remover.hpp>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "small_odometry.hpp"

namespace {

using small_odometry::Points;
using Poses = std::vector<Eigen::Isometry3d>;
using Vector6 = Eigen::Matrix<double, 6, 1>;  // rotation (rad), translation (m)
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kStep = 0.4;    // m from scan to scan
constexpr double kPeriod = 0.1;  // s
constexpr double kHeight = 1.8;  // m, of the sensor
constexpr double kRange = 50.0;  // m
constexpr double kCorner = 8.0;  // m, radius
constexpr double kStreet = 7.0;  // m, from the middle of the street to the houses

struct Box {
  Eigen::Vector3d low, high;  // m, world frame
};

// A rectangular way with round corners, around a block of houses.
class Way {
 public:
  explicit Way(double length) : long_side_(0.3 * length), short_side_(0.2 * length) {}

  double long_side() const { return long_side_; }
  double short_side() const { return short_side_; }
  double length() const { return 2.0 * (straight(0) + straight(1)) + 2.0 * M_PI * kCorner; }

  // Pose after `s` m, counterclockwise, x ahead.
  Eigen::Isometry3d at(double s) const {
    s = std::fmod(s, length());
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(kCorner, 0.0, kHeight);
    for (int side = 0;; ++side) {
      const double ahead = std::min(s, straight(side));
      T.translate(Eigen::Vector3d(ahead, 0.0, 0.0));
      s -= ahead;
      const double turn = std::min(s / kCorner, M_PI / 2);
      if (s <= 0.0 && ahead < straight(side)) return T;
      T.translate(Eigen::Vector3d(kCorner * std::sin(turn), kCorner * (1 - std::cos(turn)), 0.0));
      T.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
      s -= turn * kCorner;
      if (turn < M_PI / 2) return T;
    }
  }

 private:
  double straight(int side) const {
    return (side % 2 == 0 ? long_side_ : short_side_) - 2.0 * kCorner;
  }

  double long_side_;   // m
  double short_side_;  // m
};

// Houses, posts and parked cars along both sides of a way, and cars that drive on it.
class World {
 public:
  explicit World(const Way& way) : way_(way) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(0.0, 1.0);
    const double w = way.long_side(), h = way.short_side();
    // Beside each side of the way: begin, direction, and the normal to the outside.
    const std::array<std::array<Eigen::Vector2d, 3>, 4> sides = {{{{{0, 0}, {1, 0}, {0, -1}}},
                                                                  {{{w, 0}, {0, 1}, {1, 0}}},
                                                                  {{{w, h}, {-1, 0}, {0, 1}}},
                                                                  {{{0, h}, {0, -1}, {-1, 0}}}}};
    for (const auto& [begin, along, outwards] : sides) {
      const double length = std::abs(along.x()) > 0.5 ? w : h;
      for (const double side : {1.0, -1.0}) {
        for (double s = side > 0 ? -15.0 : 12.0; s < length + (side > 0 ? 15.0 : -20.0);) {
          const double front = 6.0 + 12.0 * any(random);
          const double setback = kStreet + 2.0 * any(random);
          add(begin + s * along + side * setback * outwards,
              begin + (s + front) * along + side * (setback + 8.0) * outwards,
              4.0 + 6.0 * any(random));
          s += front + 1.0 + 3.0 * any(random);
        }
        for (double s = 5.0 * any(random); s < length; s += 9.0 + 6.0 * any(random)) {
          const Eigen::Vector2d post = begin + s * along + side * 4.5 * outwards;
          add(post, post + Eigen::Vector2d(0.3, 0.3), 4.0);
          const Eigen::Vector2d car = begin + (s + 3.0) * along + side * 3.0 * outwards;
          if (side > 0) add(car, car + 4.2 * along + 1.7 * outwards, 1.5);
        }
      }
    }
  }

  // Points at a time (s), sensor frame: 16 beams, 2 cm of noise.
  Points measure(const Eigen::Isometry3d& T_world_sensor, double time, std::mt19937& random) const {
    const Eigen::Vector3d sensor = T_world_sensor.translation();
    std::vector<Box> near = cars_at(time);
    near.insert(near.end(), boxes_.begin(), boxes_.end());
    near.erase(
        std::remove_if(near.begin(), near.end(),
                       [&](const Box& box) {
                         return Eigen::AlignedBox3d(box.low, box.high).exteriorDistance(sensor) >
                                kRange;
                       }),
        near.end());
    std::normal_distribution<double> noise(0.0, 0.02);
    Points points;
    for (int beam = 0; beam < 16; ++beam) {
      const double elevation = (-15.0 + 2.0 * beam) * M_PI / 180.0;
      for (int k = 0; k < 450; ++k) {
        const double azimuth = 2.0 * M_PI * k / 450.0;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const Eigen::Vector3d direction = T_world_sensor.linear() * ray;
        double range = direction.z() < 0.0 ? -sensor.z() / direction.z() : kRange;
        for (const Box& box : near) range = std::min(range, hit(box, sensor, direction));
        if (range < kRange) points.push_back((range + noise(random)) * ray);
      }
    }
    return points;
  }

 private:
  void add(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double height) {
    boxes_.push_back({{std::min(a.x(), b.x()), std::min(a.y(), b.y()), 0.0},
                      {std::max(a.x(), b.x()), std::max(a.y(), b.y()), height}});
  }

  // Cars of the other direction, 7 m/s.
  std::vector<Box> cars_at(double time) const {
    std::vector<Box> cars;
    const double length = way_.length();
    for (double s = 20.0; s < length - 15.0; s += 45.0) {
      const double place = std::fmod(s - 7.0 * time, length);
      const Eigen::Isometry3d T = way_.at(place < 0.0 ? place + length : place);
      const Eigen::Vector3d centre = T * Eigen::Vector3d(0.0, 2.8, 0.0);
      const bool is_along_x = std::abs(T(0, 0)) > std::abs(T(1, 0));
      const Eigen::Vector3d half =
          is_along_x ? Eigen::Vector3d(2.1, 0.9, 0.0) : Eigen::Vector3d(0.9, 2.1, 0.0);
      Box car{centre - half, centre + half};
      car.low.z() = 0.2;
      car.high.z() = 1.6;
      cars.push_back(car);
    }
    return cars;
  }

  static double hit(const Box& box, const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
    double enter = 0.0, leave = kRange;
    for (int axis = 0; axis < 3; ++axis) {
      const double inverse = 1.0 / direction[axis];
      const double a = (box.low[axis] - from[axis]) * inverse;
      const double b = (box.high[axis] - from[axis]) * inverse;
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter > 0.0 && enter < leave ? enter : kRange;
  }

  Way way_;
  std::vector<Box> boxes_;
};

// Measured motion between two scans.
struct Edge {
  std::size_t a, b;
  Eigen::Isometry3d T_a_b;
  Vector6 weight;  // 1 / standard deviation
};

Edge edge(std::size_t a, std::size_t b, const Eigen::Isometry3d& T_a_b, double radians,
          double metres) {
  Edge result{a, b, T_a_b, Vector6::Zero()};
  result.weight << Eigen::Vector3d::Constant(1.0 / radians),
      Eigen::Vector3d::Constant(1.0 / metres);
  return result;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Gauss-Newton on poses T_world_sensor; pose 0 stays. A pose changes to T exp(x), and errors are
// small, so that the error E = T_a_b^-1 T_a^-1 T_b changes by x_b - Ad(T_b^-1 T_a) x_a.
void optimize(Poses& poses, const std::vector<Edge>& edges) {
  constexpr int kIterations = 8;
  const auto unknowns = static_cast<Eigen::Index>(6 * poses.size());
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns);
    const auto add_block = [&](std::size_t a, std::size_t b, const Matrix6& block) {
      for (Eigen::Index i = 0; i < 6; ++i) {
        for (Eigen::Index j = 0; j < 6; ++j) {
          entries.emplace_back(6 * static_cast<int>(a) + static_cast<int>(i),
                               6 * static_cast<int>(b) + static_cast<int>(j), block(i, j));
        }
      }
    };
    for (const Edge& e : edges) {
      const Eigen::Isometry3d T_b_a = poses[e.b].inverse() * poses[e.a];
      const Eigen::Isometry3d E = e.T_a_b.inverse() * T_b_a.inverse();
      const Eigen::AngleAxisd turn(E.linear());
      Vector6 r;
      r << turn.angle() * turn.axis(), E.translation();
      Matrix6 J_a = Matrix6::Zero();
      J_a.topLeftCorner<3, 3>() = -T_b_a.linear();
      J_a.bottomRightCorner<3, 3>() = -T_b_a.linear();
      J_a.bottomLeftCorner<3, 3>() = -cross_matrix(T_b_a.translation()) * T_b_a.linear();
      const Matrix6 W = e.weight.cwiseAbs2().asDiagonal();
      add_block(e.a, e.a, J_a.transpose() * W * J_a);
      add_block(e.a, e.b, J_a.transpose() * W);
      add_block(e.b, e.a, W * J_a);
      add_block(e.b, e.b, W);
      gradient.segment<6>(6 * static_cast<Eigen::Index>(e.a)) += J_a.transpose() * W * r;
      gradient.segment<6>(6 * static_cast<Eigen::Index>(e.b)) += W * r;
    }
    add_block(0, 0, 1e12 * Matrix6::Identity());
    Eigen::SparseMatrix<double> H(unknowns, unknowns);
    H.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(H);
    const Eigen::VectorXd x = solver.solve(-gradient);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Vector6 step = x.segment<6>(6 * static_cast<Eigen::Index>(i));
      const Eigen::Vector3d turn = step.head<3>();
      poses[i].translate(Eigen::Vector3d(step.tail<3>()));
      poses[i].rotate(Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()));
      poses[i].linear() = Eigen::Quaterniond(poses[i].linear()).normalized().toRotationMatrix();
    }
    if (x.lpNorm<Eigen::Infinity>() < 1e-5) break;
  }
}

// Closures between scans of the second visit of a place and those of the first, by registration to
// a map of the scans around the first. Scans are found by their distance under drifting poses,
// which is enough for one loop; larger maps need a recognition of places.
std::vector<Edge> close_loops(const std::vector<Points>& scans, const Poses& poses,
                              std::size_t revisit) {
  constexpr std::size_t kEvery = 5;    // scans
  constexpr std::size_t kAround = 15;  // scans
  constexpr double kMaxRange = 25.0;   // m
  constexpr double kOverlap = 0.7;
  std::vector<Edge> closures;
  for (std::size_t b = revisit; b < poses.size(); b += kEvery) {
    std::size_t a = 0;
    const auto distance = [&](std::size_t i) {
      return (poses[i].translation() - poses[b].translation()).norm();
    };
    for (std::size_t i = 0; i + revisit / 2 < b; ++i) a = distance(i) < distance(a) ? i : a;
    if (distance(a) > kMaxRange) continue;
    small_odometry::LocalMap map(100.0);
    Points around;
    const std::size_t end = std::min(a + kAround + 1, poses.size());
    for (std::size_t i = a < kAround ? 0 : a - kAround; i < end; ++i) {
      const Eigen::Isometry3d T_a_i = poses[a].inverse() * poses[i];
      for (const Eigen::Vector3d& p : scans[i]) around.push_back(T_a_i * p);
    }
    map.insert(around, Eigen::Vector3d::Zero());
    const Points thinned = small_odometry::thin_out(scans[b], 1.0);
    // The drift may exceed the reach of a registration, so several guesses along the way are tried.
    Eigen::Isometry3d best = Eigen::Isometry3d::Identity();
    double most = 0.0;
    for (const double ahead : {0.0, -4.0, 4.0, -8.0, 8.0}) {
      Eigen::Isometry3d guess = poses[a].inverse() * poses[b];
      guess.translation() = Eigen::Vector3d(ahead, 0.0, 0.0);
      const Eigen::Isometry3d T_a_b = small_odometry::align(thinned, map, guess);
      const double share = small_odometry::overlap(thinned, map, T_a_b);
      if (share <= most) continue;
      most = share;
      best = T_a_b;
    }
    if (most > kOverlap) closures.push_back(edge(a, b, best, 0.002, 0.05));
  }
  return closures;
}

// `truth`, moved as a whole to where it fits `poses` best: the first pose of an odometry defines
// its frame, and its tilt is as inexact as any.
Poses fitted_to(const Poses& poses, const Poses& truth) {
  Eigen::Matrix3Xd from(3, truth.size()), to(3, truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = truth[i].translation();
    to.col(static_cast<Eigen::Index>(i)) = poses[i].translation();
  }
  const Eigen::Isometry3d T(Eigen::umeyama(from, to, false));
  Poses fitted;
  for (const Eigen::Isometry3d& pose : truth) fitted.push_back(T * pose);
  return fitted;
}

double rms_error(const Poses& poses, const Poses& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(poses.size()));  // m
}

// The static points of a scan whose verdict is final, thinned; sensor frame.
dynains::PointBuffer static_points(const Points& scan, const dynains::ScanVerdict& verdict) {
  Points points;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const dynains::PointLabel label = verdict.labels[i];
    if (label == dynains::PointLabel::kStatic || label == dynains::PointLabel::kGround) {
      points.push_back(scan[i]);
    }
  }
  dynains::PointBuffer buffer;
  for (const Eigen::Vector3d& p : small_odometry::thin_out(points, 0.4)) {
    buffer.push_back(float(p.x()), float(p.y()), float(p.z()));
  }
  return buffer;
}

// The static map under these poses.
Points map_of(const std::vector<dynains::PointBuffer>& scans, const Poses& poses) {
  dynains::StaticMapAccumulator map;
  for (std::size_t i = 0; i < scans.size(); ++i) map.insert(scans[i], {}, poses[i]);
  Points points;
  map.for_each([&](const Eigen::Vector3d& p) { points.push_back(p); });
  return points;
}

using Cells = std::set<std::array<int, 2>>;

// Cells (from above, `edge` m) in which something stands: heights differ by 0.5 m. So drifting
// ground has none.
Cells cells_of(const Points& points, double edge) {
  constexpr double kUpright = 0.5;                              // m
  std::map<std::array<int, 2>, std::array<double, 2>> heights;  // lowest, highest
  for (const Eigen::Vector3d& p : points) {
    const std::array<int, 2> cell = {static_cast<int>(std::floor(p.x() / edge)),
                                     static_cast<int>(std::floor(p.y() / edge))};
    auto& [low, high] =
        heights.try_emplace(cell, std::array<double, 2>{p.z(), p.z()}).first->second;
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  Cells cells;
  for (const auto& [cell, range] : heights) {
    if (range[1] - range[0] > kUpright) cells.insert(cell);
  }
  return cells;
}

// Share of the cells of `cells` that are not in `others`.
double share_outside(const Cells& cells, const Cells& others) {
  std::size_t outside = 0;
  for (const auto& cell : cells) outside += others.count(cell) == 0 ? 1 : 0;
  return static_cast<double>(outside) / static_cast<double>(std::max<std::size_t>(1, cells.size()));
}

// Errors of poses and of the map under them.
struct Quality {
  double rms;      // m, of the positions
  double outside;  // share of the cells of the map where the map under true poses has none
};

Quality assess(const std::vector<dynains::PointBuffer>& scans, const Poses& poses,
               const Poses& truth) {
  constexpr double kEdge = 0.4;  // m
  const Poses fitted = fitted_to(poses, truth);
  return {rms_error(poses, fitted), share_outside(cells_of(map_of(scans, poses), kEdge),
                                                  cells_of(map_of(scans, fitted), kEdge))};
}

void print(const char* name, const Quality& quality) {
  std::printf("%-7s positions wrong by %.3f m (rms), %.1f %% of the map where nothing stands\n",
              name, quality.rms, 100.0 * quality.outside);
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t count = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 2000;
  if (count < 200) {
    std::printf("expected at least 200 scans\n");
    return 2;
  }
  // An eighth of the drive is on streets that were driven before.
  const Way way(kStep * static_cast<double>(count) / 1.125 + 13.8);
  const World world(way);
  std::mt19937 random(1);

  small_odometry::Odometry odometry(30.0);
  dynains::DynaInsRemover remover;
  std::vector<Points> scans;
  std::deque<Points> open;                    // scans whose verdicts are not final yet
  std::vector<dynains::PointBuffer> statics;  // by scan
  const auto keep = [&](const dynains::ScanVerdict& verdict) {
    statics.push_back(static_points(open.front(), verdict));
    open.pop_front();
  };
  Poses poses, truth;
  const Eigen::Isometry3d T_first_world = way.at(0.0).inverse();
  for (std::size_t i = 0; i < count; ++i) {
    const double time = kPeriod * static_cast<double>(i);
    const Eigen::Isometry3d T_world_sensor = way.at(kStep * static_cast<double>(i));
    const Points scan = world.measure(T_world_sensor, time, random);
    truth.push_back(T_first_world * T_world_sensor);
    poses.push_back(odometry.register_scan(scan));
    open.push_back(scan);
    const dynains::FrameResult frame = remover.push(scan, poses.back(), time);
    if (frame.finished) keep(*frame.finished);
    scans.push_back(small_odometry::thin_out(scan, 0.4));
  }
  remover.flush(keep);
  const Quality drifted = assess(statics, poses, truth);

  const auto revisit = static_cast<std::size_t>(way.length() / kStep);
  std::vector<Edge> edges = close_loops(scans, poses, revisit);
  const std::size_t closures = edges.size();
  for (std::size_t i = 0; i + 1 < count; ++i) {
    edges.push_back(edge(i, i + 1, poses[i].inverse() * poses[i + 1], 0.001, 0.01));
  }
  const auto start = std::chrono::steady_clock::now();
  optimize(poses, edges);
  const auto optimized = std::chrono::steady_clock::now();
  const Points map = map_of(statics, poses);
  const auto built = std::chrono::steady_clock::now();
  const Quality closed = assess(statics, poses, truth);

  const auto seconds = [](auto from, auto to) {
    return std::chrono::duration<double>(to - from).count();
  };
  std::printf("%zu scans, %.0f m, %zu closures\n", count, kStep * static_cast<double>(count),
              closures);
  print("before:", drifted);
  print("after:", closed);
  std::printf("pose graph %.2f s, map %.2f s, %zu points\n", seconds(start, optimized),
              seconds(optimized, built), map.size());
  const bool is_better = closed.rms < 0.7 * drifted.rms && closed.outside < 0.7 * drifted.outside;
  return closures > 0 && is_better ? 0 : 1;
}
