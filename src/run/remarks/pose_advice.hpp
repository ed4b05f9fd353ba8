// What a diagnosis says to a user, and the flags that it proposes.
#pragma once

#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"

namespace dynains::run {

/// The flags of `dynains run` that change the given options into `proposal`, such as
/// `--invert-poses --pose-units mm`; empty if nothing changes, or if a flag has to be left out.
std::string proposed_flags(const Recording& recording, const RecordingOptions& proposal);

/// Over how many scans errors are: "from one scan to the next" or "over 9 scans".
std::string span_text(const Diagnosis& diagnosis);

/// One sentence with the verdict on the poses and the proposed flags.
std::string advice(const Recording& recording, const Diagnosis& diagnosis);

}  // namespace dynains::run
