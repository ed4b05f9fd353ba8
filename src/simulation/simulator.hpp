// Simulation of labelled scans by ray casting.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "dynains/pose.hpp"
#include "simulation/renderer.hpp"
#include "simulation/world.hpp"

namespace dynains::simulation {

/// Least instance id of the changes of a place from day to day.
inline constexpr std::uint32_t kFirstChange = 0xF000;
/// Least instance id of static things, with Config::static_instances.
inline constexpr std::uint32_t kFirstStatic = 0x4000;

/// True state of an object at the time of a scan.
struct ObjectState {
  /// Instance id from 1, the upper 16 bits of its labels; from kFirstChange on for a change of the
  /// place, which has its id on all days
  std::uint32_t instance;
  std::uint32_t label;           ///< SemanticKITTI class, the lower 16 bits in this scan
  Pose T_world_object;           ///< origin: centre of the footprint on the ground; x forward
  double speed;                  ///< m/s
  double length, width, height;  ///< m
};

/// One scan with its ground truth.
struct SimulatedScan {
  /// s, of the first beam; 0 for the first scan of a place without days and of day 1, 86400 for
  /// that of day 2
  double time = 0.0;
  std::vector<float> xyzi;            ///< interleaved; m, sensor frame; reflectivity in [0, 1]
  std::vector<std::uint32_t> labels;  ///< by point: SemanticKITTI class | instance << 16
  std::vector<float> times;           ///< by point: s after `time`; empty without a rolling shutter
  std::vector<std::uint8_t> sensors;  ///< by point: number of its sensor; empty without a rig
  Pose T_world_sensor = Pose::Identity();  ///< of the body, with a rig; so is the next
  Pose T_world_sensor_noisy = Pose::Identity();
  std::vector<ObjectState> objects;  ///< vehicles and people near the sensor, also parked ones
};

/// Place where a beam meets the ground or an object.
struct Surface {
  float range = 0;   ///< m
  float cosine = 1;  ///< of the angle of incidence
  float loss = 0;    ///< probability of no return, besides that of weak returns
  float reflectivity = 0;
  float roughness = 0;  ///< m, added to the noise of the range
  std::uint32_t label = 0;
};

inline constexpr double kMovingSpeed = 0.5;  // m/s

/// A sensor of a rig, from the middle of the body on the ground.
struct Mount {
  double x, y, z;     ///< m
  double yaw, pitch;  ///< deg, positive looks to the left and down
  double clock;       ///< when it measures after the stamp, as a share of the time between scans
};

inline const std::vector<Mount>& mounts_of(Rig rig) {
  static const std::vector<Mount> kMounts[] = {
      {},
      {{0.8, 0, 1.9, 0, 0, 0}, {-1.6, 0, 1.9, 180, 0, 0.35}},
      {{0.3, 0, 2.1, 0, 0, 0}, {0.3, 0.75, 1.8, 90, 15, 0.3}, {0.3, -0.75, 1.8, -90, 15, 0.65}},
      {{2.1, 1.1, 0.85, 60, 0, 0}, {2.1, -1.1, 0.85, -60, 0, 0.45}},
      {{0.35, 0, 0.6, 0, 15, 0}, {-0.35, 0, 0.6, 180, 15, 0.5}}};
  return kMounts[static_cast<std::size_t>(rig)];
}

/// At (x, y, z), turned by Rz(yaw) Ry(pitch) Rx(roll).
inline Pose pose_of(double yaw, double pitch, double roll, double x = 0, double y = 0,
                    double z = 0) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return Eigen::Translation3d(x, y, z) * AngleAxisd(yaw, Vector3d::UnitZ()) *
         AngleAxisd(pitch, Vector3d::UnitY()) * AngleAxisd(roll, Vector3d::UnitX());
}

inline Rigid to_rigid(const Pose& t) {
  auto f = [&t](int r, int c) { return static_cast<float>(t(r, c)); };
  return {{{f(0, 0), f(0, 1), f(0, 2)}, {f(1, 0), f(1, 1), f(1, 2)}, {f(2, 0), f(2, 1), f(2, 2)}},
          {f(0, 3), f(1, 3), f(2, 3)}};
}

