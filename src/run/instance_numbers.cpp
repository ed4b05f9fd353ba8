#include "instance_numbers.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

namespace dynains::program {
namespace {

/// An instance before the border and one behind it, with the number of points in both.
struct Overlap {
  std::uint32_t before;
  std::uint32_t behind;
  std::size_t points;
};

/// Those with the most points first.
std::vector<Overlap> find_overlaps(const std::vector<std::uint32_t>& before,
                                   const std::vector<std::uint32_t>& behind) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t i = 0; i < std::min(before.size(), behind.size()); ++i) {
    if (before[i] != kNoInstance && behind[i] != kNoInstance)
      pairs.emplace_back(behind[i], before[i]);
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<Overlap> overlaps;
  for (const auto& [from, to] : pairs) {
    const bool is_next =
        !overlaps.empty() && overlaps.back().behind == from && overlaps.back().before == to;
    if (!is_next) overlaps.push_back({to, from, 0});
    ++overlaps.back().points;
  }
  std::stable_sort(overlaps.begin(), overlaps.end(),
                   [](const Overlap& a, const Overlap& b) { return a.points > b.points; });
  return overlaps;
}

}  // namespace

InstanceNumbers::InstanceNumbers(const InstanceNumbers& numbers_before,
                                 const ChunkInstances& before, const ChunkInstances& chunk) {
  const std::vector<std::uint32_t>& shared = chunk.shared_before;
  const std::uint32_t newest =
      shared.empty() ? kNoInstance : *std::max_element(shared.begin(), shared.end());
  known_.assign(std::size_t{newest} + 1, kNoInstance);
  moved_.assign(known_.size(), false);
  std::vector<bool> has_partner(known_.size(), false);
  std::set<std::uint32_t> is_taken;
  for (const Overlap& overlap : find_overlaps(before.shared_behind, shared)) {
    // Only the instance that shares the most points is the partner.
    if (has_partner[overlap.behind]) continue;
    has_partner[overlap.behind] = true;
    const std::uint32_t id = numbers_before(overlap.before);
    if (!is_taken.insert(id).second) continue;
    known_[overlap.behind] = id;
    moved_[overlap.behind] = std::binary_search(before.moving_behind.begin(),
                                                before.moving_behind.end(), overlap.before);
  }

  last_ = numbers_before.last();
  std::vector<std::uint32_t> visible = shared;
  std::sort(visible.begin(), visible.end());
  visible.erase(std::unique(visible.begin(), visible.end()), visible.end());
  for (const std::uint32_t id : visible) {
    if (id != kNoInstance && known_[id] == kNoInstance) known_[id] = ++last_;
  }
  shift_ = last_ - newest;
  last_ += std::max(chunk.last, newest) - newest;
}

}  // namespace dynains::program
