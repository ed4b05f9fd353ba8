// The floor of a number, for plain x86-64 code.
#pragma once

namespace dynains::detail {

/// Largest integer that is not above `value`, which must be within the range of Int. std::floor()
/// is a call without SSE4.1; of this, compilers make vectors.
template <class Int, class Real>
Int floor_to(Real value) {
  const auto truncated = static_cast<Int>(value);
  return truncated - (static_cast<Real>(truncated) - value > Real(0) ? 1 : 0);
}

}  // namespace dynains::detail
