#pragma once

#include <array>
#include <filesystem>

#include "etalon/datasets/sensor_yaml_text.h"
#include "etalon/simulation/euroc_rig.h"
#include "fuzz_input.h"

namespace etalon::fuzz {

inline constexpr std::array<const char*, 7> kFiles = {
    "cam0/data.csv",    "cam1/data.csv",
    "imu0/data.csv",    "state_groundtruth_estimate0/data.csv",
    "cam0/sensor.yaml", "cam1/sensor.yaml",
    "imu0/sensor.yaml"};

inline std::string images() {
  return "#t,name\n1000000000,a.png\n1050000000,b.png\n1100000000,c.png\n";
}

inline std::string imu() {
  std::string text = "#t,w,f\n";
  for (int i = 0; i < 30; ++i)
    text += std::to_string(990000000 + 5000000 * i) + ",0.1,0.2,-0.1,9.7,0.2,-0.3\n";
  return text;
}

inline std::string groundTruth() {
  return "#t,p,q,v,b_g,b_a\n"
         "1000000000,1,2,3,1,0,0,0,0.1,0,0,0.01,0,0,0.1,0,0\n"
         "1100000000,1.1,2,3,1,0,0,0,0.1,0,0,0.01,0,0,0.1,0,0\n";
}

/** A EuRoC folder of three image pairs (which are not there) and 150 ms, all of its files whole. */
class Recording {
 public:
  Recording() {
    const StereoInertialCalibration rig = eurocCalibration();
    whole_ = {images(),
              images(),
              imu(),
              groundTruth(),
              cameraYaml(rig.cameras[0], "left"),
              cameraYaml(rig.cameras[1], "right"),
              imuYaml(rig.imu, "imu")};
    for (std::size_t i = 0; i < kFiles.size(); ++i) write(i, whole_[i]);
  }
  std::string path() const { return folder_ / ""; }
  void restore(std::size_t file) { write(file, whole_[file]); }
  void write(std::size_t file, const std::string& content) {
    const std::string path = folder_ / (std::string("mav0/") + kFiles[file]);
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    writeFile(path, content);
  }

 private:
  ScratchFolder folder_;
  std::array<std::string, kFiles.size()> whole_;
};

}  // namespace etalon::fuzz
