#include <memory>

#include "dynains/compiled_remover.hpp"
#include "dynains/dyna_ins_remover.hpp"

template std::unique_ptr<dynains::detail::ScanDecision> dynains::detail::make_free_space_decision(
    const FreeSpaceConfig&, Background*);
template std::unique_ptr<dynains::detail::MotionStage> dynains::detail::make_pose_correction(
    const FreeSpaceConfig&);
template class dynains::BasicDynaInsRemover<>;
