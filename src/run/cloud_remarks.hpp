// Remarks on clouds that no option of the poses can heal.
#pragma once

#include <optional>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/sensor/mounting.hpp"

namespace dynains::program {

/// A remark if coordinates lie so far from the origin of the world that float32 puts them into
/// stripes. Throws IoError.
std::optional<std::string> remark_on_stripes(const Recording& recording);

/// A remark on a sensor that no scan shows upright or upside down, up to 45 deg: the mounting under
/// which there is ground below it, or that none was found. Empty if `mounting` is known. Throws
/// IoError.
std::optional<std::string> remark_on_mounting(const Recording& recording, const Mounting& mounting);

}  // namespace dynains::program
