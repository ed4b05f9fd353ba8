// Instances of the first pass that are one object in successive scans.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "dynains/city/recording_place.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"
#include "instance_numbers.hpp"

namespace dynains::program {

/// Whether a box of this size (m, z up) may hold one vehicle.
bool is_compact(const Eigen::Vector3f& size);

/// Links instances whose boxes overlap from scan to scan. The first pass sees such an object move
/// for a while and stand before or after that: it removes it and then keeps it, or the reverse.
class InstanceChains {
 public:
  /// Takes the instances of a scan, in the order of the scans.
  void add(PointsView points, Span<const PointLabel> labels, Span<const std::uint32_t> instances,
           const Pose& T_world_sensor);
  /// Ends the last scan, and finds the chains that have moved.
  void find_moves();
  struct Move {
    ScanSpan elsewhere;     ///< scans in which it was elsewhere
    bool is_later = false;  ///< it leaves its place; else it came, and stays
  };
  /// The move that brought the object of an instance to its place, or that takes it away later;
  /// null if it has not moved.
  const Move* move_of(std::uint32_t scan, std::uint32_t instance) const;
  /// Calls `visit(instance)` for the instances of a scan that have a move.
  template <class Visitor>
  void for_each_move(std::uint32_t scan, Visitor&& visit) const {
    for (const Node& node : nodes_of(scan)) {
      if (node.has_move) visit(node.instance);
    }
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  /// An instance in one scan.
  struct Node {
    std::uint32_t instance = 0, scan = 0;
    std::uint32_t points = 0, removed = 0;
    Eigen::Array3f lowest = Eigen::Array3f::Constant(1e9F);  // m, from the first sensor
    Eigen::Array3f highest = Eigen::Array3f::Constant(-1e9F);
    std::uint32_t next = kNone;  // in its chain
    bool has_previous = false;
    Move move;
    bool has_move = false;

    bool is_removed() const;
  };

  Span<const Node> nodes_of(std::uint32_t scan) const;
  static float shift(const Node& a, const Node& b);
  void find_moves(const std::vector<std::uint32_t>& chain);
  void set_elsewhere(const std::vector<std::uint32_t>& chain, std::size_t first, std::size_t last);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> begin_;  // by scan: first node; sorted by instance in a scan
  InstanceNumbers numbers_;           // of the open scan
  std::vector<Node> open_;            // by number
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // m, world frame
  std::map<std::uint32_t, std::uint32_t> latest_;     // node, by instance
};

}  // namespace dynains::program
