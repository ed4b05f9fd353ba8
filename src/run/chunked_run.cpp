#include "chunked_run.hpp"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "chunk_file.hpp"
#include "chunk_recorder.hpp"
#include "chunk_store.hpp"
#include "dynains/errors.hpp"
#include "dynains/pose.hpp"
#include "dynains/remover.hpp"
#include "instance_numbers.hpp"
#include "interrupt.hpp"
#include "label_writer.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// The static map of all chunks, in memory or on the disk.
class MergedMap {
 public:
  MergedMap(const RunPlan& plan, const fs::path& folder) : in_memory_(plan.config.map) {
    if (!plan.map_on_disk) return;
    TiledStaticMap::Config config = plan.map_on_disk->map;
    config.map_folder = folder / kTileFolder;
    on_disk_ = std::make_unique<TiledStaticMap>(config);
  }

  /// `place`: pose of a scan of the chunk.
  void add(ChunkFileReader& reader, const Eigen::Isometry3d& place) {
    reader.add_map(in_memory_);
    if (!on_disk_) return;
    Eigen::Isometry3d T_world_chunk = Eigen::Isometry3d::Identity();
    T_world_chunk.translation() = place.translation();
    PointBuffer points;
    in_memory_.for_each([&](const Eigen::Vector3d& point) {
      const Eigen::Vector3f p = (point - place.translation()).cast<float>();
      points.x.push_back(p.x());
      points.y.push_back(p.y());
      points.z.push_back(p.z());
    });
    in_memory_.clear();
    on_disk_->insert(points, {}, T_world_chunk);
  }

  void give_to(RunResults& results) {
    const auto give = [&](const Eigen::Vector3d& point) { results.add_map_point(point); };
    if (!on_disk_) {
      in_memory_.for_each(give);
      return;
    }
    on_disk_->for_each(give);
    on_disk_->clear();
    const fs::path folder = on_disk_->config().map_folder;
    on_disk_.reset();
    std::error_code ignored;
    fs::remove(folder, ignored);
  }

 private:
  StaticMapAccumulator in_memory_;  // with tiles on the disk: of one chunk
  std::unique_ptr<TiledStaticMap> on_disk_;
};

class ChunkedRun {
 public:
  ChunkedRun(const RunPlan& plan, const RunListener& listener, const fs::path& folder,
             RunResults& results)
      : plan_(plan),
        listener_(listener),
        folder_(folder),
        results_(results),
        chunks_(plan, folder),
        states_(plan.chunks.size()) {}
  ~ChunkedRun() { join(); }
  ChunkedRun(const ChunkedRun&) = delete;
  ChunkedRun& operator=(const ChunkedRun&) = delete;

  RunTiming run() {
    timing_.stages = stage_names();
    timing_.jobs = plan_.jobs;
    MergedMap map(plan_, folder_);
    report_progress(0);
    for (std::size_t i = 0; i < plan_.jobs; ++i) threads_.emplace_back([this] { work(); });
    for (std::size_t chunk = 0; chunk < states_.size() && await(chunk); ++chunk) {
      merge(chunk, map);
    }
    join();
    tell(warnings_, done_);
    if (error_) std::rethrow_exception(error_);
    if (results_.map_points()) map.give_to(results_);
    return std::move(timing_);
  }

 private:
  enum class Stage { kWaiting, kAtWork, kJudged, kLinked };
  struct State {
    Stage stage = Stage::kWaiting;
    bool has_labels = false;  // written, or being written
    bool is_final = false;    // the labels are written
    bool is_kept = false;     // an earlier run had finished the chunk
    ChunkInstances instances;
    std::optional<InstanceNumbers> numbers;
  };
  struct Task {
    std::size_t chunk;
    bool is_labels;
  };

