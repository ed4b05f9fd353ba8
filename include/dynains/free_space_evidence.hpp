// Free-space evidence: a beam of another scan that passed through the place of a point shows that
// the point was part of something that moved. Free space says where something moved; instances say
// what to remove whole. Goes beyond the paper, in the form of its belief (Eq. 15-19).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/belief_updater.hpp"
#include "dynains/cause.hpp"
#include "dynains/detail/beam_test.hpp"
#include "dynains/detail/bits.hpp"
#include "dynains/detail/free_space_sum.hpp"
#include "dynains/detail/turn.hpp"
#include "dynains/evidence_verdict.hpp"
#include "dynains/free_space_config.hpp"
#include "dynains/ground_footprint.hpp"
#include "dynains/ground_segmenter.hpp"
#include "dynains/instance_hull.hpp"
#include "dynains/instance_samples.hpp"
#include "dynains/instance_tracks.hpp"
#include "dynains/points.hpp"
#include "dynains/range_image.hpp"
#include "dynains/reference_lags.hpp"
#include "dynains/sensor_model.hpp"
#include "dynains/supervoxel_groups.hpp"

namespace dynains {

/// Tests samples of each scan against range images of scans before and after it, and accumulates
/// what they show as belief per supervoxel. Of each segment, the first scan and every
/// `reference_step`-th after it have such an image.
///
/// The belief is a log-odds sum that starts again whenever it falls to zero (Page's test for a
/// change, 1954): a place that is hit for long and then seen free has changed, and hits never
/// cancel what was seen free; yet thin things, which single beams miss, are hit too often in
/// between for the sum to grow. References before and after the scan are summed apart.
class FreeSpaceEvidence {
 public:
  using Config = FreeSpaceConfig;

  FreeSpaceEvidence() : FreeSpaceEvidence(Config()) {}

  /// Throws ConfigError.
  explicit FreeSpaceEvidence(const Config& config)
      : config_((config.validate(), config)),
        sampler_(config.sample_size, config.supervoxel, config.evidence_range,
                 static_cast<std::uint32_t>(config.supervoxel_samples)),
        ground_sampler_(config.ground_sample, config.ground_sample, config.evidence_range, 1),
        footprint_(config.footprint > 0.0 ? std::max(config.footprint, 0.05) : kDefaultCell,
                   std::max({config.ground_reach, config.footprint, 0.5}), config.evidence_range),
        sum_(config.p_free, config.p_hit),
        free_level_(static_cast<float>(log_odds(config.tau_free))),
        contested_level_(static_cast<float>(log_odds(config.tau_contested))),
        whole_level_(static_cast<float>(log_odds(config.tau_whole))),
        track_level_(static_cast<float>(log_odds(config.tau_track))),
        hull_(2.0 * std::max(config.footprint, 0.05)),
        linker_(config.track_cell, config.track_length, config.track_height, config.track_overlap),
        track_belief_(static_cast<float>(log_odds(config.p_free))),
        step_(static_cast<std::uint64_t>(config.reference_step)),
        views_(static_cast<std::size_t>(std::max(config.memory, config.horizon)) / step_ + 1),
        records_(static_cast<std::size_t>(config.horizon) + 2) {
    const int step = config.reference_step;
    for (int phase = 0; phase < step; ++phase) {
      const auto turn = static_cast<int>(turn_of(static_cast<std::uint64_t>(phase)));
      before_.push_back(reference_lags(config.memory, phase, step));
      after_.push_back(reference_lags(config.horizon - turn, step - phase, step));
    }
  }

  const Config& config() const { return config_; }

  /// Scans after which a verdict is final.
  std::size_t horizon() const { return static_cast<std::size_t>(config_.horizon); }

  /// Chooses the resolution of range images, which are those of the sensor as it is tilted; to be
  /// called before the first scan, and again once more is known of the sensor.
  void adapt(const SensorModel& sensor) {
    grid_ = RangeImageGrid::for_sensor(sensor);
    // The next beam over one that ended at the foot of something may be the first to hit it.
    clearance_.slope = static_cast<float>(std::tan(sensor.elevation_gap_wide * M_PI / 180.0));
    R_beams_level_.reset();
    if (!sensor.is_level()) R_beams_level_ = sensor.R_level_headed.transpose();
  }

  /// Lets judge() be asked about scans up to that many behind the newest, if these are more than
  /// horizon(): what happened later than that says nothing about them. To be called before the
  /// first scan.
  void keep(std::size_t scans) { records_.resize(std::max(records_.size(), scans + 2)); }

