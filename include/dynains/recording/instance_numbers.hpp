// Numbers of the instances of one scan.
#pragma once

#include <cstdint>
#include <vector>

namespace dynains {

/// An id as labels of SemanticKITTI hold it, in 16 bits: ids beyond 65535 start again at 1.
constexpr std::uint32_t short_instance(std::uint32_t instance) {
  constexpr std::uint32_t kMost = 65535;
  return instance == 0 ? 0 : (instance - 1) % kMost + 1;
}

/// Numbers the instances of a scan from 0 on, in the order of their first points. Their ids grow
/// with the recording, the numbers do not. Ids are taken as short_instance().
class InstanceNumbers {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  /// Forgets all instances and keeps the memory.
  void clear() {
    for (const std::uint32_t id : ids_) number_[id] = kNone;
    ids_.clear();
  }
  /// Number of an instance, which is new or not.
  std::uint32_t add(std::uint32_t instance) {
    const std::uint32_t id = short_instance(instance);
    if (id >= number_.size()) number_.resize(id + 1, kNone);
    if (number_[id] == kNone) {
      number_[id] = static_cast<std::uint32_t>(ids_.size());
      ids_.push_back(id);
    }
    return number_[id];
  }
  /// Number of an instance, or kNone.
  std::uint32_t find(std::uint32_t instance) const {
    const std::uint32_t id = short_instance(instance);
    return id < number_.size() ? number_[id] : kNone;
  }
  /// By number.
  const std::vector<std::uint32_t>& ids() const { return ids_; }

 private:
  std::vector<std::uint32_t> number_;  // by id
  std::vector<std::uint32_t> ids_;
};

}  // namespace dynains
