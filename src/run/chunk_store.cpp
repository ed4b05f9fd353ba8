#include "chunk_store.hpp"

#include <system_error>
#include <utility>

#include "run_chunk.hpp"
#include "run_results.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// Nothing of it depends on the folder of results, or on who judges a chunk.
ChunkOutputs outputs_of_chunks(const RunPlan& plan) {
  const RunOutputs& run = plan.outputs;
  ChunkOutputs outputs;
  outputs.with_beliefs = run.needs_beliefs();
  outputs.with_online = run.write_online;
  outputs.with_map = plan.config.build_map;
  outputs.map = plan.config.map;
  outputs.moving = moving_columns(plan.sequence, plan.range);
  return outputs;
}

/// Each chunk builds its map from the final labels of its own scans.
DynaInsRemover::Config without_map(DynaInsRemover::Config config) {
  config.build_map = false;
  return config;
}

}  // namespace

ChunkStore::ChunkStore(const RunPlan& plan, const fs::path& folder)
    : plan_(plan),
      folder_(folder / kChunkFolder),
      path_(path_of(plan.sequence, plan.range)),
      outputs_(outputs_of_chunks(plan)) {}

fs::path ChunkStore::file(std::size_t number) const {
  return folder_ / (plan_.sequence.name((*this)[number].own.first) + kChunkExtension);
}

ChunkKey ChunkStore::key(std::size_t number) const {
  const ScanRange& own = (*this)[number].own;
  return {plan_.fingerprint, own.first, own.size()};
}

bool ChunkStore::has(std::size_t number) const {
  std::error_code ignored;
  if (!fs::exists(file(number), ignored)) return false;
  open(number).verify();
  return true;
}

std::optional<std::size_t> ChunkStore::shared_behind(std::size_t number) const {
  if (number + 1 >= size()) return std::nullopt;
  return shared_scan((*this)[number], (*this)[number + 1]);
}

bool ChunkStore::judge(std::size_t number, std::optional<DynaInsRemover>& remover,
                       const std::function<bool(std::size_t)>& keep_going) const {
  if (!remover) remover.emplace(without_map(plan_.config));
  const Chunk& chunk = (*this)[number];
  ChunkFileWriter writer = create(number);
  ChunkRecorder recorder(chunk, number > 0 ? shared_behind(number - 1) : std::nullopt,
                         shared_behind(number), path_, outputs_, writer);
  std::size_t told = 0;
  const auto tell = [&] {
    const std::size_t before = std::exchange(told, recorder.finished());
    return keep_going(recorder.finished() - before);
  };
  if (!run_chunk(*remover, plan_.sequence, plan_.range, chunk, recorder, tell)) return false;
  recorder.finish();
  tell();
  return true;
}

void ChunkStore::remove() const {
  std::error_code ignored;
  for (std::size_t number = 0; number < size(); ++number) fs::remove(file(number), ignored);
  fs::remove(folder_, ignored);
}

}  // namespace dynains::program