  /// Gets the memory of images for that many scans of the sensor that adapt() was told, and of what
  /// else is kept of scans if one was observed already; or for as many as are ever kept.
  void reserve(std::size_t scans) {
    const std::size_t images = grid_.rows > 0 ? std::min(scans / step_ + 1, views_.size()) : 0;
    for (std::size_t i = 0; i < images; ++i) views_[i].image.reserve(grid_);
    const auto largest = std::max_element(
        records_.begin(), records_.end(),
        [](const Record& a, const Record& b) { return a.samples.size() < b.samples.size(); });
    for (std::size_t i = 0; i < std::min(scans, records_.size()); ++i) {
      if (records_[i].samples.size() < largest->samples.size()) records_[i] = *largest;
    }
  }

  /// Takes scan number `scan` in: scans come in order, from 0. `instance_of` holds the instance of
  /// each non-ground point of `split`, below `instance_count` or kNoCluster. Only scans of the
  /// same `segment` are compared.
  void observe(std::uint64_t scan, std::uint64_t segment, const Eigen::Isometry3d& T_world_sensor,
               const GroundSplit& split, Span<const std::uint32_t> instance_of,
               std::size_t instance_count) {
    if (scan == 0) forget();
    if (scan == 0 || record_of(scan - 1).segment != segment) {
      T_origin_world_ = T_world_sensor.inverse();
      segment_begin_ = scan;
    }
    Record& record = record_of(scan);
    record.segment = segment;
    record.T_world_sensor = T_world_sensor;
    record.phase = (scan - segment_begin_) % step_;
    if (record.phase == 0) ++images_;
    record.image = images_;
    // Points that were sampled are at hand when the image is made.
    footprint_.bound(split.ground(), record.ground_boxes);
    sampler_.sample(split.non_ground(), instance_of, instance_count, record.samples);
    if (record.phase == 0) make_image(scan, segment, T_world_sensor, split);
    record.beliefs.assign(record.samples.supervoxel_count(), Belief());
    record.wholes.assign(instance_count, Belief());
    record.changed.assign(instance_count, 1);
    record.shares.resize(instance_count);
    for (std::size_t instance = 0; instance < instance_count; ++instance) {
      record.shares[instance] = {record.samples.count(instance), 0, 0};
    }
    record.open.assign(record.samples.size() / 64 + 1, ~std::uint64_t{0});
    predecessors_.assign(instance_count, kNoCluster);
    if (config_.use_tracks) track(scan, record);

    for (const int lag : before_[record.phase]) {
      const View* const reference = reference_of(record, scan, -lag);
      if (reference != nullptr) refer(record, *reference, -lag);
    }
    // What follows is summed apart from what was before.
    for (std::uint32_t s = 0; s < record.beliefs.size(); ++s) {
      Belief& belief = record.beliefs[s];
      if (belief.contested != 0 && belief.level > 0.0F) flip_open(record, s);
      belief.level = 0.0F;
    }
    for (Belief& belief : record.wholes) belief.level = 0.0F;
    weigh(record);
    for (std::uint64_t older = 0; older < step_; ++older) {
      if (turn_of(older) == record.phase) {
        refer_older(older, newest_view());
      }
    }
    if (config_.use_tracks) run_beliefs(scan);
  }

  /// Verdict on a scan that is at most `horizon()` old, or what keep() was told, as the evidence
  /// stands now. Nothing is presumed in a final verdict. `split`: that of the scan. The spans hold
  /// until the next call.
  EvidenceVerdict judge(std::uint64_t scan, bool is_final, const GroundSplit& split) {
    const Record& record = record_of(scan);
    judge_instances(scan, is_final, record);
    const InstanceSamples& samples = record.samples;
    groups_of_points_.assign(1, {Cause::kNotJudged, 0.0F});
    groups_of_points_.resize(samples.met.size());
    for (std::size_t i = 1; i < samples.met.size(); ++i) {
      groups_of_points_[i] = verdicts_[samples.met[i]];
    }
    moved_ground_.clear();
    add_footprint(split.non_ground(), samples.met_of);
    if (!footprint_.empty()) {
      footprint_.spread();
      judge_ground(scan, record, split.ground());
      footprint_.clear();
    }
    return {groups_of_points_, samples.met_of, moved_ground_};
  }

