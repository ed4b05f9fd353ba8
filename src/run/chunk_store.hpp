// The chunks of a run and their files in its folder.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "chunk_file.hpp"
#include "chunk_grid.hpp"
#include "chunk_recorder.hpp"
#include "dynains/remover.hpp"
#include "run_plan.hpp"

namespace dynains::program {

/// Several threads and processes may use stores of one folder at the same time.
class ChunkStore {
 public:
  /// `folder`: of the results. `plan` outlives this.
  ChunkStore(const RunPlan& plan, const std::filesystem::path& folder);

  std::size_t size() const { return plan_.chunks.size(); }
  const Chunk& operator[](std::size_t number) const { return plan_.chunks[number]; }
  const ChunkOutputs& outputs() const { return outputs_; }
  /// Positions of the sensor of the whole run, m, world frame.
  const std::vector<Eigen::Vector3d>& path() const { return path_; }

  std::filesystem::path file(std::size_t number) const;
  ChunkFileReader open(std::size_t number) const { return {file(number), key(number)}; }
  ChunkFileWriter create(std::size_t number) const { return {file(number), key(number)}; }
  /// Whether there is a file of the chunk. Throws IoError if it is not whole.
  bool has(std::size_t number) const;

  /// Judges the scans of a chunk and writes its file. `remover` is made if it is empty, and may
  /// come from an earlier call. Calls `keep_going()`, with the number of own scans that are
  /// finished since the last call; if it returns false, the chunk ends there, without a file.
  /// Returns whether it is finished. Throws IoError, PoseError.
  bool judge(std::size_t number, std::optional<DynaInsRemover>& remover,
             const std::function<bool(std::size_t)>& keep_going) const;

  /// Removes the files, which are needed no more.
  void remove() const;

 private:
  ChunkKey key(std::size_t number) const;
  /// The scan that a chunk shares with the next one.
  std::optional<std::size_t> shared_behind(std::size_t number) const;

  const RunPlan& plan_;
  std::filesystem::path folder_;  // of the files
  std::vector<Eigen::Vector3d> path_;
  ChunkOutputs outputs_;
};

}  // namespace dynains::program
