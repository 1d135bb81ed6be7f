#include "etalon/simulation/faults/faulty_source.h"

#include <map>
#include <type_traits>
#include <utility>

#include "calibration_faults.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"
#include "fault_list.h"
#include "fault_timeline.h"
#include "image_faults.h"
#include "imu_faults.h"

namespace etalon {

namespace {

template <typename T, typename = void>
struct HasInterval : std::false_type {};
template <typename T>
struct HasInterval<T, std::void_t<decltype(T::during)>> : std::true_type {};

/** Whether the fault lasts at any instant of those from `read.first` to `read.second`, s. */
bool lasts(const Fault& fault, const std::pair<double, double>& read) {
  if (const auto* jump = std::get_if<faults::ClockJump>(&fault)) return jump->from_s <= read.second;
  return std::visit(
      [&read](const auto& f) {
        if constexpr (HasInterval<std::decay_t<decltype(f)>>::value)
          return f.during.from_s <= read.second && read.first < f.during.from_s + f.during.length_s;
        else
          return true;
      },
      fault);
}

/** Changes events on their way and brings them into the order of their new stamps. */
class FaultySource : public SensorSource {
 public:
  FaultySource(std::unique_ptr<SensorSource> source, const FaultScenario& scenario, TimeNs zero,
               std::uint64_t seed)
      : source_(std::move(source)),
        faults_(scenario.faults),
        texts_(scenario.fault_texts),
        seed_(seed),
        timeline_(faults_, source_->imageStamps(), zero, seed),
        calibration_(faultyCalibration(source_->calibration(), faults_, seed)),
        truth_(faultyTruth(source_->groundTruth(), faults_, timeline_, seed)) {
    if (timeline_.imageStamps().empty())
      throw ConfigError(source_->name() + ": expected faults that leave an image, found '" +
                        scenario.text + "'");
    zero_and_seed_ = format(" (times count from %.2f s after the first image; random seed %llu)",
                            secondsBetween(source_->imageStamps().front(), zero),
                            static_cast<unsigned long long>(seed));
  }

  const std::string& name() const override { return source_->name(); }
  std::string kind() const override { return source_->kind(); }
  const StereoInertialCalibration& calibration() const override { return calibration_; }
  const GroundTruth& groundTruth() const override { return truth_; }
  const std::vector<TimeNs>& imageStamps() const override { return timeline_.imageStamps(); }
  const ReadStatistics& statistics() const override {
    statistics_ = source_->statistics();
    statistics_.stereo_frames = frames_;
    statistics_.imu_samples = imu_samples_;
    std::vector<std::string> made, outside;
    for (size_t i = 0; i < faults_.size(); ++i)
      (!read_ || lasts(faults_[i], *read_) ? made : outside).push_back(texts_[i]);
    std::vector<std::string>& warnings = statistics_.warnings;
    if (!outside.empty())
      warnings.insert(warnings.begin(), name() + ": faults lie outside of what was read and were " +
                                            "not made: " + joined(outside) + zero_and_seed_);
    if (!made.empty())
      warnings.insert(warnings.begin(),
                      name() + ": faults were made: " + joined(made) + zero_and_seed_);
    return statistics_;
  }

  std::optional<SensorEvent> next() override {
    while (!ended_ && (waiting_.empty() || waiting_.begin()->first.first >= reached_)) read();
    if (waiting_.empty()) return std::nullopt;
    auto first = waiting_.extract(waiting_.begin());
    ++(first.key().second ? frames_ : imu_samples_);
    return std::move(first.mapped());
  }

 private:
  /** Takes the next event of the source. */
  void read() {
    std::optional<SensorEvent> event = source_->next();
    if (!event) {
      ended_ = true;
      return;
    }
    const double s = timeline_.seconds(stampOf(*event));
    read_ = {read_ ? read_->first : s, s};
    reached_ = timeline_.jumped(stampOf(*event)) - timeline_.mostEarly();
    std::visit([this](auto& e) { take(std::move(e)); }, *event);
  }

  void take(ImuSample&& sample) {
    const double s = timeline_.seconds(sample.t);
    if (anyFaultAt<faults::ImuGap>(faults_, s)) return;
    applyImuFaults(faults_, s, seed_, &sample);
    sample.t = timeline_.jumped(sample.t);
    waiting_.emplace(std::make_pair(sample.t, false), sample);
  }

  void take(StereoFrame&& frame) {
    const std::optional<size_t> index = timeline_.indexOf(frame.t);
    if (!index || !timeline_.stampOf(*index)) return;
    const double s = timeline_.seconds(frame.t);
    applyImageFaults(faults_, s, seed_, *index, &frame);
    if (last_) freeze(s, &frame);
    last_ = frame;
    frame.t = *timeline_.stampOf(*index);
    waiting_.emplace(std::make_pair(frame.t, true), std::move(frame));
  }

  /** Images of the pair before, of cameras that hang. */
  void freeze(double s, StereoFrame* frame) const {
    forEachFaultAt<faults::Frozen>(faults_, s, [&](const faults::Frozen& fault, size_t) {
      if (fault.lens != Lens::kRight) {
        frame->left = last_->left;
        frame->left_path = last_->left_path;
      }
      if (fault.lens != Lens::kLeft) {
        frame->right = last_->right;
        frame->right_path = last_->right_path;
      }
    });
  }

  std::unique_ptr<SensorSource> source_;
  std::vector<Fault> faults_;
  std::vector<std::string> texts_;  ///< of each fault, as written
  std::uint64_t seed_;
  FaultTimeline timeline_;
  StereoInertialCalibration calibration_;
  GroundTruth truth_;
  mutable ReadStatistics statistics_;
  std::string zero_and_seed_;                      ///< in words
  std::optional<std::pair<double, double>> read_;  ///< of what was read: first and last instant, s
  int frames_ = 0, imu_samples_ = 0;

  /** By stamp, at equal stamps the IMU first. */
  std::multimap<std::pair<TimeNs, bool>, SensorEvent> waiting_;
  TimeNs reached_ = 0;  ///< no event that is still to come has an earlier stamp
  bool ended_ = false;
  std::optional<StereoFrame> last_;  ///< as delivered, but for its stamp
};

}  // namespace

std::unique_ptr<SensorSource> withFaults(std::unique_ptr<SensorSource> source,
                                         const FaultScenario& scenario, double start_s,
                                         std::uint64_t seed) {
  const TimeNs zero = source->imageStamps().front() + durationNs(start_s);
  return std::make_unique<FaultySource>(std::move(source), scenario, zero, seed);
}

}  // namespace etalon
