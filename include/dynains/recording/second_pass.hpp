// Second pass over a recording: all of its scans test what the first pass called static.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/instance_chains.hpp"
#include "dynains/recording/instance_numbers.hpp"
#include "dynains/recording/places.hpp"
#include "dynains/recording/references.hpp"
#include "dynains/recording/restored_ground.hpp"
#include "dynains/recording/static_policy.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

struct SecondPassConfig {
  StaticPolicy static_policy = StaticPolicy::kAlways;
  double memory = 160;  ///< MB
  int threads = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"memory", self.memory, closed(0, 1e6), "MB",
                      "places and ground in memory, if those around the sensor take less"});
    visitor(Parameter{"threads", self.threads, closed(1, 2), "",
                      "2: a second thread tests places, too"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("SecondPass", *this); }
};

/// The first pass judges a scan by the scans around it: DynaInsRemover. The second one tests the
/// places of all points above the ground by scans of the whole recording, removes what came or
/// went, and brings back what stands (see RecordingPlaces) and the ground. An instance of the first
/// pass leaves as a whole if enough of its points or places have changed.
///
/// Give all scans with their first verdicts to add(), call test(), and give all scans again to
/// revise(), in the same order. Not for several callers at once. All functions throw what the store
/// throws.
class SecondPass {
 public:
  /// Touching places that came or went, and the scans that tell of it, numbered from 0 on.
  struct Object {
    Eigen::Vector3d lowest = Eigen::Vector3d::Constant(1e9);    // m, world frame
    Eigen::Vector3d highest = Eigen::Vector3d::Constant(-1e9);  // m
    std::uint64_t points = 0;                                   // removed in its places
    std::uint32_t first_measured = 0, last_measured = 0;
    std::uint32_t first_passed = UINT32_MAX, last_passed = 0;
  };

  /// Packed references, and places and ground far from the sensor, wait in `store`, which outlives
  /// this. Throws ConfigError.
  explicit SecondPass(ByteStore& store, const SecondPassConfig& config = {});

  /// Takes the first verdict on a scan, in the order of the scans: FrameResult::finished. `points`:
  /// m, sensor frame, all of the scan. Throws UsageError if their numbers differ, if the scan is
  /// not the next one, or after test().
  void add(PointsView points, const ScanVerdict& verdict);
  /// Tests all places. Ends without a result if `keep_going()` returns false; then revise() changes
  /// nothing.
  void test(const std::function<bool()>& keep_going = [] { return true; });
  /// Revises the first verdict on scan `number`, counted from 0. Returns whether anything changed.
  /// Points that left have Cause::kCameOrWent, those that came back Cause::kStands or
  /// Cause::kGround. Throws UsageError if the arrays have not the size of `points`.
  bool revise(PointsView points, std::uint32_t number, const Pose& T_world_sensor,
              VerdictArrays& verdict);

  /// Whether test() came to its end.
  bool is_decided() const { return is_decided_; }
  std::size_t place_count() const { return places_.size(); }
  /// Complete when all scans are revised, in their order.
  const std::vector<Object>& objects() const { return objects_; }
  /// Number of points that left by revise().
  std::uint64_t removed() const { return removed_; }
  /// Number of points that came back by revise().
  std::uint64_t restored() const { return restored_; }

 private:
  struct Reference {
    std::uint32_t scan;
    double time;  // s
    Pose T_world_sensor;
    std::uint64_t offset;  // in the file
    std::size_t size;      // bytes
  };
  using Place = RecordingPlaces::Place;
  /// Points or places of an instance.
  struct Share {
    std::uint32_t known = 0;                       // with a state
    std::uint32_t changed = 0;                     // came or went
    std::uint32_t stays = 0;                       // were there when the instance was not
    std::uint32_t low_changed = 0, low_stays = 0;  // in the lower half of the instance

    bool leave(float ratio) const;
  };
  /// An instance of the first pass in one scan. Its faces near the sensor have most of the points:
  /// places count once.
  struct Instance {
    Share points, places;
    Eigen::Vector3f lowest = Eigen::Vector3f::Constant(1e9F);
    Eigen::Vector3f highest = Eigen::Vector3f::Constant(-1e9F);  // m, axes of the world
    bool moved = false;
    bool is_leaving = false;  // leaves(), when all of its places are counted

    bool leaves() const;
  };
  /// Points of an instance in one place.
  struct Seen {
    std::uint32_t instance;  // number
    const Place* place;
    std::uint32_t points;
    bool is_low;  // any of them

    bool is_same(std::uint32_t of_instance, const Place* in_place) const {
      return instance == of_instance && place == in_place;
    }
    void add(std::uint32_t count, bool any_low) {
      points += count;
      is_low = is_low || any_low;
    }
  };

  void read(const Reference& kept, RecordingReference& reference);
  void list_objects();
  const Place* changed_at_ground(const WorldCell& cell);
  bool has_changed(const Place& place, std::uint32_t number) const;
  bool stands(const Place& place, std::uint32_t number) const;
  void restore(std::size_t point, VerdictArrays& verdict);
  void remove(std::size_t point, VerdictArrays& verdict);
  void put(std::size_t point, const Place& place) {
    place_of_[point] = &place;
    placed_.push_back(point);
  }
  void find_places(std::uint32_t number, const Pose& T_world_sensor, VerdictArrays& verdict);
  void find_other_places(const Pose& T_world_sensor, const VerdictArrays& verdict);
  void remove_objects(std::uint32_t number, const Pose& T_world_sensor, VerdictArrays& verdict);
  void choose_instances(std::uint32_t number, const VerdictArrays& verdict);
  void find_instances(std::uint32_t number, const Pose& T_world_sensor,
                      const VerdictArrays& verdict);
  void list_seen(const VerdictArrays& verdict);
  ScanSpan absence(std::uint32_t number, const Seen* begin, const Seen* end) const;
  void judge(std::uint32_t number, const Seen* begin, const Seen* end);

  SecondPassConfig config_;
  ByteStore& store_;
  RecordingPlaces places_;
  InstanceChains chains_;
  RestoredGround ground_;
  RecordingReferences references_;
  std::vector<Reference> kept_;
  std::vector<std::uint8_t> packed_;
  PointsView points_;                      // of the scan that is revised
  std::vector<const Place*> place_of_;     // by point; null: none, or it does not matter
  std::vector<std::size_t> placed_;        // points with a place
  std::vector<std::uint8_t> is_near_;      // what has changed; by point
  std::vector<std::uint8_t> is_restored_;  // by point
  InstanceNumbers numbers_;                // of instances in the scan that may leave
  std::vector<Instance> instances_;        // by number
  std::vector<Seen> seen_;                 // sorted by instance
  std::vector<Eigen::Vector3f> world_;     // m, from the sensor, axes of the world; by point
  std::vector<Object> objects_;
  bool is_decided_ = false;
  std::uint32_t scans_ = 0;  // added
  std::uint64_t removed_ = 0, restored_ = 0;
};

}  // namespace dynains
