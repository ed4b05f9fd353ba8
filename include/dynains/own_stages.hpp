// DynaInsRemover with custom stages. This header requires the library dynains::remover, which
// contains the decision by free space. dyna_ins_remover.hpp requires no library.
#pragma once

#include <memory>

#include "dynains/compiled_remover.hpp"
#include "dynains/pipeline/pipeline.hpp"

namespace dynains {

// Defined outside of the class, so that `extern template class` prevents the instantiation of the
// pipeline.
template <class Stages>
BasicDynaInsRemover<Stages>::BasicDynaInsRemover(const Config& config)
    : pipeline_(std::make_unique<detail::Pipeline<Stages>>(config)) {}

}  // namespace dynains
