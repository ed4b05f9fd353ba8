// Header-only DynaInsRemover, for default or custom stages. With the library dynains::remover,
// compiled_remover.hpp (the default stages) and own_stages.hpp compile faster.
#pragma once

#include "dynains/own_stages.hpp"
#include "dynains/pipeline/free_space_decision.hpp"
