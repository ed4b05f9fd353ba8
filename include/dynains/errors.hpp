// Exceptions of the library, which neither prints nor aborts.
#pragma once

#include <stdexcept>
#include <string>

namespace dynains {

/// A configuration value is out of its documented bounds; the text names field, value and bound.
class ConfigError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A pose is not a finite rigid transform, or a time stamp does not increase.
class PoseError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// The description of a cloud does not fit its data or lacks a field.
class CloudError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A call at the wrong time: during another call on the same object (from a second thread or from
/// within), reserve() after the first push, or a write to a folder that another process writes to.
class UsageError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// A file cannot be read or written; the text gives path, position and what was expected.
class IoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace dynains
