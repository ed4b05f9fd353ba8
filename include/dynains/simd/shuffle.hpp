#pragma once

#include "dynains/simd/vector_register.hpp"

namespace dynains::detail {

template <int... kNumbers, class Vector, class Result>
void shuffle(const Vector& a, const Vector& b, Result& result) {
  constexpr int kCount = static_cast<int>(sizeof(Vector) / sizeof(a[0]));
  result = Result{(kNumbers < kCount ? a[kNumbers % kCount] : b[kNumbers % kCount])...};
}

}  // namespace dynains::detail
