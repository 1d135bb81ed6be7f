#include "sensor_yaml.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/so3.h"

namespace etalon {

namespace {

int lineOf(const YAML::Mark& mark) { return mark.is_null() ? 0 : mark.line + 1; }

/** A YAML file whose nodes report errors with their line. */
class YamlFile {
 public:
  explicit YamlFile(std::string path) : path_(std::move(path)) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path_, error))
      throw DataError(path_, 0, "there is no such file; expected a sensor's calibration");
    std::ifstream in(path_);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) throw DataError(path_, 0, "cannot be read; expected a sensor's calibration");
    try {
      root_ = YAML::Load(withoutOpenCvDirective(withoutByteOrderMark(text.str())));
    } catch (const YAML::Exception& e) {
      throw DataError(path_, lineOf(e.mark), "expected YAML: " + e.msg);
    }
    if (!root_.IsMap()) throw DataError(path_, 0, "expected a map of calibration keys");
  }

  const std::string& path() const { return path_; }
  bool has(const std::string& key) const { return root_[key].IsDefined(); }

  YAML::Node node(const std::string& key, const std::string& expected) const {
    const YAML::Node found = root_[key];
    if (!found.IsDefined() || found.IsNull())
      throw DataError(path_, 0, "the key '" + key + "' is missing; expected " + expected);
    return found;
  }

  double number(const std::string& key, const std::string& expected) const {
    return parse(node(key, expected), key, expected);
  }

  std::string word(const std::string& key, const std::string& expected) const {
    const YAML::Node found = node(key, expected);
    if (!found.IsScalar()) fail(found, "expected '" + key + "' to be " + expected);
    return found.Scalar();
  }

  std::vector<double> numbers(const YAML::Node& list, const std::string& key,
                              const std::string& expected) const {
    if (!list.IsSequence()) fail(list, "expected '" + key + "' to be " + expected);
    std::vector<double> values;
    for (const YAML::Node& element : list) {
      if (element.IsSequence()) {  // rows of a matrix
        for (const YAML::Node& inner : element) values.push_back(parse(inner, key, expected));
      } else {
        values.push_back(parse(element, key, expected));
      }
    }
    return values;
  }

  std::vector<double> numbers(const std::string& key, size_t count,
                              const std::string& expected) const {
    const YAML::Node list = node(key, expected);
    std::vector<double> values = numbers(list, key, expected);
    if (values.size() != count)
      fail(list, "expected '" + key + "' to be " + expected + ", found " +
                     std::to_string(values.size()) + " numbers");
    return values;
  }

  [[noreturn]] void fail(const YAML::Node& where, const std::string& message) const {
    throw DataError(path_, lineOf(where.Mark()), message);
  }

 private:
  /** `%YAML:1.0` is no YAML directive; an empty line in its place keeps the line numbers right. */
  static std::string withoutOpenCvDirective(std::string text) {
    if (text.rfind("\xEF\xBB\xBF", 0) == 0) text.erase(0, 3);
    if (text.rfind("%YAML:", 0) == 0) text.erase(0, text.find('\n'));
    return text;
  }

  double parse(const YAML::Node& scalar, const std::string& key,
               const std::string& expected) const {
    double value = 0;
    if (!scalar.IsScalar() || !YAML::convert<double>::decode(scalar, value) ||
        !std::isfinite(value))
      fail(scalar, "expected '" + key + "' to be " + expected + ", found '" +
                       (scalar.IsScalar() ? scalar.Scalar() : "no number") + "'");
    return value;
  }

  std::string path_;
  YAML::Node root_;
};