  /// What the newest reference, one of the last `reference_step` scans, saw of the first `count`
  /// points (m; padded for wide loads).
  const detail::Sights& see(const PointBuffer& points, std::size_t count,
                            const Eigen::Isometry3d& T_world_points) {
    look(points, count, T_world_points, newest_view());
    return sights_;
  }

  /// For each instance of the scan observed last, its number in the scan before, or kNoCluster.
  Span<const std::uint32_t> predecessors() const { return predecessors_; }

 private:
  struct Belief {
    float level = 0.0F;          // log-odds of the references summed up now; never negative
    float peak = 0.0F;           // the highest it was
    std::uint8_t contested = 0;  // whether some reference hit the place
  };
  using Verdict = EvidenceVerdict::Group;
  // Samples of an instance.
  struct Share {
    std::uint32_t total = 0;
    std::uint32_t moved = 0;    // in supervoxels that were free
    std::uint32_t decided = 0;  // in supervoxels of which anything is known
  };
  struct View {
    std::uint64_t scan = 0;
    std::uint64_t segment = kNoSegment;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    RangeImage image;
  };
  struct Record {
    std::uint64_t segment = kNoSegment;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    std::uint64_t phase = 0;  // scans since the newest image of that time ...
    std::uint64_t image = 0;  // ... and its number
    InstanceSamples samples;
    std::vector<Belief> beliefs;      // by supervoxel
    std::vector<Belief> wholes;       // by instance, of all its samples together
    std::vector<Share> shares;        // by instance
    std::vector<std::uint64_t> open;  // by sample, a bit each: whether a hit may change its belief
    std::vector<std::uint8_t> changed;  // by instance: whether beliefs changed since it was weighed
    TrackedInstances tracked;
    std::vector<GroundBox> ground_boxes;  // by 64 points of the ground
  };
  // Points of a block of the ground that are tested, a bit each.
  struct TestedBlock {
    std::size_t begin;     // point
    std::uint64_t points;  // which
    std::uint64_t first;   // of these, the first of a run
    std::size_t run;       // number of the first run
  };
  static constexpr std::uint64_t kNoSegment = ~std::uint64_t{0};

  // Numbers of scans begin again: what is kept is of others.
  void forget() {
    for (View& view : views_) view.segment = kNoSegment;
    for (Record& record : records_) record.segment = kNoSegment;
  }

  // Beams are rows of an image only in the frame of the sensor, tilted as it is.
  void make_image(std::uint64_t scan, std::uint64_t segment, const Eigen::Isometry3d& T_world_level,
                  const GroundSplit& split) {
    View& view = newest_view();
    view.scan = scan;
    view.segment = segment;
    const auto reach = static_cast<float>(config_.lateral_margin);
    view.T_world_sensor = T_world_level;
    if (!R_beams_level_) {
      view.image.build(grid_, split.ground(), split.non_ground(), reach, image_scratch_);
      return;
    }
    view.T_world_sensor.rotate(R_beams_level_->transpose());
    const Eigen::Matrix3f R = R_beams_level_->cast<float>();
    const PointsView ground = detail::turn(split.ground(), R, turned_ground_);
    const PointsView rest = detail::turn(split.non_ground(), R, turned_rest_);
    view.image.build(grid_, ground, rest, reach, image_scratch_);
  }

  // The image that was made `lag` scans after a scan, or before it; null if there is none.
  const View* reference_of(const Record& record, std::uint64_t scan, int lag) const {
    const auto signed_step = static_cast<std::int64_t>(step_);
    const std::int64_t to_image = lag + static_cast<std::int64_t>(record.phase);
    const std::uint64_t image =
        record.image + static_cast<std::uint64_t>(to_image / signed_step);  // exact
    const View& view = views_[image % views_.size()];
    const std::uint64_t at = scan + static_cast<std::uint64_t>(std::int64_t{lag});
    return view.scan == at && view.segment == record.segment ? &view : nullptr;
  }

  View& newest_view() { return views_[images_ % views_.size()]; }

  Record& record_of(std::uint64_t scan) { return records_[scan % records_.size()]; }

  void look(const PointBuffer& samples, std::size_t count, const Eigen::Isometry3d& T_world_sensor,
            const View& reference) {
    const Eigen::Isometry3d T_reference_sample =
        reference.T_world_sensor.inverse() * T_world_sensor;
    detail::test_beams(reference.image, T_reference_sample.cast<float>(), samples, count,
                       static_cast<float>(config_.margin), static_cast<float>(config_.margin_slope),
                       sights_);
  }

