#include "options/recording_option.h"

#include "support/checks.h"

namespace etalon::app {

void addRecordingOptions(CLI::App* command, RecordingOptions* options) {
  const char* const group = "Recordings that do not say all (docs/recordings.md)";
  const auto add = [&](const std::string& name, std::string* value, const std::string& what) {
    command->add_option(name, *value, what)->group(group);
  };
  add("--camchain", &options->camchain, "Kalibr's camchain.yaml, of a folder or a bag");
  add("--imu-yaml", &options->imu_yaml, "Kalibr's imu.yaml, of a folder or a bag");
  command
      ->add_option_function<double>(
          "--pair-tolerance", [options](double ms) { options->pair_tolerance_s = 1e-3 * ms; },
          "By how much the stamps of a stereo pair may differ, ms (default 0)")
      ->check(checkMilliseconds())
      ->group(group);
  add("--left-topic", &options->left_topic, "Of a bag: images of the left camera");
  add("--right-topic", &options->right_topic, "Of a bag: images of the right camera");
  add("--imu-topic", &options->imu_topic, "Of a bag: samples of the IMU");
  add("--truth-topic", &options->truth_topic,
      "Of a bag: poses of the IMU (geometry_msgs/PoseStamped)");
}

}  // namespace etalon::app
