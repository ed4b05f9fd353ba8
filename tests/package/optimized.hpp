// What a user of the compiled remover compiles. Some warnings appear in optimized code only.
#pragma once

#include "dynains/compiled_remover.hpp"

void validate(const dynains::DynaInsRemover::Config& config) { config.validate(); }
