#include "etalon/pipeline/device_file.h"

#include <strings.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/folder_lock.h"
#include "etalon/core/output_file.h"
#include "etalon/core/text.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/pipeline/pipeline_options.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr char kAxes[] = {'x', 'y', 'z'};
constexpr const char* kFlightForm =
    "first and last stamp in ns | b_g: mean x y z, standard error x y z, wander | b_a: the same";

std::string keyOfMean(const char* sensor, int axis, const char* unit) {
  return std::string(sensor) + "_bias_mean_" + kAxes[axis] + "_" + unit;
}

/** The keys of [priors] that follow the flights. */
bool isComputed(const std::string& section, const std::string& key) {
  if (section == "device") return key == "flights";
  return section == "priors" && (key.find("gyro_bias_") == 0 || key.find("accel_bias_") == 0);
}

void appendText(const SensorBias& bias, std::string* text) {
  *text += " |";
  for (int a = 0; a < 3; ++a) *text += format(" %.6g", bias.mean[a]);
  for (int a = 0; a < 3; ++a) *text += format(" %.3g", bias.sigma[a]);
  *text += format(" %.3g", bias.wander);
}

std::string toText(const FlightBias& flight) {
  std::string text = std::to_string(flight.first) + " " + std::to_string(flight.last);
  appendText(flight.gyro, &text);
  appendText(flight.accel, &text);
  return text;
}

bool read(std::istream& stream, SensorBias* bias) {
  char bar = 0;
  stream >> bar;
  for (int a = 0; a < 3; ++a) stream >> bias->mean[a];
  for (int a = 0; a < 3; ++a) stream >> bias->sigma[a];
  stream >> bias->wander;
  return stream && bar == '|' && bias->sigma.minCoeff() > 0.0 && bias->wander >= 0.0 &&
         bias->mean.allFinite() && bias->sigma.allFinite();
}

FlightBias flightFromText(const std::string& recording, const IniFile::Value& value) {
  FlightBias flight;
  std::istringstream stream(value.text);
  stream.imbue(std::locale::classic());
  stream >> flight.first >> flight.last;
  std::string rest;
  if (!stream || !isStamp(flight.first) || !isStamp(flight.last) || flight.first > flight.last ||
      !read(stream, &flight.gyro) || !read(stream, &flight.accel) || stream >> rest)
    throw ConfigError(value.origin + ": [" + kFlightsSection + "] " + recording + " = '" +
                      value.text + "': expected " + kFlightForm);
  return flight;
}

/** Whether an INI file takes both for one key: case does not count there. */
bool isOneKey(const std::string& a, const std::string& b) {
  return strcasecmp(a.c_str(), b.c_str()) == 0;
}

bool same(const std::string& a_name, const FlightBias& a, const std::string& b_name,
          const FlightBias& b) {
  if (isDate(a.first) && isDate(b.first)) return a.first <= b.last && b.first <= a.last;
  return isOneKey(a_name, b_name);
}

/** A name that may be a key. */
std::string asKey(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-' && c != '.') c = '_';
  return name.empty() ? "flight" : name;
}

std::string predictionLine(const char* symbol, const BiasPrediction& p, const char* unit,
                           size_t flights) {
  std::string text = format("; %s, %s, an axis: within a flight +- %.2g, ", symbol, unit, p.wander);
  if (flights > 1)
    text += format("between flights %.2g (known to +- %.0f %%; t of 4 degrees of freedom), ",
                   p.spread, 100.0 * p.spread_sigma / p.spread);
  else
    return text + "between flights unknown: as wide as without this file\n";
  return text + format("so the next one +- %.2g\n", p.sigma);
}

std::string vectorText(const Vector3d& v, const char* number) {
  std::string text;
  for (int a = 0; a < 3; ++a) text += (a > 0 ? " " : "") + format(number, v[a]);
  return text;
}

