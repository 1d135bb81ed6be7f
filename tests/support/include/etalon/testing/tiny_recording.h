#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "etalon/datasets/sensor_source.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon::testing {

constexpr TimeNs kFirstStamp = 1403636584763555584;  // not a multiple of MRPT's tick, as in EuRoC
constexpr int kFrames = 6;
constexpr int kWidth = 64, kHeight = 48;

/** Stamp of pair `i`: 20 Hz, with jitter below MRPT's tick. */
inline TimeNs frameStamp(int i) { return kFirstStamp + 50'000'000LL * i + 7 * i; }

/**
 * Writes a EuRoC folder: kFrames stereo pairs of 64x48 at 20 Hz, the IMU at 200 Hz from 100 ms
 * before the first pair to 100 ms after the last, ground truth (17 columns) at 100 Hz. All numbers
 * differ from each other.
 */
void writeTinyRecording(const std::filesystem::path& folder);

std::string readText(const std::filesystem::path& file);
void writeText(const std::filesystem::path& file, const std::string& text);
/** Replaces the first occurrence of `from`, which must be there. */
void replaceInFile(const std::filesystem::path& file, const std::string& from,
                   const std::string& to);
/** Replaces line `number` (from 1). */
void replaceLine(const std::filesystem::path& file, int number, const std::string& text);

std::vector<SensorEvent> readAll(SensorSource& source);
std::vector<StereoFrame> framesOf(const std::vector<SensorEvent>& events);
std::vector<ImuSample> imuOf(const std::vector<SensorEvent>& events);

/** What `action` throws as DataError, as text; empty if it throws nothing. */
std::string dataErrorOf(const std::function<void()>& action);

/** Whether two sources deliver the same, bit for bit: calibration, ground truth's stamps and
 * values, events, pixels. */
void expectSameRecording(SensorSource& a, SensorSource& b);

}  // namespace etalon::testing