  // One reference for all samples of a scan. `lag`: scans from the samples to the reference.
  void refer(Record& record, const View& reference, int lag) {
    look(record.samples.points, record.samples.size(), record.T_world_sensor, reference);
    // Processors with wide lanes find and count bits by one instruction.
    detail::run_lanes([&](auto) {
      update_supervoxels(record);
      update_wholes(record, lag);
    });
  }

  // Scans of one phase are held against a new image after the other, for each new scan to bring as
  // much work; those of the image's own phase have to wait for the next scan, as making it was work
  // enough.
  std::uint64_t turn_of(std::uint64_t phase) const { return phase == 0 && step_ > 1 ? 1 : phase; }

  // Holds the image of a scan against those before it that are of a phase.
  void refer_older(std::uint64_t phase, const View& image) {
    for (const int lag : after_[phase]) {
      const auto back = static_cast<std::uint64_t>(lag);
      if (back > image.scan) break;
      Record& older = record_of(image.scan - back);
      if (older.segment != image.segment) continue;
      refer(older, image, lag);
      weigh(older);
    }
  }

  // What the reference saw may change supervoxels of which something was seen free, or was hit
  // while they are open: few, once a scan has met some references. All are asked for before the
  // first is needed: what is known of an older scan lies far away by now.
  void update_supervoxels(Record& record) {
    const std::size_t count = find_touched(record);
    for (std::size_t i = 0; i < count; ++i) update_supervoxel(record, touched_[i]);
  }

  // Leaves their numbers in `touched_`, in order, and returns how many there are.
  std::size_t find_touched(const Record& record) {
    constexpr std::size_t kBits = 64;
    const InstanceSamples& samples = record.samples;
    detail::grow(touched_, samples.supervoxel_count() + 1);
    std::size_t count = 0;
    std::uint32_t last = kNoCluster;
    for (std::size_t begin = 0; begin < samples.size(); begin += kBits) {
      std::uint64_t seen =
          sights_.free_word(begin) | (sights_.hit_word(begin) & record.open[begin / kBits]);
      const std::size_t left = samples.size() - begin;
      if (left < kBits) seen &= (std::uint64_t{1} << left) - 1;
      detail::for_each_bit(seen, [&](std::size_t i) {
        const std::uint32_t s = samples.supervoxel_of[begin + i];
        touched_[count] = s;
        count += s != last ? 1 : 0;
        last = s;
        __builtin_prefetch(&record.beliefs[s]);
        __builtin_prefetch(&samples.sample_begin[s]);
        __builtin_prefetch(&samples.instance_of[s]);
      });
    }
    return count;
  }

  void update_supervoxel(Record& record, std::uint32_t s) {
    const InstanceSamples& samples = record.samples;
    const std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    Belief& belief = record.beliefs[s];
    const bool was_open = is_open(belief);
    const bool was_free = is_free(belief);
    const bool was_decided = was_free || belief.contested != 0;
    const bool changed = update(belief, sights_.count(begin, end), end - begin);
    if (is_open(belief) != was_open) flip_open(record, s);
    if (!changed) return;
    const std::uint32_t instance = samples.instance_of[s];
    Share& share = record.shares[instance];
    const bool free = is_free(belief);
    const bool decided = free || belief.contested != 0;
    share.moved += (free ? end - begin : 0) - (was_free ? end - begin : 0);
    share.decided += (decided ? end - begin : 0) - (was_decided ? end - begin : 0);
    record.changed[instance] = 1;
  }

  // Whether hits may change it: what was hit before and is not seen free stays as it is.
  static bool is_open(const Belief& belief) { return belief.contested == 0 || belief.level > 0.0F; }
  static void flip_open(Record& record, std::uint32_t s) {
    std::uint32_t begin = record.samples.sample_begin[s];
    const std::uint32_t end = record.samples.sample_begin[s + 1];
    while (begin < end) {
      const std::uint32_t last = std::min(end - 1, begin | 63U);  // in this word
      record.open[begin / 64] ^= ~std::uint64_t{0} >> (63 - (last - begin)) << begin % 64;
      begin = last + 1;
    }
  }

