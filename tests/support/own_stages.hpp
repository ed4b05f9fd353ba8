// For tests of removers with own stages. The default remover is taken from the library, which has
// compiled it with full optimization.
#pragma once

#include "dynains/own_stages.hpp"

extern template class dynains::BasicDynaInsRemover<>;
