// Exceptions of the library. The library does not print or abort.
#pragma once

#include <stdexcept>

namespace dynains {

/// A configuration value is out of bounds. The message names field, value and violated bound.
class ConfigError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A pose is not a finite rigid transform within kMaxTranslation, or a time is not greater than the
/// previous one.
class PoseError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// The layout of a cloud does not match its data, or a required field is missing.
class CloudError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A call is not permitted in the present state: during another call on the same object,
/// reserve_like() after the first push, a moved-from object, or a folder of another process.
class UsageError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// A file cannot be read or written. The message names path, position and expected content.
class IoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace dynains