  // Whether the reference saw through whole instances.
  void update_wholes(Record& record, int lag) {
    const InstanceSamples& samples = record.samples;
    std::uint32_t end = 0;
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t begin = end;
      end += record.shares[instance].total;
      const detail::Sights::Count all = sights_.count(begin, end);
      const auto count = static_cast<float>(end - begin);
      const auto seen = static_cast<float>(all.free + all.hit);
      if (seen < std::max(2.0F, kLeastView * count)) continue;
      const float share = static_cast<float>(all.free) / seen;
      if (share >= static_cast<float>(config_.see_share)) {
        raise(record.wholes[instance], share);
        record.changed[instance] = 1;
      } else if (share <= detail::FreeSpaceSum::kHitShare) {
        lower(record.wholes[instance]);
        record.changed[instance] = 1;
        const auto hits = static_cast<float>(all.hit);
        if (config_.use_tracks && share <= 1.0F - kContradictingHits &&
            hits >= kLeastKnown * count) {
          TrackedInstances::Instance& tracked = record.tracked.instances[instance];
          (lag < 0 ? tracked.hit_back : tracked.hit_ahead) =
              static_cast<std::int16_t>(std::abs(lag));
        }
      }
    }
  }

  // For something that was seen. Eq. 15 with three-way increments as in Eq. 18, by the share of
  // samples seen free; shares that say little, or are of few samples, change nothing. Returns
  // whether what weigh() looks at changed.
  bool update(Belief& belief, detail::Sights::Count seen, std::uint32_t samples) const {
    const bool hits =
        seen.hit >= std::max(std::min(2U, samples), (samples + kLeastHit - 1) / kLeastHit);
    const auto free = static_cast<float>(seen.free);
    const float share = free / static_cast<float>(seen.free + seen.hit);
    if (free >= kLeastFree * static_cast<float>(samples) &&
        share >= detail::FreeSpaceSum::kFreeShare) {
      raise(belief, share);
      return true;
    }
    if (!hits || share > detail::FreeSpaceSum::kHitShare) return false;
    const bool first_hit = belief.contested == 0;
    lower(belief);
    return first_hit;
  }

  void raise(Belief& belief, float share) const {
    sum_.raise(belief.level, share);
    belief.peak = std::max(belief.peak, belief.level);
  }
  void lower(Belief& belief) const {
    belief.contested = 1;
    sum_.lower(belief.level);
  }

  bool is_free(const Belief& belief) const {
    return belief.peak >= (belief.contested != 0 ? contested_level_ : free_level_);
  }

  // What its own evidence says of each instance.
  void weigh(Record& record) const {
    if (!config_.use_tracks) return;
    for (std::size_t instance = 0; instance < record.changed.size(); ++instance) {
      if (record.changed[instance] == 0) continue;
      record.changed[instance] = 0;
      record.tracked.instances[instance].own = own_belief(record, instance);
    }
  }

  float own_belief(const Record& record, std::size_t instance) const {
    const Share& share = record.shares[instance];
    if (removes_whole(record, instance)) {
      return (2 * share.moved >= share.decided && share.moved > 0 ? 2.0F : 1.0F) * sum_.increment();
    }
    const auto moved = static_cast<float>(share.moved);
    const auto decided = static_cast<float>(share.decided);
    const bool known = decided >= kLeastKnown * static_cast<float>(share.total) && decided > 0.0F;
    return known && moved < kStillShare * decided
               ? -static_cast<float>(config_.still_weight) * sum_.increment()
               : 0.0F;
  }

  bool removes_whole(const Record& record, std::size_t instance) const {
    const Share& share = record.shares[instance];
    const Belief& whole = record.wholes[instance];
    return whole.peak >= (whole.contested != 0 ? whole_level_ : free_level_) ||
           (share.moved > 0 &&
            static_cast<float>(share.moved) >=
                static_cast<float>(config_.remove_share) * static_cast<float>(share.decided));
  }

  // Finds the instances of the newest scan again in the scan before.
  void track(std::uint64_t scan, Record& record) {
    linker_.measure(record.samples, T_origin_world_ * record.T_world_sensor, record.tracked);
    if (scan > segment_begin_) {
      linker_.link(record_of(scan - 1).tracked, record.tracked);
    }
    for (std::size_t i = 0; i < predecessors_.size(); ++i) {
      predecessors_[i] = record.tracked.instances[i].previous;
    }
  }

