// The value in the middle.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dynains {

/// The upper one of the two middle values for an even number of values; 0 for none.
template <class Value>
Value median(std::vector<Value> values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace dynains