/// A body of the given length and width on uneven ground.
inline Pose stand_on(Terrain& terrain, const Waypoint& at, double length, double width) {
  const Vec2 u = direction(at.heading), v = left_of(u);
  double front = 0, rear = 0, left = 0, right = 0;
  // Several places under each axle: tyres and springs swallow the smallest bumps.
  for (const double shift : {-0.4, 0.0, 0.4}) {
    for (const int side : {-1, 1}) {
      const Vec2 middle = at.position + shift * u + (side * 0.4 * width) * v;
      const double f = terrain.height(middle + (0.3 * length) * u) / 6;
      const double r = terrain.height(middle - (0.3 * length) * u) / 6;
      front += f;
      rear += r;
      (side > 0 ? left : right) += f + r;
    }
  }
  const double pitch = -std::atan2(front - rear, 0.6 * length);
  const double roll = std::atan2(left - right, 0.8 * width);
  const double z = 0.5 * (front + rear);
  return pose_of(at.heading, pitch, roll, at.position.x, at.position.y, z);
}

inline float power_of(const Surface& surface, float share) {
  return share * surface.reflectivity / std::max(surface.range * surface.range, 0.01F);
}

/// The return of two surfaces, `share` of the beam on the first: one if they are less than 1.5 m
/// apart, which is of neither if it lies more than 0.25 m from both.
inline Surface one_return(const Surface& own, const Surface& other, float share) {
  if (std::abs(own.range - other.range) > 1.5F) {
    return power_of(own, share) >= power_of(other, 1 - share) ? own : other;
  }
  Surface result = share >= 0.5F ? own : other;
  result.range = share * own.range + (1 - share) * other.range;
  if (std::min(std::abs(result.range - own.range), std::abs(result.range - other.range)) > 0.25F) {
    result.label = kClasses.outlier;
  }
  return result;
}

/// Generates the scans of one sequence. The world frame has z up and differs from the first sensor
/// frame.
///
/// All points of a scan are measured at one time from one pose, as after motion compensation. With
/// Config::rolling_shutter, points are measured over 1 / rate seconds, in the frame of the sensor
/// at the time of the point. Beams without a return give no point. Equal Configs give bit-identical
/// scans.
class Simulator {
 public:
  /// Generates the scene and the motion of all objects for the whole sequence. Throws ConfigError.
  explicit Simulator(const Config& config)
      : config_((config.validate(), config)),
        model_(sensor_model(config.sensor, config.seed)),
        world_(build_world(config)) {
    if (config_.max_range > 0) model_.max_range = config_.max_range;
    if (config_.sensor_height > 0) model_.height = config_.sensor_height;
    play();
    draw_drift();
  }

  const Config& config() const { return config_; }
  /// Number of scans.
  std::size_t size() const { return static_cast<std::size_t>(config_.scans); }
  /// Poses T_body_sensor of the sensors of a rig; empty without one.
  std::vector<Pose> mounts() const {
    std::vector<Pose> poses;
    for (const Mount& mount : mounts_of(config_.rig)) poses.push_back(mount_pose(mount));
    return poses;
  }

