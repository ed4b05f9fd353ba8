// Blocks of the pages, each in code that has what the text around it presupposes. The headers are
// those that the blocks include themselves; within a function their includes do nothing.
#include "api_1.hpp"
#include "api_2.hpp"
#include "embedding_1.hpp"
#include "embedding_3.hpp"
#include "embedding_4.hpp"
#include "embedding_6.hpp"

#include "api_1.inc"

#include "api_2.inc"

/// All functions of the stages that the pipeline calls, for both decisions.
dynains::FrameResult push_by_own_stages(const std::vector<Eigen::Vector3d>& scan) {
  MyRemover remover;
  return remover.push(scan, Eigen::Isometry3d::Identity());
}

void corrector_loop(const std::vector<Eigen::Vector3d>& scan, const Eigen::Isometry3d& T_odometry,
                    double time, std::vector<dynains::Pose>& trajectory,
                    std::vector<Eigen::Vector3d>& map) {
#include "embedding_1.inc"
}

/// A stand-in for kiss_icp::pipeline::KissICP with the functions that the block calls.
struct KissIcpLookAlike {
  using Points = std::vector<Eigen::Vector3d>;
  std::tuple<Points, Points> RegisterFrame(const Points& points,
                                           const std::vector<double>& timestamps);
  const Sophus::SE3d& pose() const;
};

void kiss_icp_loop(KissIcpLookAlike& odometry, const std::vector<Eigen::Vector3d>& points,
                   const std::vector<double>& offsets, double time,
                   std::vector<dynains::Pose>& trajectory) {
#include "embedding_3.inc"
}

#include "embedding_4.inc"

void reserve(const dynains::RawPoints<float>& first_cloud) {
#include "embedding_5.inc"
}

void move_scans(const std::vector<dynains::PointBuffer>& static_points,
                const std::vector<dynains::Pose>& corrected) {
#include "embedding_6.inc"
}
