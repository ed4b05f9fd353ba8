// Includes what it needs, among it two other headers.
#pragma once

#include "needs_base.hpp"
#include "right.hpp"

struct NeedsBoth {
  NeedsBase base;
  Right right;
};
