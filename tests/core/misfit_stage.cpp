// Must not compile, with a reason: cluster_count() is missing.
#include <cstdint>

#include "dynains/dyna_ins_remover.hpp"

class Misfit {
 public:
  struct Config {
    void validate() const {}
  };
  explicit Misfit(const Config&) {}
  dynains::Span<const std::uint32_t> cluster(dynains::PolarView) { return {}; }
};

struct MisfitStages : dynains::DefaultStages {
  using Clusterer = Misfit;
};

int main() {
  dynains::BasicDynaInsRemover<MisfitStages> remover;
  return static_cast<int>(remover.latency());
}
