// DynaInsRemover with the default stages, compiled: link dynains::remover.
#pragma once

#include "dynains/basic_remover.hpp"

extern template class dynains::BasicDynaInsRemover<>;
