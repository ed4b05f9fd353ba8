#include "dynains/compiled_remover.hpp"
#include "dynains/dyna_ins_remover.hpp"

template class dynains::BasicDynaInsRemover<>;
