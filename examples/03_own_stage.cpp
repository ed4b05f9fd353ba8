// Replaces one stage: a ground segmentation of your own with all other stages unchanged.
#include <algorithm>
#include <cstdio>
#include <dynains/dyna_ins_remover.hpp>
#include <vector>

// For flat halls: points below a threshold are floor.
class FloorByHeight {
 public:
  struct Config {
    double floor_below = -1.5;  ///< m, sensor frame

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {  // bounds, config files and --help follow
      visitor(dynains::Parameter{"floor_below", self.floor_below, dynains::closed(-50, 0), "m",
                                 "points lower than this are the floor"});
    }
    void validate() const { dynains::validate_parameters("FloorByHeight", *this); }
  };

  explicit FloorByHeight(const Config& config) : config_(config) {}

  // Ground first, all others after it, each point with its index in the input.
  void segment(dynains::PointsView scan, dynains::Span<const std::uint32_t> input,
               dynains::GroundSplit& split) const {
    split.resize(scan.size());
    std::size_t next = 0;
    const auto take = [&](bool ground) {
      for (std::size_t i = 0; i < scan.size(); ++i) {
        if ((scan.z[i] < config_.floor_below) != ground) continue;
        split.points.x[next] = scan.x[i];
        split.points.y[next] = scan.y[i];
        split.points.z[next] = scan.z[i];
        split.input[next++] = input[i];
      }
    };
    take(true);
    split.ground_count = next;
    take(false);
  }

 private:
  Config config_;
};

struct HallStages : dynains::DefaultStages {
  using Ground = FloorByHeight;  // likewise Clusterer, Descriptor, Belief, Map
};

int main() {
  dynains::BasicDynaInsRemover<HallStages>::Config config;
  config.ground.floor_below = -0.9;
  dynains::BasicDynaInsRemover<HallStages> remover(config);

  const std::vector<Eigen::Vector3d> scan = {{5, 0, -1}, {5, 1, -1}, {5, 0, 0}, {5, 0, 1}};
  const auto labels = remover.push(scan, Eigen::Isometry3d::Identity()).newest().labels;
  const auto floor = std::count(labels.begin(), labels.end(), dynains::PointLabel::kGround);
  std::printf("%d of %zu points are floor\n", static_cast<int>(floor), scan.size());
  return floor == 2 ? 0 : 1;
}
