#include "trial/trial_cut.h"

#include <algorithm>
#include <utility>

#include "etalon/frontend/image_content.h"

namespace etalon {

/** What a source has told, events included. */
struct TrialCut::Held {
  std::string name, kind;
  StereoInertialCalibration calibration;
  GroundTruth ground_truth;
  std::vector<TimeNs> image_stamps;
  std::vector<SensorEvent> events;
  ReadStatistics statistics;
};

/** Delivers what is held; images share their pixels with it. */
class TrialCut::HeldSource : public SensorSource {
 public:
  explicit HeldSource(std::shared_ptr<const Held> held) : held_(std::move(held)) {}

  const std::string& name() const override { return held_->name; }
  std::string kind() const override { return held_->kind; }
  const StereoInertialCalibration& calibration() const override { return held_->calibration; }
  const GroundTruth& groundTruth() const override { return held_->ground_truth; }
  const std::vector<TimeNs>& imageStamps() const override { return held_->image_stamps; }
  const ReadStatistics& statistics() const override { return held_->statistics; }
  std::optional<SensorEvent> next() override {
    if (next_ == held_->events.size()) return std::nullopt;
    return held_->events[next_++];
  }

 private:
  std::shared_ptr<const Held> held_;
  size_t next_ = 0;
};

namespace {

double bytesOf(const SensorEvent& event) {
  const auto* frame = std::get_if<StereoFrame>(&event);
  return frame ? static_cast<double>(frame->left.total() + frame->right.total()) : 0.0;
}

bool same(const SensorEvent& a, const SensorEvent& b) {
  if (a.index() != b.index() || stampOf(a) != stampOf(b)) return false;
  if (const auto* sample = std::get_if<ImuSample>(&a)) {
    const auto& other = std::get<ImuSample>(b);
    return sample->gyro == other.gyro && sample->accel == other.accel;
  }
  const auto &frame = std::get<StereoFrame>(a), &other = std::get<StereoFrame>(b);
  return samePixels(frame.left, other.left) && samePixels(frame.right, other.right);
}

bool same(const StereoInertialCalibration& a, const StereoInertialCalibration& b) {
  for (size_t c = 0; c < 2; ++c)
    if (a.cameras[c].model != b.cameras[c].model ||
        a.cameras[c].T_BC.matrix() != b.cameras[c].T_BC.matrix())
      return false;
  return true;
}

}  // namespace

TrialCut::TrialCut(const std::string& source, double from_s, double seconds, double most_bytes,
                   const std::string& ground_truth)
    : source_(source) {
  options_.from_s = from_s;
  options_.ground_truth = ground_truth;
  if (seconds > 0.0) options_.to_s = from_s + seconds;
  const std::unique_ptr<SensorSource> opened = openSource(source_, options_);
  auto held = std::make_shared<Held>();
  double bytes = 0.0;
  while (auto event = opened->next()) {
    bytes += bytesOf(*event);
    if (bytes > most_bytes) return;
    held->events.push_back(*std::move(event));
  }
  held->name = opened->name();
  held->kind = opened->kind();
  held->calibration = opened->calibration();
  held->ground_truth = opened->groundTruth();
  held->image_stamps = opened->imageStamps();
  held->statistics = opened->statistics();
  held_ = std::move(held);
}

std::unique_ptr<SensorSource> TrialCut::open() const {
  if (held_) return std::make_unique<HeldSource>(held_);
  return openSource(source_, options_);
}

FaultyCut faultyCut(const TrialCut& cut, const FaultScenario& scenario, int seed) {
  FaultyCut faulty;
  faulty.source = withFaults(cut.open(), scenario, cut.fromS(), static_cast<std::uint64_t>(seed));
  const std::unique_ptr<SensorSource> plain = cut.open();
  const bool same_rig = same(plain->calibration(), faulty.source->calibration());
  for (;;) {
    const auto event = plain->next();
    faulty.first = faulty.source->next();
    if (!event && !faulty.first) return faulty;
    if (!same_rig || !event || !faulty.first || !same(*event, *faulty.first)) {
      faulty.changed_at = stampOf(faulty.first ? *faulty.first : *event);
      return faulty;
    }
    ++faulty.same;
  }
}

}  // namespace etalon
