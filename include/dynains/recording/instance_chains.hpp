// Instances of the first pass that are one object in successive scans.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/instance_numbers.hpp"
#include "dynains/recording/place.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// Whether a box of this size (m, z up) may hold one vehicle.
bool is_compact(const Eigen::Vector3f& size);

/// Links instances of the same id in successive scans. The first pass sees such an object move for
/// a while and stand before or after that: it removes it and then keeps it, or the reverse.
class InstanceChains {
 public:
  /// The move of an object to its place, or from it.
  struct Move {
    ScanSpan elsewhere;     ///< scans in which it was elsewhere
    bool is_later = false;  ///< it leaves its place; else it came, and stays
  };

  /// Takes the instances of a scan (m, sensor frame), in the order of the scans.
  void add(PointsView points, Span<const PointLabel> labels, Span<const std::uint32_t> instances,
           const Pose& T_world_sensor);
  /// Ends all chains. To be called once, after the last scan.
  void find_moves();
  /// The move that brought the object of an instance to its place, or that takes it away later;
  /// null if it has not moved.
  const Move* move_of(std::uint32_t scan, std::uint32_t instance) const;
  /// Calls `visit(instance)` for the instances of a scan that have a move.
  template <class Visitor>
  void for_each_move(std::uint32_t scan, Visitor&& visit) const {
    for (auto at = first_move(scan, 0); at != moves_.end() && at->scan == scan; ++at) {
      visit(at->instance);
    }
  }

 private:
  /// An instance in one scan.
  struct Node {
    std::uint32_t instance = 0, scan = 0;
    std::uint32_t points = 0, removed = 0;
    Eigen::Array3f lowest = Eigen::Array3f::Constant(1e9F);  // m, from the first sensor
    Eigen::Array3f highest = Eigen::Array3f::Constant(-1e9F);

    bool is_removed() const { return 5 * removed >= 4 * points; }
  };
  using Chain = std::vector<Node>;
  struct MovedInstance {
    std::uint32_t scan, instance;
    Move move;
  };
  using Moves = std::vector<MovedInstance>;

  static float shift(const Node& a, const Node& b);
  void take_nodes(PointsView points, Span<const PointLabel> labels,
                  Span<const std::uint32_t> instances, const Pose& T_world_sensor);
  void end_old_chains();
  void end(const Chain& chain);
  void set_elsewhere(const Chain& chain, std::size_t first, std::size_t last);
  Moves::const_iterator first_move(std::uint32_t scan, std::uint32_t instance) const;

  std::uint32_t scan_ = 0;                            // number of the next scan
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // m, world frame
  InstanceNumbers numbers_;                           // in the newest scan
  std::vector<Node> newest_;                          // by number
  std::map<std::uint32_t, Chain> chains_;             // that may go on, by instance
  std::vector<std::optional<Move>> of_chain_;         // by node
  Moves moves_;                                       // sorted by find_moves()
};

}  // namespace dynains
