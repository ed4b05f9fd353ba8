// Ground truth of a point: SemanticKITTI class ids reduced to static, dynamic and ignored.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace dynains::evaluation {

enum class Truth : std::uint8_t {
  kStatic,
  kDynamic,
  kIgnored,  ///< not evaluated: left out of the raw map and of every estimate
};

/// Treatment of points without a class: SemanticKITTI's 0 (unlabeled) and 1 (outlier).
enum class Unlabeled : std::uint8_t {
  kIgnore,
  kStatic,  ///< as in the published tables
};

/// SemanticKITTI label word: class in the lower, instance in the upper 16 bits.
constexpr std::uint16_t semantic_class(std::uint32_t label) {
  return static_cast<std::uint16_t>(label & 0xffffU);
}
constexpr std::uint16_t semantic_instance(std::uint32_t label) {
  return static_cast<std::uint16_t>(label >> 16U);
}

/// Dynamic and ignored class ids; all others are static.
class TruthClasses {
 public:
  /// Dynamic: SemanticKITTI's moving classes, 252 to 259.
  TruthClasses() : TruthClasses(Unlabeled::kIgnore) {}
  explicit TruthClasses(Unlabeled unlabeled);

  /// `dynamic_classes`: ids and closed ranges separated by commas, for example "252-257,259".
  /// Throws ConfigError if the list is malformed, empty, or an id exceeds 65535.
  TruthClasses(std::string_view dynamic_classes, Unlabeled unlabeled);

  Truth operator()(std::uint32_t label) const {
    const std::uint16_t id = semantic_class(label);
    if (dynamic_[id]) return Truth::kDynamic;
    return id <= 1 && unlabeled_ == Unlabeled::kIgnore ? Truth::kIgnored : Truth::kStatic;
  }

  Unlabeled unlabeled() const { return unlabeled_; }

  /// The dynamic ids as a list that the constructor reads back.
  std::string dynamic_classes() const;

 private:
  std::bitset<65536> dynamic_;
  Unlabeled unlabeled_;
};

/// SemanticKITTI's name of a class id, or "class <id>".
std::string semantic_class_name(std::uint16_t id);

}  // namespace dynains::evaluation
