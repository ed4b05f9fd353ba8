// Vectors put together from values of others. GCC has __builtin_shufflevector from version 12 on;
// before, it makes the same instructions of single values.
#pragma once

namespace dynains::detail {

/// Of the values of `a`, and behind them those of `b`: these, by number. By reference, for vectors
/// may be wider than the registers that functions are called with.
template <int... kNumbers, class Vector, class Result>
void shuffle(const Vector& a, const Vector& b, Result& result) {
#if defined(__clang__) || __GNUC__ >= 12
  result = __builtin_shufflevector(a, b, kNumbers...);
#else
  constexpr int kCount = static_cast<int>(sizeof(Vector) / sizeof(a[0]));
  result = Result{(kNumbers < kCount ? a[kNumbers % kCount] : b[kNumbers % kCount])...};
#endif
}

}  // namespace dynains::detail
