#include "support/remover.hpp"

template class dynains::BasicDynaInsRemover<>;
