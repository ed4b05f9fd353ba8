// Blocks of the pages, each in code that has what the text around it presupposes. Their includes do
// nothing within a function, because they are here as well.
#include <Eigen/Geometry>
#include <vector>

#include "dynains/adapters/sophus.hpp"
#include "dynains/dyna_ins_remover.hpp"
#include "dynains/io/tiled_map.hpp"
#include "dynains/map/rebasable_static_map.hpp"

/// A stand-in for kiss_icp::pipeline::KissICP with the functions that the block calls.
struct KissIcpLookAlike {
  void RegisterFrame(const std::vector<Eigen::Vector3d>& points,
                     const std::vector<double>& timestamps);
  const Sophus::SE3d& pose() const;
};

void kiss_icp_loop(KissIcpLookAlike& odometry, const std::vector<Eigen::Vector3d>& points,
                   const std::vector<double>& timestamps, double time,
                   Eigen::Isometry3d& T_odometry_last, Eigen::Isometry3d& T_world_last) {
#include "embedding_2.inc"
}

#include "embedding_3.inc"

void reserve(dynains::DynaInsRemover& remover, const dynains::RawPoints<float>& first_cloud) {
#include "embedding_4.inc"
}

void long_drive() {
#include "embedding_5.inc"
}

void move_scans() {
#include "embedding_6.inc"
}