SE3 readPose(const YamlFile& yaml, std::vector<std::string>* warnings) {
  const std::string expected = "a 4x4 transform (16 numbers, row by row), sensor to body";
  YAML::Node list = yaml.node("T_BS", expected);
  const YAML::Node whole = list;
  if (whole.IsMap()) {
    if (!whole["data"].IsDefined())
      yaml.fail(whole, "the key 'data' of 'T_BS' is missing; expected " + expected);
    list.reset(whole["data"]);
  }
  const std::vector<double> v = yaml.numbers(list, "T_BS", expected);
  if (v.size() != 16)
    yaml.fail(list, "expected 'T_BS' to be " + expected + ", found " + std::to_string(v.size()) +
                        " numbers");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(v.data());
  if ((T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9)
    yaml.fail(list, "expected the last row of 'T_BS' to be 0 0 0 1");
  return {
      checkedRotation(T.topLeftCorner<3, 3>(), yaml.path(), lineOf(list.Mark()), "T_BS", warnings),
      T.topRightCorner<3, 1>()};
}

std::optional<double> readRate(const YamlFile& yaml) {
  if (!yaml.has("rate_hz")) return std::nullopt;
  const double rate = yaml.number("rate_hz", "a rate in Hz");
  if (rate <= 0) yaml.fail(yaml.node("rate_hz", ""), "expected 'rate_hz' to be positive");
  return rate;
}

std::string listOf(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return "[" + text + "]";
}

std::vector<double> readCoefficients(const YamlFile& yaml, const CameraKind& kind) {
  const size_t count = kind.coefficients.size();
  const std::string expected = std::to_string(count) + " numbers " + listOf(kind.coefficients);
  const YAML::Node list = yaml.node("distortion_coefficients", expected);
  std::vector<double> d = yaml.numbers(list, "distortion_coefficients", expected);
  if (d.size() == count + 1 && d.back() == 0.0) d.pop_back();  // k3 of OpenCV's five
  if (d.size() != count)
    yaml.fail(list, "expected 'distortion_coefficients' to be " + expected + ", found " +
                        std::to_string(d.size()) + " numbers");
  return d;
}

CameraModel readModel(const YamlFile& yaml) {
  const std::string model = yaml.word("camera_model", "the name of a camera model");
  const std::string distortion = yaml.word("distortion_model", "the name of a distortion model");
  const CameraKind* kind = findCameraKind(model, distortion);
  if (!kind) {
    const bool known = std::any_of(cameraKinds().begin(), cameraKinds().end(),
                                   [&](const CameraKind& k) { return k.camera_model == model; });
    yaml.fail(yaml.node(known ? "distortion_model" : "camera_model", ""),
              (known ? "the distortion model '" + distortion : "the camera model '" + model) +
                  "' is not supported; supported is " + describeCameraKinds());
  }
  const auto size = yaml.numbers("resolution", 2, "[width, height] in pixels");
  for (const double s : size)
    if (s < 1 || s > 1e5 || s != std::floor(s))
      yaml.fail(yaml.node("resolution", ""), "expected 'resolution' to be whole pixels");
  const std::vector<double> intrinsics =
      yaml.numbers("intrinsics", kind->intrinsics.size(), listOf(kind->intrinsics) + " in pixels");
  const std::vector<double> coefficients =
      distortion == "none" ? std::vector<double>() : readCoefficients(yaml, *kind);
  try {
    return CameraModel(model, distortion, static_cast<int>(size[0]), static_cast<int>(size[1]),
                       intrinsics, coefficients);
  } catch (const ConfigError& e) {
    yaml.fail(yaml.node("intrinsics", ""), e.what());
  }
}

double readDensity(const YamlFile& yaml, const std::string& key, const std::string& unit) {
  const std::string expected = "a continuous-time noise density in " + unit;
  const double value = yaml.number(key, expected);
  if (value < 0) yaml.fail(yaml.node(key, expected), "expected '" + key + "' not to be negative");
  return value;
}

}  // namespace

Eigen::Matrix3d checkedRotation(const Eigen::Matrix3d& R, const std::string& file, int line,
                                const std::string& what, std::vector<std::string>* warnings) {
  const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double determinant = R.determinant();
  std::ostringstream numbers;
  numbers << "R^T R differs from the identity by " << error << ", det R = " << determinant;
  // A typed-in digit that is wrong shows at once; digits lost in printing do not reach 1e-2.
  if (!(error < 1e-2) || determinant < 0)
    throw DataError(file, line,
                    "the rotation of '" + what + "' is no rotation (" + numbers.str() +
                        "); expected an orthogonal matrix of determinant +1");
  if (error > 1e-4 && warnings)
    warnings->push_back(file + ":" + std::to_string(line) + ": the rotation of '" + what +
                        "' is imprecise (" + numbers.str() + "); the nearest rotation is used");
  return nearestRotation(R);
}

CameraYaml readCameraYaml(const std::string& path) {
  const YamlFile yaml(path);
  CameraYaml camera;
  camera.model = readModel(yaml);
  camera.T_BS = readPose(yaml, &camera.warnings);
  camera.rate_hz = readRate(yaml);
  return camera;
}

ImuYaml readImuYaml(const std::string& path) {
  const YamlFile yaml(path);
  ImuYaml imu;
  imu.noise.gyro_noise_density = readDensity(yaml, "gyroscope_noise_density", "rad/s/sqrt(Hz)");
  imu.noise.gyro_random_walk = readDensity(yaml, "gyroscope_random_walk", "rad/s^2/sqrt(Hz)");
  imu.noise.accel_noise_density =
      readDensity(yaml, "accelerometer_noise_density", "m/s^2/sqrt(Hz)");
  imu.noise.accel_random_walk = readDensity(yaml, "accelerometer_random_walk", "m/s^3/sqrt(Hz)");
  imu.T_BS = readPose(yaml, &imu.warnings);
  imu.rate_hz = readRate(yaml);
  return imu;
}

SE3 readPoseYaml(const std::string& path) {
  const YamlFile yaml(path);
  return yaml.has("T_BS") ? readPose(yaml, nullptr) : SE3();
}

}  // namespace etalon
