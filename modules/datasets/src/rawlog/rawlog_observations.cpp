#include "etalon/datasets/rawlog_observations.h"

#include <mrpt/obs/CObservationIMU.h>
#include <mrpt/obs/CObservationStereoImages.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "etalon/core/errors.h"
#include "rawlog/guarded_archive.h"

namespace etalon {

/** MRPT's exceptions carry a banner and a stack trace around their message, and in it bytes of the
 * file as they are. */
static std::string messageOf(const std::exception& e) {
  std::string text = e.what();
  const std::string key = "Message:";
  const size_t at = text.find(key);
  if (at != std::string::npos) text.erase(0, text.find_first_not_of(' ', at + key.size()));
  constexpr size_t kLongest = 160;
  text = text.substr(0, std::min(text.find('\n'), kLongest));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

/** Whether a byte that MRPT read into `flag` is none of a bool's; to look at it as one is undefined. */
static bool isBroken(const bool& flag) {
  std::uint8_t byte = 0;
  std::memcpy(&byte, &flag, sizeof flag);
  return byte > 1;
}

static bool hasBrokenFlags(const mrpt::obs::CObservation& observation) {
  if (const auto* imu = dynamic_cast<const mrpt::obs::CObservationIMU*>(&observation))
    return std::any_of(imu->dataIsPresent.begin(), imu->dataIsPresent.end(), isBroken);
  if (const auto* stereo = dynamic_cast<const mrpt::obs::CObservationStereoImages*>(&observation))
    return isBroken(stereo->hasImageRight) || isBroken(stereo->hasImageDisparity);
  return false;
}

RawlogObservations::RawlogObservations(const std::string& path)
    : path_(path), archive_(std::make_unique<GuardedArchive>(path)) {}

RawlogObservations::~RawlogObservations() = default;

mrpt::obs::CObservation::Ptr RawlogObservations::next() {
  const auto checked = [this](mrpt::obs::CObservation::Ptr observation) {
    if (hasBrokenFlags(*observation))
      throw DataError(path_, 0,
                      where() + ": expected flags of 0 or 1, found others; is the log damaged?");
    return observation;
  };
  for (;;) {
    while (frame_ && in_frame_ < frame_->size())
      if (auto observation = frame_->getObservationByIndex(in_frame_++))
        return checked(std::move(observation));
    frame_.reset();
    const auto object = nextObject();
    if (!object) return nullptr;
    if (auto observation = std::dynamic_pointer_cast<mrpt::obs::CObservation>(object))
      return checked(std::move(observation));
    frame_ = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object);
    in_frame_ = 0;
  }
}

mrpt::serialization::CSerializable::Ptr RawlogObservations::nextObject() {
  archive_->startObject();
  ++objects_;
  std::string reason;
  try {
    return archive_->ReadObject();
  } catch (const std::exception& e) {
    if (archive_->bytesOfObject() == 0) {
      --objects_;
      return nullptr;
    }
    reason = archive_->refusal().empty() ? messageOf(e) : archive_->refusal();
  }
  throw DataError(path_, 0,
                  where() + " cannot be read after " + std::to_string(archive_->bytesOfObject()) +
                      " bytes; expected an MRPT rawlog, is it truncated? (" + reason + ")");
}

}  // namespace etalon
