#pragma once

#include <map>
#include <string>
#include <vector>

#include "etalon/core/ini_file.h"
#include "etalon/core/parameters.h"
#include "etalon/imu/bias_prediction.h"

namespace etalon {

/** Section [device]: whose file this is. Nothing is computed from it. */
struct DeviceOptions {
  std::string name;
  int flights = 0;
  std::string noise_from;

  void declare(ParameterSet& parameters);
};

/** Section [flights] of a device file, which is no part of a run. */
constexpr const char* kFlightsSection = "flights";

/**
 * What is known of a device: a configuration of its noise and of the priors of its biases, with the
 * flights that the priors are from. The priors follow the flights (predictBias()); all other keys
 * stay as they are. An INI file to be used after that of a run.
 */
class DeviceFile {
 public:
  explicit DeviceFile(const std::string& name = "");
  /** @throws ConfigError with file, line and what was expected */
  static DeviceFile fromIni(const IniFile& ini);

  const std::map<std::string, FlightBias>& flights() const { return flights_; }

  /**
   * Adds a flight, and returns the names of those that it replaces: a recording, or a part of one,
   * counts once. Two flights are the same if their times overlap, where stamps are dates (isDate());
   * elsewhere if their names are the same, but for upper and lower case.
   */
  std::vector<std::string> put(const std::string& recording, const FlightBias& flight);
  /** @throws ConfigError if there is no such flight, naming the nearest */
  void remove(const std::string& recording);
  /** Any other key. */
  void set(const std::string& section, const std::string& key, const std::string& value);
  void unset(const std::string& section, const std::string& key);

  BiasPrediction gyro() const;
  BiasPrediction accel() const;

  /** The file, with what its numbers are worth as comments. Comments that it was read with are
   * lost. */
  std::string toIni() const;

 private:
  std::vector<SensorBias> sensors(SensorBias FlightBias::*sensor) const;
  std::string priorsText() const;
  std::string driftText() const;

  std::string name_;
  std::map<std::string, FlightBias> flights_;
  IniFile others_;  ///< what is neither [flights] nor computed from them
};

/** Reads [flights]. @throws ConfigError */
std::map<std::string, FlightBias> readFlights(const IniFile& ini);

/** "b_g -0.00210 0.0209 0.0759 (+- 0.0001) rad/s, b_a ... m/s^2": the mean with the largest
 * standard error of an axis. */
std::string describe(const FlightBias& flight);

/** The flight put into the file `path`, which is made if it is not there. Either all of it is
 * written or the file stays as it was; two processes that do it at a time wait for each other. @throws ConfigError, DataError
 * @return what was done, as a sentence */
std::string updateDeviceFile(const std::string& path, const std::string& recording,
                             const FlightBias& flight);

}  // namespace etalon
