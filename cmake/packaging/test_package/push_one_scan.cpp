// A scan of one point enters the remover.
#include <dynains/compiled_remover.hpp>

int main() {
  dynains::DynaInsRemover remover;
  const float xyz[3] = {10.0F, 0.0F, 0.0F};
  remover.push(dynains::RawPoints<float>{xyz, 1, 3}, dynains::Pose::Identity(), 0.0);
}
