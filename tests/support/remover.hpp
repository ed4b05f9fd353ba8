// The facade, which takes long to compile: in remover.cpp, once for all tests.
#pragma once

#include "dynains/dyna_ins_remover.hpp"

extern template class dynains::BasicDynaInsRemover<>;
