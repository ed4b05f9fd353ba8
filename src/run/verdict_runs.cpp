#include "verdict_runs.hpp"

#include <algorithm>

namespace dynains::program {

void VerdictRuns::assign(const VerdictArrays& verdict) {
  ends.clear();
  instances.clear();
  labels.clear();
  causes.clear();
  const std::size_t count = verdict.labels.size();
  for (std::size_t i = 0; i < count; ++i) {
    const bool continues = i + 1 < count && verdict.instances[i + 1] == verdict.instances[i] &&
                           verdict.causes[i + 1] == verdict.causes[i] &&
                           verdict.labels[i + 1] == verdict.labels[i];
    if (continues) continue;
    ends.push_back(static_cast<std::uint32_t>(i + 1));
    instances.push_back(verdict.instances[i]);
    labels.push_back(verdict.labels[i]);
    causes.push_back(verdict.causes[i]);
  }
}

bool VerdictRuns::is_valid() const {
  constexpr std::uint32_t kMostPoints = std::uint32_t{1} << 26U;
  const std::size_t count = ends.size();
  return instances.size() == count && labels.size() == count && causes.size() == count &&
         points() <= kMostPoints && std::is_sorted(ends.begin(), ends.end());
}

void VerdictRuns::expand(VerdictArrays& verdict) const {
  verdict.instances.resize(points());
  verdict.labels.resize(points());
  verdict.causes.resize(points());
  for_each([&](std::size_t run, std::size_t first, std::size_t length) {
    std::fill_n(verdict.instances.data() + first, length, instances[run]);
    std::fill_n(verdict.labels.data() + first, length, labels[run]);
    std::fill_n(verdict.causes.data() + first, length, causes[run]);
  });
}

}  // namespace dynains::program