std::string driftLine(const char* symbol, const char* unit, const std::optional<BiasDrift>& drift) {
  if (!drift) return "";
  const bool seen = (drift->per_day.cwiseAbs().array() > 2.0 * drift->sigma.array()).any();
  return format("; drift of %s over %.0f days, %s a day: %s +- %s%s\n", symbol, drift->days, unit,
                vectorText(drift->per_day, "%.1e").c_str(),
                vectorText(drift->sigma, "%.0e").c_str(), seen ? "" : " (none seen)");
}

}  // namespace

void DeviceOptions::declare(ParameterSet& parameters) {
  parameters.add("name", &name,
                 "Name of the device whose file this is (etalon calibrate-device); for people.");
  parameters.add("flights", &flights, {0, 1000000},
                 "Flights that the priors of its biases are from.");
  parameters.add("noise_from", &noise_from, "What its noise is from, and how well it is known.");
}

std::map<std::string, FlightBias> readFlights(const IniFile& ini) {
  std::map<std::string, FlightBias> flights;
  for (const auto& [recording, value] : ini.section(kFlightsSection))
    flights[recording] = flightFromText(recording, value);
  return flights;
}

std::string describe(const FlightBias& flight) {
  return format("b_g %s (+- %.2g) rad/s, b_a %s (+- %.2g) m/s^2",
                vectorText(flight.gyro.mean, "%.5f").c_str(), flight.gyro.sigma.maxCoeff(),
                vectorText(flight.accel.mean, "%.4f").c_str(), flight.accel.sigma.maxCoeff());
}

DeviceFile::DeviceFile(const std::string& name) : name_(name) {
  if (!name.empty()) others_.set("device", "name", name, "the device's name");
}

DeviceFile DeviceFile::fromIni(const IniFile& ini) {
  const std::vector<std::string> sections = ini.sections();
  if (std::find(sections.begin(), sections.end(), "device") == sections.end())
    throw ConfigError(ini.name() + ": is no device file: expected a section [device]");
  PipelineOptions checked;
  for (const ParameterSet& section : checked.sections()) section.read(ini);
  DeviceFile file;
  file.flights_ = readFlights(ini);
  for (const std::string& section : sections) {
    if (section == kFlightsSection) continue;
    for (const auto& [key, value] : ini.section(section))
      if (!isComputed(section, key)) file.others_.set(section, key, value.text, value.origin);
  }
  const auto name = ini.section("device").find("name");
  if (name != ini.section("device").end()) file.name_ = name->second.text;
  return file;
}

std::vector<std::string> DeviceFile::put(const std::string& recording, const FlightBias& flight) {
  std::string key = asKey(recording);
  std::vector<std::string> replaced;
  for (auto known = flights_.begin(); known != flights_.end();) {
    if (same(known->first, known->second, key, flight)) {
      replaced.push_back(known->first);
      known = flights_.erase(known);
    } else {
      ++known;
    }
  }
  const std::string name = key;
  const auto is_taken = [&key](const auto& known) { return isOneKey(known.first, key); };
  for (int i = 2; std::any_of(flights_.begin(), flights_.end(), is_taken); ++i)
    key = name + "-" + std::to_string(i);
  // As it will be read, so that what follows from it does not depend on whether it was written.
  flights_[key] = flightFromText(key, {toText(flight), recording});
  return replaced;
}

void DeviceFile::remove(const std::string& recording) {
  if (flights_.erase(recording) > 0) return;
  std::vector<std::string> known;
  for (const auto& [name, flight] : flights_) known.push_back(name);
  const std::string nearest = nearestWord(recording, known);
  throw ConfigError(
      "the device file has no flight '" + recording + "'" +
      (nearest.empty() ? "; it has " + joined(known) : "; did you mean '" + nearest + "'?"));
}

void DeviceFile::unset(const std::string& section, const std::string& key) {
  IniFile rest;
  for (const std::string& name : others_.sections())
    for (const auto& [other, value] : others_.section(name))
      if (name != section || other != key) rest.set(name, other, value.text, value.origin);
  others_ = std::move(rest);
}

void DeviceFile::set(const std::string& section, const std::string& key, const std::string& value) {
  others_.set(section, key, value, "device file");
}

