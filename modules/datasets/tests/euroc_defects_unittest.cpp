#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "euroc_source_test.h"

namespace etalon::testing {
namespace {

using ::testing::HasSubstr;

/** One way to spoil a recording, and what the error must say. */
struct Defect {
  const char* name;
  const char* file;
  const char* from;  ///< text to replace, or null to remove the file
  const char* to;
  std::vector<std::string> expected;
};

class EurocDefects : public EurocSource, public ::testing::WithParamInterface<Defect> {};

TEST_P(EurocDefects, GiveAnErrorThatNamesFileLineAndExpectation) {
  const Defect& defect = GetParam();
  if (defect.from)
    replaceInFile(mav0(defect.file), defect.from, defect.to);
  else
    fs::remove_all(mav0(defect.file));
  const std::string error = openingError();
  ASSERT_FALSE(error.empty());
  EXPECT_THAT(error, HasSubstr(folder.path()));
  for (const std::string& part : defect.expected) EXPECT_THAT(error, HasSubstr(part));
}

const Defect kDefects[] = {
    {"MissingCamera", "cam1", nullptr, "", {"'cam1'", "expected a EuRoC"}},
    {"MissingImageList", "cam1/data.csv", nullptr, "", {"cam1/data.csv: ", "2 columns"}},
    {"MissingCameraYaml", "cam0/sensor.yaml", nullptr, "", {"cam0/sensor.yaml: ", "calibration"}},
    {"MissingImuData", "imu0/data.csv", nullptr, "", {"imu0/data.csv: ", "7 columns"}},
    {"MissingImuYaml", "imu0/sensor.yaml", nullptr, "", {"imu0/sensor.yaml: "}},
    {"ImageColumns",
     "cam0/data.csv",
     ".png\n",
     ".png,3\n",
     {"cam0/data.csv:2: ", "expected 2 columns", "found 3"}},
    {"ImuColumns", "imu0/data.csv", ",0.2,", ",", {"imu0/data.csv:2: ", "expected 7", "found 6"}},
    {"ImuWord", "imu0/data.csv", ",0.2,", ",0.2x,", {"imu0/data.csv:2: ", "column 6", "'0.2x'"}},
    {"StampNotWhole",
     "cam0/data.csv",
     "1403636584763555584,",
     "1403636584.763555584,",
     {"cam0/data.csv:2: ", "whole nanoseconds"}},
    {"StampOfACenturyAhead",
     "imu0/data.csv",
     "14036365",
     "54036365",
     {"imu0/data.csv:2: ", "whole nanoseconds from 0 to 4000000000000000000"}},
    {"DuplicateStamp",
     "cam0/data.csv",
     "1403636584813555591,",
     "1403636584763555584,",
     {"cam0/data.csv:3: ", "strictly increasing", "duplicate"}},
    {"StampsBackwards",
     "cam1/data.csv",
     "1403636584813555591,",
     "1403636584713555591,",
     {"cam1/data.csv:3: ", "strictly increasing"}},
    {"NoFileName",
     "cam1/data.csv",
     ",1403636584763555584.png",
     ",",
     {"cam1/data.csv:2: ", "file name"}},
    {"GroundTruthColumns",
     "state_groundtruth_estimate0/data.csv",
     ",0.5,",
     ",",
     {"state_groundtruth_estimate0/data.csv:2: ", "8 or 17 columns", "found 16"}},
    {"GroundTruthQuaternion",
     "state_groundtruth_estimate0/data.csv",
     ",1.5,1.5,0.",
     ",1.5,1.5,7.",
     {"state_groundtruth_estimate0/data.csv:2: ", "unit quaternion"}},
    {"NotYaml",
     "cam0/sensor.yaml",
     "resolution: [64, 48]",
     "resolution: [64, 48",
     {"cam0/sensor.yaml:", "expected YAML"}},
    {"MissingIntrinsics",
     "cam0/sensor.yaml",
     "intrinsics:",
     "intrinsic:",
     {"cam0/sensor.yaml: ", "'intrinsics' is missing", "[fu, fv, cu, cv]"}},
    {"MissingExtrinsics", "cam1/sensor.yaml", "T_BS:", "T_SB:", {"cam1/sensor.yaml: ", "'T_BS'"}},
    {"MissingNoise",
     "imu0/sensor.yaml",
     "gyroscope_random_walk",
     "gyro_walk",
     {"imu0/sensor.yaml: ", "'gyroscope_random_walk' is missing", "rad/s^2/sqrt(Hz)"}},
    {"NegativeNoise", "imu0/sensor.yaml", "density: 2", "density: -2", {"imu0/sensor.yaml:9: "}},
    {"IntrinsicsCount",
     "cam0/sensor.yaml",
     "45.5, 45.25,",
     "45.5,",
     {"cam0/sensor.yaml:14: ", "found 3 numbers"}},
    {"IntrinsicsNaN",
     "cam0/sensor.yaml",
     "45.5, 45.25,",
     ".nan, 45.25,",
     {"cam0/sensor.yaml:14: ", "'.nan'"}},
    {"UnknownDistortion",
     "cam0/sensor.yaml",
     "radial-tangential",
     "fov",
     {"cam0/sensor.yaml:15: ", "'fov' is not supported", "'radial-tangential'", "'equidistant'"}},
    {"UnknownCamera",
     "cam0/sensor.yaml",
     "camera_model: pinhole",
     "camera_model: omni",
     {"cam0/sensor.yaml:13: ", "'omni' is not supported", "'pinhole'"}},
    {"NegativeFocalLength",
     "cam0/sensor.yaml",
     "45.5, 45.25,",
     "-45.5, 45.25,",
     {"cam0/sensor.yaml:14: ", "positive focal lengths", "[fu, fv, cu, cv]"}},
    {"FourthRadial",
     "cam0/sensor.yaml",
     "1.7e-05]",
     "1.7e-05, 0.1, 0.1]",
     {"cam0/sensor.yaml:16: ", "[k1, k2, p1, p2]", "found 6 numbers"}},
    {"ExtrinsicsCount",
     "cam0/sensor.yaml",
     "0.0, 0.0, 0.0, 1.0]",
     "0.0, 0.0, 1.0]",
     {"cam0/sensor.yaml:7: ", "found 15 numbers"}},
    {"NoRotation",
     "cam0/sensor.yaml",
     "[0.0, -1.0,",
     "[0.1, -1.0,",
     {"cam0/sensor.yaml:7: ", "is no rotation", "determinant +1"}},
    {"Mirrored",
     "cam0/sensor.yaml",
     "0.0, 0.0, 1.0, 0.01",
     "0.0, 0.0, -1.0, 0.01",
     {"cam0/sensor.yaml:7: ", "is no rotation"}},
};

INSTANTIATE_TEST_SUITE_P(, EurocDefects, ::testing::ValuesIn(kDefects),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace etalon::testing