  /// Scan i < size(), in any order. Not const, because scratch memory is reused.
  SimulatedScan scan(std::size_t index) {
    const Moment& moment = moments_.at(index);
    SimulatedScan result;
    result.time = moment.time + 86400.0 * std::max(0, config_.day - 1);
    result.T_world_sensor = moment.T_world_sensor;
    result.T_world_sensor_noisy = with_noise(moment.T_world_sensor, index);

    const std::uint64_t scan_seed = mix(seed_of_day(config_, 500), index);
    if (!takes_time()) {
      measure_part(index, moment, {0, model_.columns}, scan_seed, result);
      return result;
    }
    // Sensors of a rig, or columns of a scan, fewer if their points have no times.
    const std::vector<Mount>& mounts = mounts_of(config_.rig);
    const bool has_times = mounts.empty() && config_.deskewed <= 0;
    const int parts = has_times ? 40 : mounts.empty() ? 12 : static_cast<int>(mounts.size());
    for (int part = 0; part < parts; ++part) {
      const Mount* const mount = mounts.empty() ? nullptr : &mounts[static_cast<std::size_t>(part)];
      BeamTable::Columns columns{0, model_.columns};
      if (mount == nullptr) {
        columns = {model_.columns * part / parts, model_.columns * (part + 1) / parts};
      }
      const double middle = 0.5 * (columns.first + columns.last) / model_.columns;
      Moment now =
          between(moment, moments_.at(index + 1), mount == nullptr ? middle : mount->clock);
      if (mount != nullptr) now.T_world_sensor = now.T_world_sensor * mount_pose(*mount);
      const std::size_t first = result.labels.size();
      measure_part(index, now, columns, mix(scan_seed, static_cast<std::uint64_t>(part)), result);
      if (has_times) {
        result.times.resize(result.labels.size(), static_cast<float>(now.time - moment.time));
        continue;
      }
      const Pose step = moment.T_world_sensor.inverse() * now.T_world_sensor;
      move_points(mount == nullptr ? share_of(step, config_.deskewed) : step, first, result);
      if (mount != nullptr)
        result.sensors.resize(result.labels.size(), static_cast<std::uint8_t>(part));
    }
    return result;
  }

 private:
  /// Where everything is at one time.
  struct Moment {
    double time = 0;
    EgoPose ego;
    Pose T_world_sensor = Pose::Identity();
    std::vector<ObjectPose> objects;
  };

  /// Whether a scan is measured until the next one begins.
  bool takes_time() const { return config_.rolling_shutter || config_.rig != Rig::kNone; }

  /// A part of a small motion.
  static Pose share_of(const Pose& step, double share) {
    const double half = 0.5 * share;
    return pose_of(half * (step(1, 0) - step(0, 1)), half * (step(0, 2) - step(2, 0)),
                   half * (step(2, 1) - step(1, 2)), share * step(0, 3), share * step(1, 3),
                   share * step(2, 3));
  }

  /// Moves the points from number `first` on.
  static void move_points(const Pose& T_target_source, std::size_t first, SimulatedScan& scan) {
    const Rigid T = to_rigid(T_target_source);
    for (std::size_t i = first; i < scan.labels.size(); ++i) {
      float* point = &scan.xyzi[4 * i];
      const Vec3 p = T * Vec3{point[0], point[1], point[2]};
      point[0] = p.x;
      point[1] = p.y;
      point[2] = p.z;
    }
  }

  Pose mount_pose(const Mount& mount) const {
    return pose_of(mount.yaw * kPi / 180, mount.pitch * kPi / 180, 0, mount.x, mount.y, mount.z) *
           pose_of(model_.yaw, 0, 0);
  }

  /// Moves everybody through the whole sequence.
  void play() {
    const double interval = 1 / config_.rate;
    const int steps = std::max(1, static_cast<int>(std::ceil(interval / 0.05)));
    const double dt = interval / steps;
    std::map<std::size_t, Vec2> first_seen;
    ever_moved_.assign(world_.traffic.objects.size(), false);
    const int moments = config_.scans + (takes_time() ? 1 : 0);
    for (int i = 0; i < moments; ++i) {
      const EgoPose ego = world_.traffic.ego();
      const double time = i * interval;
      Moment moment{time, ego, sensor_pose(ego, time),
                    world_.traffic.around(ego.at.position, model_.max_range + 8)};
      moment.objects.erase(moment.objects.begin());  // the vehicle of the sensor
      ever_moved_.resize(world_.traffic.objects.size(), false);
      for (const ObjectPose& pose : moment.objects) {
        const Vec2 first = first_seen.emplace(pose.object, pose.at.position).first->second;
        const bool has_moved = norm(pose.at.position - first) > 0.5;  // m
        if (pose.speed > kMovingSpeed || has_moved) ever_moved_[pose.object] = true;
      }
      moments_.push_back(std::move(moment));
      for (int k = 0; k < steps; ++k) world_.traffic.step(dt);
    }
  }

  static Waypoint between(const Waypoint& a, const Waypoint& b, double share) {
    Waypoint at = a;
    at.position = a.position + share * (b.position - a.position);
    at.heading = a.heading + share * wrap(b.heading - a.heading);
    return at;
  }

