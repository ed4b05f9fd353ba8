// For tests of removers with own stages. The default remover is taken from the library, which has
// compiled it with full optimization.
#pragma once

#include "dynains/dyna_ins_remover.hpp"

extern template class dynains::BasicDynaInsRemover<>;
