// Ground truth of a point: SemanticKITTI class ids reduced to static, dynamic and ignored.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <string>
#include <string_view>

namespace dynains::evaluation {

enum class Truth : std::uint8_t {
  kStatic,
  kDynamic,
  kIgnored,  ///< not evaluated: excluded from the raw map and from all estimates
};

/// Treatment of points without a class: SemanticKITTI's 0 (unlabeled) and 1 (outlier).
enum class Unlabeled : std::uint8_t {
  kIgnore,
  kStatic,  ///< as in the published tables
};
constexpr std::array<const char*, 2> value_names(Unlabeled) { return {"ignore", "static"}; }

/// SemanticKITTI label word: class in the lower, instance in the upper 16 bits.
constexpr std::uint16_t semantic_class(std::uint32_t label) {
  return static_cast<std::uint16_t>(label & 0xffffU);
}
/// Instance id, 0 for none.
constexpr std::uint16_t semantic_instance(std::uint32_t label) {
  return static_cast<std::uint16_t>(label >> 16U);
}

/// Mapping from SemanticKITTI classes to Truth. Classes are static by default.
class TruthClasses {
 public:
  /// Dynamic: SemanticKITTI's moving classes, 252 to 259, and 251 of its benchmark of
  /// moving object segmentation.
  TruthClasses() : TruthClasses(Unlabeled::kIgnore) {}
  /// As above. `unlabeled`: what points of the classes 0 and 1 count as.
  explicit TruthClasses(Unlabeled unlabeled);

  /// `dynamic_classes`: ids and closed ranges separated by commas, for example "252-257,259".
  /// Throws ConfigError if the list is malformed, empty, or an id exceeds 65535.
  TruthClasses(std::string_view dynamic_classes, Unlabeled unlabeled);

  /// Truth of a SemanticKITTI label word.
  Truth operator()(std::uint32_t label) const {
    const std::uint16_t id = semantic_class(label);
    if (dynamic_[id]) return Truth::kDynamic;
    return id <= 1 && unlabeled_ == Unlabeled::kIgnore ? Truth::kIgnored : Truth::kStatic;
  }

  Unlabeled unlabeled() const { return unlabeled_; }

  /// List of the dynamic ids in the format of the constructor.
  std::string dynamic_classes() const;

 private:
  std::bitset<65536> dynamic_;
  Unlabeled unlabeled_;
};

/// Whether a class of SemanticKITTI is ground: road, parking, sidewalk, other ground, lane
/// markings, terrain.
constexpr bool is_ground_class(std::uint16_t id) {
  return id == 40 || id == 44 || id == 48 || id == 49 || id == 60 || id == 72;
}

/// SemanticKITTI name of a class id; "class <id>" for an unknown id.
std::string semantic_class_name(std::uint16_t id);

}  // namespace dynains::evaluation