  /// `share` of the way from `a` to `b`. Ground and springs move the sensor as at that time.
  Moment between(const Moment& a, const Moment& b, double share) {
    Moment moment = a;
    moment.time = a.time + share * (b.time - a.time);
    moment.ego.at = between(a.ego.at, b.ego.at, share);
    moment.ego.speed += share * (b.ego.speed - a.ego.speed);
    moment.ego.acceleration += share * (b.ego.acceleration - a.ego.acceleration);
    moment.ego.turn_rate += share * (b.ego.turn_rate - a.ego.turn_rate);
    moment.T_world_sensor = sensor_pose(moment.ego, moment.time);
    for (ObjectPose& pose : moment.objects) {
      const auto later =
          std::find_if(b.objects.begin(), b.objects.end(),
                       [&](const ObjectPose& other) { return other.object == pose.object; });
      if (later == b.objects.end()) continue;
      pose.at = between(pose.at, later->at, share);
      pose.phase += share * (later->phase - pose.phase);
    }
    return moment;
  }

  /// With a rig, that of the body.
  Pose sensor_pose(const EgoPose& ego, double time) {
    if (config_.rig != Rig::kNone) return body_pose(ego, time);
    const double pitch = config_.mounting_pitch * kPi / 180;
    const double roll = config_.mounting_roll * kPi / 180;
    return body_pose(ego, time) * pose_of(0, pitch, roll, 0, 0, model_.height) *
           pose_of(model_.yaw, 0, 0);
  }

  /// Pose of the body that carries the sensor, at the ground.
  Pose body_pose(const EgoPose& ego, double time) {
    switch (config_.gait) {
      case Gait::kHandHeld:
        return upright(ego.at) * hand_held_sway(std::min(1.0, ego.speed), time);
      case Gait::kLegged:
        return stand_on(world_.terrain, ego.at, 0.9, 0.5) *
               trot(std::min(1.0, ego.speed / 0.5), time);
      case Gait::kVehicle:
        break;
    }
    return stand_on(world_.terrain, ego.at, 4.3, 1.8) * springs(ego, time);
  }

  Pose upright(const Waypoint& at) {
    return pose_of(at.heading, 0, 0, at.position.x, at.position.y,
                   world_.terrain.height(at.position));
  }

  /// Braking, bends, and a little swaying while driving.
  static Pose springs(const EgoPose& ego, double time) {
    const double sway = std::min(1.0, ego.speed / 5) * 0.12 * kPi / 180;
    const double pitch = -0.0035 * std::clamp(ego.acceleration, -4.0, 2.0) +
                         sway * (std::sin(2 * kPi * 1.3 * time) + std::sin(2 * kPi * 0.71 * time));
    const double roll = 0.004 * std::clamp(ego.speed * ego.turn_rate, -3.0, 3.0) +
                        sway * std::sin(2 * kPi * 0.93 * time + 1);
    return pose_of(0, pitch, roll);
  }

  /// A person looks around all the time, and bobs with `stride` (0 to 1) at 1.8 steps a second.
  static Pose hand_held_sway(double stride, double time) {
    const double look = 1.15 * time;  // with the amplitude below up to 40 deg/s
    const double step = 2 * kPi * 1.8 * time, deg = kPi / 180;
    const double yaw = 0.6 * std::sin(look);
    const double pitch = deg * (2.5 * std::sin(0.5 * look) + stride * std::sin(step));
    const double roll = deg * 2 * std::sin(0.7 * look + 1);
    return pose_of(yaw, pitch, roll, 0, 0.03 * stride * std::sin(step / 2),
                   0.03 * stride * std::sin(step));
  }

  /// A robot on four legs, with two steps of each pair of legs a second.
  static Pose trot(double stride, double time) {
    const double step = 2 * kPi * 2 * time, deg = kPi / 180;
    return pose_of(stride * deg * 2 * std::sin(step / 2), stride * deg * 1.2 * std::sin(2 * step),
                   stride * deg * 1.5 * std::sin(step), 0.01 * stride * std::sin(2 * step), 0,
                   0.015 * stride * std::sin(2 * step));
  }