std::vector<SensorBias> DeviceFile::sensors(SensorBias FlightBias::*sensor) const {
  std::vector<SensorBias> all;
  for (const auto& [name, flight] : flights_) all.push_back(flight.*sensor);
  return all;
}

BiasPrediction DeviceFile::gyro() const {
  return predictBias(sensors(&FlightBias::gyro), BiasPriors().sigma_gyro_rps);
}

BiasPrediction DeviceFile::accel() const {
  return predictBias(sensors(&FlightBias::accel), BiasPriors().sigma_accel_mps2);
}

std::string DeviceFile::driftText() const {
  std::vector<TimeNs> stamps;
  for (const auto& [name, flight] : flights_) stamps.push_back(flight.first);
  return driftLine("b_g", "rad/s", biasDrift(sensors(&FlightBias::gyro), stamps)) +
         driftLine("b_a", "m/s^2", biasDrift(sensors(&FlightBias::accel), stamps));
}

std::string DeviceFile::priorsText() const {
  std::string text = "\n[priors]\n";
  if (!flights_.empty()) {
    const BiasPrediction gyro = this->gyro(), accel = this->accel();
    text += predictionLine("b_g", gyro, "rad/s", flights_.size());
    text += predictionLine("b_a", accel, "m/s^2", flights_.size()) + driftText();
    for (int a = 0; a < 3; ++a)
      text += keyOfMean("gyro", a, "rps") + format(" = %.4g\n", gyro.mean[a]);
    const bool spread_known = flights_.size() > 1;
    if (spread_known) text += format("gyro_bias_sigma_rps = %.3g\n", gyro.sigma);
    for (int a = 0; a < 3; ++a)
      text += keyOfMean("accel", a, "mps2") + format(" = %.4g\n", accel.mean[a]);
    if (spread_known) text += format("accel_bias_sigma_mps2 = %.3g\n", accel.sigma);
  }
  for (const auto& [key, value] : others_.section("priors"))
    text += key + " = " + value.text + "\n";
  return text;
}

std::string DeviceFile::toIni() const {
  std::string text =
      "; What is known of a device, for all runs with it: -c RUN.ini -c THIS.ini. Written by\n"
      "; `etalon calibrate-device` and `etalon replay --update-device`; comments of others are "
      "lost.\n"
      "\n[device]\n";
  for (const auto& [key, value] : others_.section("device"))
    text += key + " = " + value.text + "\n";
  text += "flights = " + std::to_string(flights_.size()) + "\n" + priorsText();
  for (const std::string& section : others_.sections()) {
    if (section == "device" || section == "priors") continue;
    text += "\n[" + section + "]\n";
    for (const auto& [key, value] : others_.section(section))
      text += key + " = " + value.text + "\n";
  }
  text += std::string("\n[") + kFlightsSection + "]\n; Recording = " + kFlightForm + "\n";
  for (const auto& [name, flight] : flights_) text += name + " = " + toText(flight) + "\n";
  return text;
}

std::string updateDeviceFile(const std::string& path, const std::string& recording,
                             const FlightBias& flight) {
  // Another run may add its flight at the same time: each reads what the one before it wrote.
  std::error_code ignored;
  const auto file_there =
      std::filesystem::weakly_canonical(std::filesystem::absolute(path), ignored);
  const FolderTurn turn(file_there.parent_path().string());
  const bool there = std::filesystem::exists(path);
  DeviceFile file = there ? DeviceFile::fromIni(IniFile::fromFile(path)) : DeviceFile();
  const std::vector<std::string> replaced = file.put(recording, flight);
  writeFile(path, file.toIni());
  const size_t n = file.flights().size();
  return std::string(there ? "" : "new ") + "device file '" + path + "': the biases of " +
         recording + (replaced.empty() ? " were added" : " replace those of " + joined(replaced)) +
         "; it has " + std::to_string(n) + (n == 1 ? " flight" : " flights");
}

}  // namespace etalon
