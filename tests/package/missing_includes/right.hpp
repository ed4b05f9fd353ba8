// A header that includes what it needs.
#pragma once

#include <cstddef>

struct Right {
  std::size_t size;
};
