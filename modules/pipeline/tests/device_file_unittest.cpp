#include "etalon/pipeline/device_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <thread>

#include "etalon/core/errors.h"
#include "etalon/pipeline/pipeline_options.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr TimeNs kDate = 1'400'000'000 * kNanosecondsPerSecond;
constexpr TimeNs kMinute = 60 * kNanosecondsPerSecond;

/** A flight of a minute, whose b_a differs from that of others by `shift` about x. */
FlightBias flight(TimeNs first, double shift = 0.0) {
  FlightBias f;
  f.first = first;
  f.last = first + kMinute;
  f.gyro.mean << -0.002, 0.021, 0.076;
  f.gyro.sigma.setConstant(2e-5);
  f.gyro.wander = 2e-4;
  f.accel.mean << -0.02 + shift, 0.13, 0.07;
  f.accel.sigma << 0.002, 0.003, 0.0023456789;
  f.accel.wander = 0.015;
  return f;
}

IniFile parsed(const std::string& text) { return IniFile::fromText(text, "device.ini"); }

std::string errorOf(const std::string& text) {
  try {
    DeviceFile::fromIni(parsed(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "<nothing thrown>";
}

class DeviceFileTest : public ::testing::Test {
 protected:
  std::string content() const {
    std::ifstream stream(path_);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  const testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "device.ini";
};

TEST(DeviceFile, ComesBackAsItWasWritten) {
  DeviceFile file("left wing");
  file.set("imu_noise", "gyro_noise_factor", "2.5");
  file.set("priors", "slow_accel_mps2", "0.03");
  file.put("first", flight(kDate));
  file.put("second flight", flight(kDate + 10 * kMinute, 0.01));
  const std::string text = file.toIni();
  EXPECT_EQ(DeviceFile::fromIni(parsed(text)).toIni(), text);
  PipelineOptions options;
  for (const ParameterSet& section : options.sections()) section.read(parsed(text));
  EXPECT_EQ(options.device.name, "left wing");
  EXPECT_EQ(options.device.flights, 2);
  EXPECT_EQ(options.imu_noise.gyro_noise_factor, 2.5);
  EXPECT_EQ(options.window.priors.slow_accel.sigma_mps2, 0.03);
  EXPECT_NEAR(options.window.priors.mean.accel[0], -0.015, 1e-5);
  EXPECT_NEAR(options.window.priors.mean.gyro[2], 0.076, 1e-5);
  EXPECT_NEAR(options.window.priors.sigma_accel_mps2, file.accel().sigma, 1e-3);
  EXPECT_EQ(readFlights(parsed(text)).count("second_flight"), 1U);
}

TEST(DeviceFile, AFlightCountsOnce) {
  DeviceFile file("d");
  EXPECT_THAT(file.put("a", flight(kDate)), IsEmpty());
  EXPECT_THAT(file.put("b", flight(kDate + 10 * kMinute, 0.01)), IsEmpty());
  const std::string once = file.toIni();
  EXPECT_THAT(file.put("b", flight(kDate + 10 * kMinute, 0.01)), ElementsAre("b"));
  EXPECT_EQ(file.toIni(), once);
  // A part of a recording is the recording.
  EXPECT_THAT(file.put("part_of_a", flight(kDate + kMinute / 2)), ElementsAre("a"));
  EXPECT_EQ(file.flights().size(), 2U);
  // The same name at another time is another flight.
  EXPECT_THAT(file.put("b", flight(kDate + 20 * kMinute)), IsEmpty());
  EXPECT_EQ(file.flights().count("b-2"), 1U);
}

TEST(DeviceFile, NamesThatDifferInCaseAloneAreTwoKeys) {
  DeviceFile file("d");
  file.put("Flight1", flight(kDate));
  EXPECT_THAT(file.put("flight1", flight(kDate + 10 * kMinute)), IsEmpty());
  const auto flights = DeviceFile::fromIni(parsed(file.toIni())).flights();
  EXPECT_EQ(flights.count("Flight1") + flights.count("flight1-2"), 2U);
}

TEST(DeviceFile, WhereStampsAreNoDatesTheNameSaysWhichFlightItIs) {
  DeviceFile file("d");
  file.put("a", flight(0));
  EXPECT_THAT(file.put("b", flight(0)), IsEmpty());
  EXPECT_THAT(file.put("a", flight(5 * kMinute)), ElementsAre("a"));
  EXPECT_EQ(file.flights().size(), 2U);
}

TEST(DeviceFile, FlightsCanBeLeftOut) {
  DeviceFile file("d");
  file.put("MH_01", flight(kDate));
  const std::string one = file.toIni();
  file.put("MH_02", flight(kDate + 10 * kMinute, 0.03));
  file.remove("MH_02");
  EXPECT_EQ(file.toIni(), one);
  try {
    file.remove("MH_1");
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("did you mean 'MH_01'?"));
  }
}

TEST(DeviceFile, RefusesWithFileAndLine) {
  EXPECT_THAT(errorOf("[priors]\n"), HasSubstr("device.ini: is no device file"));
  EXPECT_THAT(errorOf("[device]\nnmae = x\n"), AllOf(HasSubstr("device.ini:2"), HasSubstr("name")));
  EXPECT_THAT(errorOf("[device]\n[imu_noise]\ngyro_noise_factor = x\n"), HasSubstr("device.ini:3"));
  for (const char* wrong :
       {"1 2", "2 1 | 0 0 0 1 1 1 0 | 0 0 0 1 1 1 0", "1 2 | 0 0 0 1 1 0 0 | 0 0 0 1 1 1 0",
        "1 2 | 0 0 0 1 1 1 0 | 0 0 0 1 1 1 0 7", "1 2 | 0 0 nan 1 1 1 0 | 0 0 0 1 1 1 0"})
    EXPECT_THAT(errorOf(std::string("[device]\n[flights]\na = ") + wrong + "\n"),
                AllOf(HasSubstr("device.ini:3: [flights] a = "), HasSubstr("expected first and")))
        << wrong;
}

TEST(DeviceFile, ARunReadsItAfterItsOwnConfiguration) {
  DeviceFile file("d");
  file.put("a", flight(kDate));
  IniFile ini = IniFile::fromText("[priors]\naccel_bias_mean_y_mps2 = 1\n", "run.ini");
  ini.add(parsed(file.toIni()));
  PipelineOptions options;
  for (const ParameterSet& section : options.sections()) section.read(ini);
  EXPECT_NEAR(options.window.priors.mean.accel[1], 0.13, 1e-6);
  EXPECT_EQ(ini.sectionOrigin("device"), "device.ini:4");
}

TEST_F(DeviceFileTest, IsMadeAndUpdatedAndStaysWhereItCannotBe) {
  EXPECT_THAT(updateDeviceFile(path_, "a", flight(kDate)),
              AllOf(HasSubstr("new device file"), HasSubstr("it has 1 flight")));
  EXPECT_THAT(updateDeviceFile(path_, "b", flight(kDate + 10 * kMinute, 0.01)),
              HasSubstr("b were added; it has 2 flights"));
  const std::string twice = content();
  EXPECT_THAT(updateDeviceFile(path_, "b", flight(kDate + 10 * kMinute, 0.01)),
              HasSubstr("replace those of b; it has 2 flights"));
  EXPECT_EQ(content(), twice);
  // Nothing is lost where a file cannot be understood.
  const std::string damaged = twice + "c = 1 2 3\n";
  std::ofstream(path_) << damaged;
  EXPECT_THROW(updateDeviceFile(path_, "d", flight(0)), ConfigError);
  EXPECT_EQ(content(), damaged);
  std::ofstream(path_, std::ios::trunc) << "[pipeline]\nkeyframes = 5\n";
  EXPECT_THROW(updateDeviceFile(path_, "d", flight(0)), ConfigError);
  EXPECT_EQ(content(), "[pipeline]\nkeyframes = 5\n");
}

TEST_F(DeviceFileTest, TwoAtATimeLoseNoFlight) {
  constexpr int kFlights = 20;
  const auto update = [this](const std::string& name, int part) {
    for (int i = 0; i < kFlights; ++i)
      updateDeviceFile(path_, name + std::to_string(i),
                       flight(kDate + (4 * i + 2 * part) * kMinute));
  };
  std::thread other(update, "b", 1);
  update("a", 0);
  other.join();
  EXPECT_EQ(DeviceFile::fromIni(IniFile::fromFile(path_)).flights().size(), 2U * kFlights);
}

TEST_F(DeviceFileTest, KeepsWhatIsNotItsOwn) {
  std::ofstream(path_) << "[device]\nname = d\nflights = 9\n[frontend]\nmax_features = 300\n[eta]\n"
                          "rounds = 3\n[priors]\nslow_accel_s = 2\naccel_bias_sigma_mps2 = 9\n";
  updateDeviceFile(path_, "a", flight(kDate));
  const IniFile ini = IniFile::fromFile(path_);
  EXPECT_EQ(ini.section("device").at("flights").text, "1");
  EXPECT_EQ(ini.section("frontend").at("max_features").text, "300");
  EXPECT_EQ(ini.section("eta").at("rounds").text, "3");
  EXPECT_EQ(ini.section("priors").at("slow_accel_s").text, "2");
  // One flight does not tell how far the next one is: the run's own prior stays.
  EXPECT_EQ(ini.section("priors").count("accel_bias_sigma_mps2"), 0U);
  updateDeviceFile(path_, "b", flight(kDate + 86'400'000'000'000));
  EXPECT_EQ(IniFile::fromFile(path_).section("priors").count("accel_bias_sigma_mps2"), 1U);
}

}  // namespace
}  // namespace etalon