  static Eigen::Vector3d draw_normal(double sigma, Random& random) {
    Eigen::Vector3d result;
    for (double& v : result) v = sigma * random.normal();
    return result;
  }

  Pose with_noise(const Pose& pose, std::size_t index) const {
    Random random(mix(seed_of_day(config_, 600), index));
    const Eigen::Vector3d offset = draw_normal(config_.pose_noise_translation, random);
    const Eigen::Vector3d turn = draw_normal(config_.pose_noise_rotation * kPi / 180, random);
    Pose result = pose * pose_of(turn.x(), turn.y(), turn.z());
    result.translation() = pose.translation() + offset + drift_.at(index);
    return result;
  }

  /// A random walk of the written poses with the way.
  void draw_drift() {
    Random random(seed_of_day(config_, 700));
    drift_.assign(moments_.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 1; i < moments_.size(); ++i) {
      const double way = norm(moments_[i].ego.at.position - moments_[i - 1].ego.at.position);
      drift_[i] = drift_[i - 1] + draw_normal(config_.pose_drift * std::sqrt(way / 100), random);
    }
  }

  void draw_world(const Moment& moment, std::vector<ObjectState>& states) {
    const Pose T_sensor_world = moment.T_world_sensor.inverse();
    const Rigid T_world_sensor = to_rigid(moment.T_world_sensor);
    const Rigid turn{transposed(T_world_sensor.rotation), {}};
    const Vec3 origin = T_world_sensor.translation;
    const Vec2 centre{moment.T_world_sensor(0, 3), moment.T_world_sensor(1, 3)};
    for (std::size_t i = 0; i < world_.statics.size(); ++i) {
      Primitive part = world_.statics[i].primitive;
      const Vec2 place{static_cast<double>(part.centre.x), static_cast<double>(part.centre.y)};
      // No primitive reaches farther than 40 m from its middle.
      if (norm(place - centre) > model_.max_range + 40) continue;
      // Subtract first: large coordinates must not cost precision.
      part.centre = part.centre - origin;
      const std::uint32_t id =
          kFirstStatic + world_.statics[i].model % (kFirstChange - kFirstStatic);
      renderer_.add(transformed(turn, part), config_.static_instances ? id << 16 : 0,
                    mix(std::uint64_t{i}, 1));
    }
    for (const ObjectPose& pose : moment.objects) {
      const Object& object = world_.traffic.objects[pose.object];
      const bool person = object.kind == Kind::kPedestrian;
      const Pose T_world_object =
          person ? upright(pose.at)
                 : stand_on(world_.terrain, pose.at, object.size.length, object.size.width);
      const auto instance =
          object.instance == 0 ? static_cast<std::uint32_t>(pose.object + 1) : object.instance;
      const std::uint32_t label = label_of(pose);
      states.push_back({instance, label, T_world_object, pose.speed, object.size.length,
                        object.size.width, object.size.height});
      const Rigid T_sensor_object = to_rigid(T_sensor_world * T_world_object);
      Model shape;
      if (person) {
        const double stride = std::min(1.0, pose.speed / 1.0);
        shape = pedestrian_model(object.size, object.seed, pose.phase, stride);
      } else if (object.kind == Kind::kCyclist) {
        shape = cyclist_model(object.size, object.seed, pose.phase);
      }
      for (const Primitive& primitive : object.model.empty() ? shape : object.model) {
        renderer_.add(transformed(T_sensor_object, primitive), label | (instance << 16),
                      mix(pose.object, 2));
      }
    }
    if (config_.ego_points && config_.rig == Rig::kNone) {
      renderer_.add(make_primitive(Shape::kBox, kMaterials.ego_roof,
                                   {-0.6F, 0, -static_cast<float>(model_.height) + 0.75F},
                                   {1.9F, 0.85F, 0.55F}, rotation_z(-model_.yaw)),
                    0, 3);
    }
    renderer_.draw();
  }

