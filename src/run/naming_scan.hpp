// Errors about a pose say whose pose it is.
#pragma once

#include <cstddef>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"

namespace dynains::program {

/// Returns `work()`. A PoseError from it gets the name of scan i.
template <class Work>
decltype(auto) naming_scan(const Recording& recording, std::size_t i, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const PoseError& error) {
    throw PoseError("scan " + recording.name(i) + ": " + error.what());
  }
}

}  // namespace dynains::program
