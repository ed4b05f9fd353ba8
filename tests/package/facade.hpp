// Includes the whole pipeline, not only its declarations.
#pragma once

#include "dynains/dyna_ins_remover.hpp"

template class dynains::BasicDynaInsRemover<>;