  std::uint32_t label_of(const ObjectPose& pose) const {
    const Object& object = world_.traffic.objects[pose.object];
    if (object.label != 0) return object.label;
    const Kind kind = object.kind;
    const bool moving = config_.labelling == Labelling::kEver ? ever_moved_[pose.object]
                                                              : pose.speed > kMovingSpeed;
    return moving ? traits_of(kind).moving : traits_of(kind).resting;
  }

  /// The ground nearer than `reach` (m) along a beam from `origin`; needs a prepared terrain.
  std::optional<Surface> ground_surface(Vec3 origin, Vec3 world_direction, float reach) {
    const float range = world_.terrain.cast(origin, world_direction, reach);
    if (range <= 0) return std::nullopt;
    const Vec3 p = origin + range * world_direction;
    const float cosine = std::abs(dot(world_.terrain.normal_near(p.x, p.y), world_direction));
    const std::uint16_t label = world_.terrain.label_near(p.x, p.y);
    const bool grass = label == kClasses.terrain, sidewalk = label == kClasses.sidewalk;
    return Surface{
        range, cosine, 0.01F, grass ? 0.3F : sidewalk ? 0.28F : 0.18F, grass ? 0.015F : 0.003F,
        label};
  }

  /// The object that the renderer found along a beam.
  std::optional<Surface> object_surface(const Renderer::Hit& hit, Vec3 direction) const {
    if (hit.drawn == nullptr) return std::nullopt;
    const Renderer::Drawn& drawn = *hit.drawn;
    const Material& material = *drawn.primitive.material;
    const float cosine =
        material.density == 0
            ? std::abs(dot(surface_normal(drawn.primitive, hit.range * direction), direction))
            : 0.7F;
    return Surface{hit.range,
                   cosine,
                   hit.extra_loss + material.loss,
                   material.reflectivity,
                   material.roughness,
                   drawn.label | ((drawn.label & 0xFFFF) == 0 ? material.label : 0U)};
  }

  /// Adds the points of some columns of a scan, measured at one moment.
  void measure_part(std::size_t index, const Moment& moment, BeamTable::Columns columns,
                    std::uint64_t seed, SimulatedScan& scan) {
    beams_.fill(model_, config_.seed, index, columns);
    renderer_.start(beams_, static_cast<float>(model_.max_range), seed,
                    static_cast<float>(config_.glass_passes));
    std::vector<ObjectState> states;
    draw_world(moment, states);
    measure(moment, columns, scan, seed);
    if (scan.objects.empty() && columns.first == 0) scan.objects = std::move(states);
  }

  bool is_lost(std::size_t column, std::uint64_t seed) const {
    if (config_.packet_loss <= 0) return false;
    return unit_float(mix(mix(seed, 15), column / model_.packet)) <
           static_cast<float>(config_.packet_loss);
  }

  float bias_of(int laser) const {
    if (config_.beam_bias <= 0) return 0;
    return static_cast<float>(config_.beam_bias) *
           normal_float(mix(mix(config_.seed, 13), static_cast<std::uint64_t>(laser)));
  }

  /// The surface beside, if it lies within the width of the beam as well, is seen with it.
  Surface mixed(std::size_t i, std::size_t columns, std::uint64_t random) const {
    const Surface& own = *surfaces_[i];
    if (config_.divergence <= 0) return own;
    const bool later = unit_float(mix(random, 7)) < 0.5F;
    const std::size_t column = i % columns;
    if (later ? column + 1 == columns : column == 0) return own;
    const std::size_t beside = later ? i + 1 : i - 1;
    if (!surfaces_[beside]) return own;
    const auto& order = beams_.measured_order();
    const float gap = norm(beams_.direction(order[i]) - beams_.direction(order[beside]));
    // The edge lies anywhere between the two beams, within half a width with this probability.
    const auto width = static_cast<float>(config_.divergence * kPi / 180);
    if (unit_float(mix(random, 8)) * gap >= width) return own;
    return one_return(own, *surfaces_[beside], 0.5F + 0.5F * unit_float(mix(random, 9)));
  }

