// Contents of a file that many trees share.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace dynains::test {

/// Immutable bytes. Copies share them, and most comparisons need only their hash.
class Bytes {
 public:
  Bytes() = default;
  Bytes(std::string text)
      : text_(std::make_shared<const std::string>(std::move(text))),
        hash_(std::hash<std::string>()(*text_)) {}
  Bytes(const char* text) : Bytes(std::string(text)) {}

  const std::string& text() const { return *text_; }
  std::size_t size() const { return text_->size(); }
  /// Different for different bytes.
  std::size_t hash() const { return hash_; }

  bool operator==(const Bytes& other) const {
    return text_ == other.text_ || (hash_ == other.hash_ && *text_ == *other.text_);
  }

 private:
  static const std::shared_ptr<const std::string>& nothing() {
    static const auto text = std::make_shared<const std::string>();
    return text;
  }

  std::shared_ptr<const std::string> text_ = nothing();
  std::size_t hash_ = std::hash<std::string>()({});
};

}  // namespace dynains::test
