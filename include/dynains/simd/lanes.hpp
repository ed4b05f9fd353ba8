#pragma once

#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