  // Beliefs along tracks, with what is known now of every scan that is still open: a scan just
  // behind the newest may meanwhile have been seen through.
  void run_beliefs(std::uint64_t newest) {
    const std::uint64_t open = std::min<std::uint64_t>(newest, horizon());
    for (std::uint64_t scan = newest - open; scan <= newest; ++scan) {
      Record& record = record_of(scan);
      const bool linked = scan > 0 && record_of(scan - 1).segment == record.segment;
      track_belief_.run_forward(linked ? &record_of(scan - 1).tracked : nullptr, record.tracked);
    }
    for (std::uint64_t scan = newest + 1; scan-- > newest - open;) {
      Record& record = record_of(scan);
      const bool linked = scan < newest && record_of(scan + 1).segment == record.segment;
      track_belief_.run_backward(linked ? &record_of(scan + 1).tracked : nullptr, record.tracked);
    }
  }

  // Belief that an instance moved from its whole track, its own evidence counted once.
  float track_belief(const TrackedInstances::Instance& instance) const {
    const float before = std::max(0.0F, instance.forward - instance.own);
    const float after = std::max(0.0F, instance.backward - instance.own);
    return instance.own + before + after;
  }

  void judge_instances(std::uint64_t scan, bool is_final, const Record& record) {
    const InstanceSamples& samples = record.samples;
    verdicts_.resize(samples.supervoxel_count());
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t first = samples.supervoxel_begin[instance];
      const std::uint32_t last = samples.supervoxel_begin[instance + 1];
      float level = 0.0F;
      free_.clear();
      for (std::uint32_t s = first; s < last; ++s) {
        const Belief& belief = record.beliefs[s];
        level = std::max(level, belief.peak);
        verdicts_[s] = {cause_to_stay(belief), as_probability(belief.peak)};
        if (is_free(belief)) free_.push_back(s);
      }
      const Cause whole = cause_of_whole(scan, is_final, record, instance, level);
      if (is_dynamic(whole)) {
        const Verdict verdict = {whole, as_probability(std::max(level, free_level_))};
        std::fill(verdicts_.begin() + first, verdicts_.begin() + last, verdict);
        for (const std::uint32_t s : free_) verdicts_[s].cause = Cause::kFreeSpace;
        add_hull(record, instance);
        continue;
      }
      // Something that moves beside something that stays: a few samples may be chance.
      groups_.keep_large(samples, kLeastGroup, free_);
      for (const std::uint32_t s : free_) verdicts_[s].cause = Cause::kFreeSpace;
    }
  }

  // Of a supervoxel that stays.
  static Cause cause_to_stay(const Belief& belief) {
    if (belief.peak > 0.0F) return Cause::kTooLittleFree;
    return belief.contested != 0 ? Cause::kOccupied : Cause::kNoEvidence;
  }

  // Why an instance is removed as a whole, or kNoEvidence if it is not; raises `level` to the
  // belief along its track.
  Cause cause_of_whole(std::uint64_t scan, bool is_final, const Record& record,
                       std::size_t instance, float& level) const {
    if (removes_whole(record, instance)) return Cause::kWithInstance;
    if (!config_.use_tracks || !record.tracked.shapes[instance].carried) {
      return Cause::kNoEvidence;
    }
    const float along = track_belief(record.tracked.instances[instance]);
    level = std::max(level, along);
    if (along >= track_level_) return Cause::kAlongTrack;
    return !is_final && presumed(scan, record, instance) ? Cause::kPresumed : Cause::kNoEvidence;
  }

  // The ground below a compact instance.
  void add_hull(const Record& record, std::size_t instance) {
    constexpr float kLeastHeight = 0.3F;  // m
    if (!config_.use_tracks || config_.footprint <= 0.0) return;
    const TrackedInstances::Shape& shape = record.tracked.shapes[instance];
    if (!shape.carried || shape.height < kLeastHeight) return;
    const InstanceSamples& samples = record.samples;
    const std::uint32_t begin = samples.sample_begin[samples.supervoxel_begin[instance]];
    const std::uint32_t end = samples.sample_begin[samples.supervoxel_begin[instance + 1]];
    const PointsView points = PointsView(samples.points).subview(begin, end - begin);
    const float lowest = *std::min_element(points.z.begin(), points.z.end());
    hull_.visit(points, [&](float x, float y) { footprint_.add(x, y, lowest); });
  }

  // Zero latency: a compact instance in a place that no earlier scan has seen may be the lead
  // vehicle as well as something static that came into view; the next scans will tell.
  bool presumed(std::uint64_t scan, const Record& record, std::size_t instance) const {
    constexpr std::uint32_t kLeastSamples = 5;
    constexpr float kLargest = 15.0F, kHighest = 3.5F, kUnknown = 0.1F;
    // Where comparison has just begun, no place has been seen.
    if (!config_.presume_dynamic || scan < segment_begin_ + 2) return false;
    const Share& share = record.shares[instance];
    const TrackedInstances::Shape& shape = record.tracked.shapes[instance];
    return share.total >= kLeastSamples && shape.length <= kLargest && shape.height <= kHighest &&
           static_cast<float>(share.decided) <= kUnknown * static_cast<float>(share.total);
  }

  // What points of removed groups stand on.
  void add_footprint(PointsView points, Span<const std::uint32_t> group_of) {
    detail::grow(moved_, groups_of_points_.size());
    bool any = false;
    for (std::size_t i = 0; i < groups_of_points_.size(); ++i) {
      const bool moved = is_dynamic(groups_of_points_[i].cause);
      moved_[i] = moved ? 1 : 0;
      any |= moved;
    }
    if (!any) return;
    const std::uint8_t* const moved = moved_.data();
    const std::uint32_t* const group = group_of.data();
    constexpr std::size_t kBlock = GroundFootprint::kBlock;
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      const PointsView block = points.subview(begin, std::min(kBlock, points.size() - begin));
      std::uint64_t which = 0;
      for (std::size_t i = 0; i < block.size(); ++i) {
        which |= std::uint64_t{moved[group[begin + i]]} << i;
      }
      if (which != 0) footprint_.add(block, which);
    }
  }

  // Most supervoxels were never seen free: they need no exponential.
  static float as_probability(float level) {
    return level == 0.0F ? 0.5F : 1.0F / (1.0F + std::exp(-level));
  }

  // Ground beside removed points: what stands within their footprint goes with them, and what two
  // references saw free was no ground.
  void judge_ground(std::uint64_t scan, const Record& record, PointsView ground) {
    const auto remove = [&](std::size_t point, Cause cause) {
      moved_ground_.push_back(
          {static_cast<std::uint32_t>(point), {cause, static_cast<float>(config_.tau_free)}});
    };
    tested_points_.grow(ground.size());
    detail::make_room(tested_blocks_, record.ground_boxes.size());
    tested_blocks_.clear();
    tested_ = 0;
    const bool tests = config_.ground_reach > 0.0;
    footprint_.visit_near(ground, record.ground_boxes, clearance_,
                          [&](std::size_t begin, std::uint64_t near, std::uint64_t below) {
                            const std::uint64_t under = config_.footprint > 0.0 ? below : 0;
                            detail::for_each_bit(under, [&](std::size_t i) {
                              remove(begin + i, Cause::kUnderInstance);
                            });
                            if (tests) add_tested(ground, begin, near & ~under);
                          });
    if (tested_ > 0) test_ground(scan, record, remove);
  }

  // Of a block of points from `begin` on, those whose bits are set: runs of points that share a
  // voxel of the samples, by their first points.
  void add_tested(PointsView ground, std::size_t begin, std::uint64_t which) {
    if (which == 0) return;
    const std::size_t size = std::min(GroundFootprint::kBlock, ground.size() - begin);
    const std::uint64_t changes = ground_sampler_.find_changes(ground.subview(begin, size));
    const std::uint64_t first = which & (changes | ~(which << 1U));
    tested_blocks_.push_back({begin, which, first, tested_});
    detail::for_each_bit(first, [&](std::size_t i) {
      tested_points_.x[tested_] = ground.x[begin + i];
      tested_points_.y[tested_] = ground.y[begin + i];
      tested_points_.z[tested_] = ground.z[begin + i];
      ++tested_;
    });
  }

  // Ground that enough of all references saw free, of the first `tested_` of `tested_points_`.
  template <class Remove>
  void test_ground(std::uint64_t scan, const Record& record, Remove&& remove) {
    detail::grow(one_instance_, tested_);
    ground_sampler_.sample(PointsView(tested_points_).subview(0, tested_),
                           Span<const std::uint32_t>(one_instance_).subspan(0, tested_), 1,
                           ground_samples_);
    const std::size_t count = ground_samples_.size();
    ground_free_.assign((count + 7) / 8 * 8, 0);
    ground_hit_.assign((count + 7) / 8 * 8, 0);
    for (const int lag : before_[record.phase]) count_ground(record, scan, -lag);
    for (const int lag : after_[record.phase]) count_ground(record, scan, lag);
    // Most of the time there is none.
    bool any = false;
    detail::grow(moved_, ground_samples_.met.size());
    moved_[0] = 0;
    for (std::size_t met = 1; met < ground_samples_.met.size(); ++met) {
      const std::uint32_t sample = ground_samples_.sample_begin[ground_samples_.met[met]];
      const std::uint8_t free = ground_free_[sample];
      const bool moved =
          free >= kGroundFree &&
          static_cast<float>(free) >= kGroundShare * static_cast<float>(ground_hit_[sample]);
      moved_[met] = moved ? 1 : 0;
      any |= moved;
    }
    if (!any) return;
    const auto lowest = [](std::uint64_t bits) { return bits & (~bits + 1); };
    for (const TestedBlock& block : tested_blocks_) {
      const std::uint32_t* met = &ground_samples_.met_of[block.run];
      for (std::uint64_t left = block.first; left != 0; left &= left - 1) {
        if (moved_[*met++] == 0) continue;
        const std::uint64_t first = lowest(left);
        const std::uint64_t next = lowest(left ^ first);  // 0 behind the last run
        detail::for_each_bit(block.points & (next - 1) & ~(first - 1),
                             [&](std::size_t i) { remove(block.begin + i, Cause::kFreeSpace); });
      }
    }
  }

  void count_ground(const Record& record, std::uint64_t scan, int lag) {
    const View* const view = reference_of(record, scan, lag);
    if (view == nullptr) return;
    look(ground_samples_.points, ground_samples_.size(), record.T_world_sensor, *view);
    sights_.add_to(ground_samples_.size(), ground_free_.data(), ground_hit_.data());
  }

  static constexpr float kLeastView = 0.1F;   // share of an instance that a reference must see
  static constexpr float kLeastFree = 0.15F;  // share of a supervoxel that must be seen free
  static constexpr std::uint32_t kLeastHit =
      4;                                      // one of so many samples of a supervoxel must be hit
  static constexpr float kLeastKnown = 0.3F;  // share of an instance, to speak of standing still
  static constexpr float kContradictingHits = 0.85F;  // of what is seen of an instance
  static constexpr float kStillShare = 0.02F;    // moved share of the known below which it stands
  static constexpr std::size_t kLeastGroup = 4;  // samples that go without the rest
  static constexpr double kDefaultCell = 0.2;    // m, of the footprint if it is off
  static constexpr std::uint32_t kGroundFree = 2;
  static constexpr float kGroundShare = 0.3F;

  Config config_;
  InstanceSampler sampler_;
  InstanceSampler ground_sampler_;
  GroundFootprint footprint_;
  detail::FreeSpaceSum sum_;
  float free_level_;
  float contested_level_;
  float whole_level_;
  float track_level_;
  InstanceHull hull_;
  SupervoxelGroups groups_;
  InstanceLinker linker_;
  TrackBelief track_belief_;
  RangeImageGrid grid_;
  Clearance clearance_ = {0.4F, 0.0F};            // between ground and what stands on it
  std::optional<Eigen::Matrix3d> R_beams_level_;  // of a sensor that is tilted
  PointBuffer turned_ground_;
  PointBuffer turned_rest_;
  // The first sensor of the segment, in whose frame cells of tracks lie wherever the world begins.
  Eigen::Isometry3d T_origin_world_ = Eigen::Isometry3d::Identity();
  std::uint64_t segment_begin_ = 0;  // first scan of the segment of the newest
  std::uint64_t step_;               // scans from one image to the next
  std::vector<View> views_;
  std::uint64_t images_ = 0;  // number of the newest
  // By phase: scans to the references before and after.
  std::vector<std::vector<int>> before_, after_;
  std::vector<Record> records_;
  RangeImage::Scratch image_scratch_;
  detail::Sights sights_;
  std::vector<std::uint32_t> touched_;  // supervoxels of which a reference saw something
  std::vector<Verdict> verdicts_;       // by supervoxel
  // By position in InstanceSamples::met.
  std::vector<Verdict> groups_of_points_;
  std::vector<std::uint8_t> moved_;
  std::vector<EvidenceVerdict::GroundPoint> moved_ground_;
  std::vector<std::uint32_t> free_;
  std::vector<std::uint32_t> predecessors_;
  InstanceSamples ground_samples_;
  // Ground points that are tested, in runs that share a voxel.
  std::vector<TestedBlock> tested_blocks_;
  std::size_t tested_ = 0;                   // runs
  PointBuffer tested_points_;                // their first points
  std::vector<std::uint32_t> one_instance_;  // zeros
  std::vector<std::uint8_t> ground_free_;    // by sample, references that saw it so
  std::vector<std::uint8_t> ground_hit_;
};

}  // namespace dynains
