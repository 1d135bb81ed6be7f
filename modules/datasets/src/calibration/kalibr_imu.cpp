#include "calibration/kalibr_imu.h"

#include "calibration/sensor_yaml.h"
#include "calibration/yaml_map.h"

namespace etalon {

KalibrImu readKalibrImu(const std::string& path) {
  const YamlMap file(path);
  const YamlMap yaml = file.has("imu0") ? file.below("imu0", "an IMU of Kalibr's imu.yaml") : file;
  KalibrImu imu;
  imu.noise = readNoiseDensities(yaml);
  imu.rate_hz = readRate(yaml, "update_rate");
  if (yaml.has("rostopic")) imu.topic = yaml.word("rostopic", "a topic");
  if (yaml.has("model") && yaml.word("model", "a model of an IMU") != "calibrated")
    imu.warnings.push_back(path + ": the model '" + yaml.word("model", "") +
                           "' of the IMU is not used; its samples are taken as they are");
  return imu;
}

}  // namespace etalon