  /// The surface that beam number `i` of some columns reports. `seed` differs from part to part of
  /// all scans.
  std::optional<Surface> reported(std::size_t i, BeamTable::Columns columns,
                                  std::uint64_t seed) const {
    const auto count = static_cast<std::size_t>(columns.last - columns.first);
    const std::size_t column = static_cast<std::size_t>(columns.first) + i % count;
    if (!surfaces_[i] || is_lost(column, seed)) return std::nullopt;
    Surface result = mixed(i, count, mix(seed, beams_.measured_order()[i]));
    result.range += bias_of(model_.laser_of(i, count));
    return result;
  }

  /// Turns surfaces into points with noise, losses and labels.
  void measure(const Moment& moment, BeamTable::Columns columns, SimulatedScan& scan,
               std::uint64_t scan_seed) {
    const Rigid T_world_sensor = to_rigid(moment.T_world_sensor);
    const Vec3 origin = T_world_sensor.translation;
    world_.terrain.prepare({moment.T_world_sensor(0, 3), moment.T_world_sensor(1, 3)},
                           model_.max_range);
    scan.xyzi.reserve(scan.xyzi.size() + beams_.size() * 4);
    scan.labels.reserve(scan.labels.size() + beams_.size());
    surfaces_.clear();
    const std::vector<std::uint32_t>& order = beams_.measured_order();
    for (const std::uint32_t slot : order) {
      const Renderer::Hit& hit = renderer_.hits()[slot];
      const Vec3 direction = beams_.direction(slot);
      const Vec3 world_direction = T_world_sensor.rotation * direction;
      std::optional<Surface> surface = ground_surface(origin, world_direction, hit.range);
      if (!surface) surface = object_surface(hit, direction);
      surfaces_.push_back(surface);
    }
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::optional<Surface> seen = reported(i, columns, scan_seed);
      if (seen) add_point(*seen, beams_.direction(order[i]), mix(scan_seed, order[i]), scan);
    }
  }

  /// Adds the point of a surface unless the return is lost or out of range.
  void add_point(const Surface& surface, Vec3 direction, std::uint64_t random,
                 SimulatedScan& scan) const {
    const auto sigma = static_cast<float>(config_.range_noise);
    // Received over required power: 1 where nine of ten beams detect a dark surface.
    const float reach = static_cast<float>(model_.dark_range) / surface.range;
    const float power =
        surface.reflectivity * (0.08F + 0.92F * surface.cosine) * 10 * reach * reach;
    const float loss = surface.loss + 1 / (1 + 9 * power);
    if (unit_float(mix(random, 1)) < loss * static_cast<float>(config_.dropout)) return;
    const float roughness = sigma > 0 ? surface.roughness : 0;
    const float range = surface.range + std::sqrt(sigma * sigma + roughness * roughness) *
                                            normal_float(mix(random, 2));
    const auto min_range = static_cast<float>(model_.min_range);
    if (range < min_range || range > static_cast<float>(model_.max_range)) return;
    const float brightness = surface.reflectivity * (0.3F + 0.7F * surface.cosine) *
                             (1 + 0.15F * normal_float(mix(random, 3)));
    const Vec3 p = range * reported_direction(direction, random);
    scan.xyzi.push_back(p.x);
    scan.xyzi.push_back(p.y);
    scan.xyzi.push_back(p.z);
    scan.xyzi.push_back(std::clamp(brightness, 0.0F, 1.0F));
    scan.labels.push_back(surface.label);
  }

  /// A beam has a width: the surface that it met lies a little beside its nominal direction.
  Vec3 reported_direction(Vec3 direction, std::uint64_t random) const {
    if (config_.direction_noise <= 0) return direction;
    const auto sigma = static_cast<float>(config_.direction_noise * kPi / 180);
    const Vec3 beside =
        direction + Vec3{sigma * normal_float(mix(random, 4)), sigma * normal_float(mix(random, 5)),
                         sigma * normal_float(mix(random, 6))};
    return (1 / norm(beside)) * beside;
  }

  Config config_;
  SensorModel model_;
  World world_;
  std::vector<Moment> moments_;
  std::vector<bool> ever_moved_;
  std::vector<Eigen::Vector3d> drift_;  ///< m, of each moment
  BeamTable beams_;
  Renderer renderer_;
  std::vector<std::optional<Surface>> surfaces_;  ///< in the order of measurement
};

}  // namespace dynains::simulation