  // Labels come first, so that few chunks wait for them. Empty if nothing is left to do.
  std::optional<Task> next_task() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      is_stopping_ = is_stopping_ || InterruptGuard::signal() != 0;
      for (std::size_t i = 0; i < linked_ && !error_; ++i) {
        if (states_[i].has_labels) continue;
        states_[i].has_labels = true;
        ++at_work_;
        return Task{i, true};
      }
      if (!is_stopping_ && next_ < states_.size()) {
        states_[next_].stage = Stage::kAtWork;
        ++at_work_;
        return Task{next_++, false};
      }
      if (at_work_ == 0) return std::nullopt;
      changed_.wait(lock);
    }
  }

  void work() {
    std::optional<DynaInsRemover> remover;
    while (const std::optional<Task> task = next_task()) {
      bool is_done = false;
      std::exception_ptr error;
      ChunkInstances instances;
      try {
        if (task->is_labels) {
          finish(task->chunk);
          is_done = true;
        } else if (is_usable(task->chunk) || judge(task->chunk, remover)) {
          instances = chunks_.open(task->chunk).read_summary().instances;
          is_done = true;
        }
      } catch (...) {
        error = std::current_exception();
      }
      const std::lock_guard<std::mutex> lock(mutex_);
      if (error && (!error_ || task->chunk < error_chunk_)) {
        error_ = error;
        error_chunk_ = task->chunk;
      }
      --at_work_;
      is_stopping_ = is_stopping_ || !is_done;
      State& state = states_[task->chunk];
      if (is_done && task->is_labels) state.is_final = true;
      if (is_done && !task->is_labels) {
        state.instances = std::move(instances);
        state.stage = Stage::kJudged;
        link();
      }
      changed_.notify_all();
    }
    changed_.notify_all();
  }

  // Translates the ids of all chunks behind a row of judged ones. The caller holds the mutex.
  void link() {
    for (; linked_ < states_.size() && states_[linked_].stage == Stage::kJudged; ++linked_) {
      State& state = states_[linked_];
      if (linked_ == 0) {
        state.numbers.emplace(state.instances);
      } else {
        State& before = states_[linked_ - 1];
        state.numbers.emplace(*before.numbers, before.instances, state.instances);
        before.instances = {};
        add_moved(*state.numbers, state.instances);
      }
      state.stage = Stage::kLinked;
    }
  }

  // Instances that moved before the chunk and are there at its end moved up to its end, too.
  static void add_moved(const InstanceNumbers& numbers, ChunkInstances& instances) {
    std::vector<std::uint32_t>& moving = instances.moving_behind;
    std::set<std::uint32_t> ids(moving.begin(), moving.end());
    for (const std::uint32_t id : instances.shared_behind) {
      if (numbers.moved_before(id)) ids.insert(id);
    }
    moving.assign(ids.begin(), ids.end());
  }

  // Whether an earlier run left a whole file of the chunk.
  bool is_usable(std::size_t number) {
    try {
      if (!chunks_.has(number)) return false;
    } catch (const IoError& error) {
      const std::lock_guard<std::mutex> lock(mutex_);
      warnings_.push_back(std::string(error.what()) + "; the chunk is processed again");
      return false;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ += chunks_[number].own.size();
    ++timing_.kept_chunks;
    states_[number].is_kept = true;
    return true;
  }

  // False if a signal or an error elsewhere ended it.
  bool judge(std::size_t number, std::optional<DynaInsRemover>& remover) {
    return chunks_.judge(number, remover, [this](std::size_t more) {
      const std::lock_guard<std::mutex> lock(mutex_);
      done_ += more;
      changed_.notify_all();
      return !is_stopping_ && InterruptGuard::signal() == 0;
    });
  }

  void finish(std::size_t number) const {
    const std::vector<std::uint32_t> still =
        chunks_.open(number).read_summary().instances.still_before;
    const InstanceNumbers& numbers = *states_[number].numbers;
    const bool is_contradicted = plan_.config.uses_free_space() &&
                                 std::any_of(still.begin(), still.end(), [&](std::uint32_t id) {
                                   return numbers.moved_before(id);
                                 });
    if (is_contradicted) hand_over(number);
    write_labels(number);
  }

  // Evidence of motion can be older than the warm-up, if an object stands for long. What the chunk
  // before calls dynamic up to the border therefore stays dynamic: the file is written again.
  void hand_over(std::size_t number) const {
    const Chunk& own = chunks_[number];
    const InstanceNumbers& numbers = *states_[number].numbers;
    ChunkSummary summary = chunks_.open(number).read_summary();
    ChunkFileReader reader = chunks_.open(number);
    ChunkFileWriter writer = chunks_.create(number);
    ChunkRecorder recorder(own, std::nullopt, std::nullopt, chunks_.path(), chunks_.outputs(),
                           writer);
    recorder.take_shared(std::move(summary.instances.shared_before),
                         std::move(summary.instances.shared_behind));
    recorder.add_pipeline_time(summary.timing.pipeline);
    ReadAhead scans(plan_.sequence, own.own.first, own.own.last, std::launch::deferred);
    RecordedScan recorded;
    InstancePoints points;
    ChunkScan scan;
    for (std::size_t i = own.own.first; i <= own.own.last; ++i) {
      reader.next(scan);
      std::set<std::uint32_t> moved;
      points.count(scan.labels, scan.instances);
      points.for_each([&](std::uint32_t id, bool is_dynamic) {
        if (!is_dynamic && numbers.moved_before(id)) moved.insert(id);
      });
      if (!moved.empty()) mark_moved(moved, scan);
      // The first verdict knows of the chunk before when its verdicts have become final.
      if (!moved.empty() && i >= own.own.first + plan_.latency) mark_moved_online(moved, scan);
      ScanVerdict verdict = verdict_of(i, scan);
      verdict.labels = scan.online;
      recorder.take_newest(i, std::move(summary.timing.rows[i - own.own.first]), verdict);
      verdict.labels = scan.labels;
      recorded = scans.next(std::move(recorded));
      recorder.take_final(i, recorded, verdict);
    }
    recorder.finish();
  }

  void mark_moved(const std::set<std::uint32_t>& moved, ChunkScan& scan) const {
    const auto belief = static_cast<float>(plan_.config.evidence.tau_track);
    for (std::size_t i = 0; i < scan.instances.size(); ++i) {
      if (scan.labels[i] != PointLabel::kStatic || moved.count(scan.instances[i]) == 0) continue;
      scan.labels[i] = PointLabel::kDynamic;
      scan.causes[i] = Cause::kAlongTrack;
      if (!scan.beliefs.empty()) scan.beliefs[i] = std::max(scan.beliefs[i], belief);
    }
  }

  static void mark_moved_online(const std::set<std::uint32_t>& moved, ChunkScan& scan) {
    for (std::size_t i = 0; i < scan.online.size(); ++i) {
      if (scan.online[i] == PointLabel::kStatic && moved.count(scan.instances[i]) > 0) {
        scan.online[i] = PointLabel::kDynamic;
      }
    }
  }

  void write_labels(std::size_t number) const {
    LabelFiles labels(folder_ / "labels", folder_ / "causes",
                      plan_.outputs.write_beliefs ? folder_ / "beliefs" : fs::path());
    LabelFiles online(folder_ / "online");
    const InstanceNumbers& numbers = *states_[number].numbers;
    // An earlier run may have written the labels of its chunks.
    const bool is_kept = states_[number].is_kept;
    ChunkFileReader reader = chunks_.open(number);
    VerdictRuns runs;
    ChunkScan scan;
    for (std::size_t i = chunks_[number].own.first; i <= chunks_[number].own.last; ++i) {
      reader.next_runs(runs, scan);
      for (std::uint32_t& id : runs.instances) id = numbers(id);
      labels.take(runs, scan.beliefs);
      labels.write(plan_.sequence.name(i), is_kept);
      if (!chunks_.outputs().with_online) continue;
      runs.expand(scan);
      ScanVerdict verdict = verdict_of(i, scan);
      verdict.labels = scan.online;
      online.take(verdict);
      online.write(plan_.sequence.name(i), is_kept);
    }
  }

  ScanVerdict verdict_of(std::size_t i, const ChunkScan& scan) const {
    return {i - plan_.range.first,
            plan_.sequence.time(i),
            orthonormalized(plan_.sequence.T_world_sensor(i)),
            scan.labels,
            scan.instances,
            scan.beliefs,
            scan.causes};
  }

  // Waits for the labels of a chunk. False if the chunk will not be finished.
  bool await(std::size_t number) {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      const std::vector<std::string> warnings = std::exchange(warnings_, {});
      const std::size_t done = done_;
      if (!warnings.empty() || done != reported_) {
        reported_ = done;
        lock.unlock();
        tell(warnings, done);
        lock.lock();
        continue;
      }
      if (error_) return false;
      const State& state = states_[number];
      if (state.is_final) return true;
      if (is_stopping_ && at_work_ == 0 && state.stage != Stage::kLinked) return false;
      changed_.wait(lock);
    }
  }

  void tell(const std::vector<std::string>& warnings, std::size_t done) const {
    for (const std::string& warning : warnings) {
      if (listener_.warn) listener_.warn(warning);
    }
    report_progress(done);
  }
  void report_progress(std::size_t done) const {
    if (listener_.progress) listener_.progress(done, plan_.range.size());
  }
  // Gives everything but the labels to the results. All chunks before are merged.
  void merge(std::size_t number, MergedMap& map) {
    const ScanRange& own = chunks_[number].own;
    const InstanceNumbers& numbers = *states_[number].numbers;
    const bool needs_scans = results_.needs_scans();
    std::optional<ReadAhead> scans;
    if (needs_scans) scans.emplace(plan_.sequence, own.first, own.last, std::launch::deferred);
    RecordedScan points;
    ChunkFileReader reader = chunks_.open(number);
    PointRecords moving(chunks_.outputs().moving);
    ChunkScan scan;
    for (std::size_t i = own.first; i <= own.last; ++i) {
      if (needs_scans) {
        reader.next(scan);
      } else {
        reader.next_moving(scan.moving);
      }
      if (!moving.assign(scan.moving)) {
        throw IoError(chunks_.file(number).string() + ": has other moving points");
      }
      moving.replace_labels(
          [&](std::uint32_t id) { return mos_label(PointLabel::kDynamic, numbers(id)); });
      results_.add_moving_points(moving);
      if (!needs_scans) continue;
      for (std::uint32_t& id : scan.instances) id = numbers(id);
      points = scans->next(std::move(points));
      results_.add_scan(points, verdict_of(i, scan));
    }
    ChunkSummary summary = reader.read_summary();
    if (!results_.add_chunk(own.size(), summary)) {
      throw IoError(chunks_.file(number).string() + ": has another picture");
    }
    for (std::size_t i = 0; i < summary.timing.rows.size(); ++i) {
      TimingRow& row = summary.timing.rows[i];
      row.scan = plan_.sequence.name(own.first + i);
      timing_.rows.push_back(std::move(row));
    }
    map.add(reader, plan_.sequence.T_world_sensor(own.first));
    const std::lock_guard<std::mutex> lock(mutex_);
    ++timing_.chunks;
    timing_.pipeline += summary.timing.pipeline;
  }

  void join() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      // Without an error or a signal, no chunk waits any more.
      if (std::uncaught_exceptions() > 0) is_stopping_ = true;
      changed_.notify_all();
    }
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

  const RunPlan& plan_;
  const RunListener& listener_;
  const fs::path& folder_;
  RunResults& results_;
  ChunkStore chunks_;

  // The members below are guarded by the mutex, but for numbers of linked chunks, which stay.
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<State> states_;
  std::size_t next_ = 0;      // chunk to begin
  std::size_t at_work_ = 0;   // chunks
  std::size_t linked_ = 0;    // chunks
  std::size_t done_ = 0;      // scans
  std::size_t reported_ = 0;  // scans, of done_
  bool is_stopping_ = false;
  std::exception_ptr error_;
  std::size_t error_chunk_ = 0;
  std::vector<std::string> warnings_;
  RunTiming timing_;
  std::vector<std::thread> threads_;
};

}  // namespace

RunTiming run_in_chunks(const RunPlan& plan, const RunListener& listener, const fs::path& folder,
                        RunResults& results) {
  create_folder(folder / kChunkFolder);
  return ChunkedRun(plan, listener, folder, results).run();
}

}  // namespace dynains::program
