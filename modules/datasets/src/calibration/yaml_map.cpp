#include "calibration/yaml_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/so3.h"
#include "etalon/core/text.h"

namespace etalon {

namespace {

int lineOf(const YAML::Mark& mark) { return mark.is_null() ? 0 : mark.line + 1; }

/** `%YAML:1.0` is no YAML directive; an empty line in its place keeps the line numbers right. */
std::string withoutOpenCvDirective(std::string text) {
  if (text.rfind("%YAML:", 0) == 0) text.erase(0, text.find('\n'));
  return text;
}

std::string listOf(const std::vector<std::string>& names) { return "[" + joined(names) + "]"; }

}  // namespace

YamlMap::YamlMap(const std::string& path) : path_(path) {
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

YamlMap::YamlMap(std::string path, std::string prefix, const YAML::Node& root)
    : path_(std::move(path)), prefix_(std::move(prefix)), root_(root) {}

YamlMap YamlMap::below(const std::string& key, const std::string& expected) const {
  const YAML::Node found = node(key, expected);
  if (!found.IsMap()) fail(found, "expected '" + prefix_ + key + "' to be " + expected);
  return {path_, prefix_ + key + ".", found};
}

YAML::Node YamlMap::node(const std::string& key, const std::string& expected) const {
  const YAML::Node found = root_[key];
  if (!found.IsDefined() || found.IsNull())
    throw DataError(path_, prefix_.empty() ? 0 : lineOf(root_.Mark()),
                    "the key '" + prefix_ + key + "' is missing; expected " + expected);
  return found;
}

double YamlMap::number(const std::string& key, const std::string& expected) const {
  return parse(node(key, expected), key, expected);
}

std::string YamlMap::word(const std::string& key, const std::string& expected) const {
  const YAML::Node found = node(key, expected);
  if (!found.IsScalar()) fail(found, "expected '" + prefix_ + key + "' to be " + expected);
  return found.Scalar();
}

std::vector<double> YamlMap::numbers(const YAML::Node& list, const std::string& key,
                                     const std::string& expected) const {
  if (!list.IsSequence()) fail(list, "expected '" + prefix_ + key + "' to be " + expected);
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

std::vector<double> YamlMap::numbers(const std::string& key, size_t count,
                                     const std::string& expected) const {
  const YAML::Node list = node(key, expected);
  std::vector<double> values = numbers(list, key, expected);
  if (values.size() != count)
    fail(list, "expected '" + prefix_ + key + "' to be " + expected + ", found " +
                   std::to_string(values.size()) + " numbers");
  return values;
}

SE3 YamlMap::transform(const std::string& key, const std::string& expected,
                       std::vector<std::string>* warnings) const {
  YAML::Node list = node(key, expected);
  const YAML::Node whole = list;
  if (whole.IsMap()) {
    if (!whole["data"].IsDefined())
      fail(whole, "the key 'data' of '" + prefix_ + key + "' is missing; expected " + expected);
    list.reset(whole["data"]);
  }
  const std::vector<double> v = numbers(list, key, expected);
  if (v.size() != 16)
    fail(list, "expected '" + prefix_ + key + "' to be " + expected + ", found " +
                   std::to_string(v.size()) + " numbers");
  const Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(v.data());
  if ((T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9)
    fail(list, "expected the last row of '" + prefix_ + key + "' to be 0 0 0 1");
  return {
      checkedRotation(T.topLeftCorner<3, 3>(), path_, lineOf(list.Mark()), prefix_ + key, warnings),
      T.topRightCorner<3, 1>()};
}

void YamlMap::fail(const YAML::Node& where, const std::string& message) const {
  throw DataError(path_, lineOf(where.Mark()), message);
}

double YamlMap::parse(const YAML::Node& scalar, const std::string& key,
                      const std::string& expected) const {
  double value = 0;
  if (!scalar.IsScalar() || !YAML::convert<double>::decode(scalar, value) || !std::isfinite(value))
    fail(scalar, "expected '" + prefix_ + key + "' to be " + expected + ", found '" +
                     (scalar.IsScalar() ? scalar.Scalar() : "no number") + "'");
  return value;
}

namespace {

/** As many as the kind has; one more, OpenCV's k3, if it is not zero and radial-tangential. */
std::vector<double> readCoefficients(const YamlMap& yaml, const CameraKind& kind,
                                     const std::string& key) {
  const size_t count = kind.coefficients.size();
  const std::string expected = std::to_string(count) + " numbers " + listOf(kind.coefficients);
  const YAML::Node list = yaml.node(key, expected);
  std::vector<double> d = yaml.numbers(list, key, expected);
  if (d.size() == count + 1 && d.back() == 0.0) d.pop_back();
  if (d.size() == count + 1 && kind.distortion.front() == "radial-tangential") return d;
  if (d.size() != count)
    yaml.fail(list, "expected '" + key + "' to be " + expected + ", found " +
                        std::to_string(d.size()) + " numbers");
  return d;
}

}  // namespace

CameraModel readCameraModel(const YamlMap& yaml, const std::string& coefficients_key) {
  const std::string supported = "supported is " + describeCameraKinds();
  const std::string model = yaml.word("camera_model", "a camera model; " + supported);
  const std::string distortion = yaml.word("distortion_model", "a distortion model; " + supported);
  const CameraKind* kind = findCameraKind(model, distortion);
  if (!kind) {
    const auto& kinds = cameraKinds();
    const bool known = std::any_of(kinds.begin(), kinds.end(), [&model](const CameraKind& k) {
      return k.camera_model == model;
    });
    yaml.fail(yaml.node(known ? "distortion_model" : "camera_model", ""),
              (known ? "the distortion model '" + distortion : "the camera model '" + model) +
                  "' is not supported; " + supported);
  }
  const auto size = yaml.numbers("resolution", 2, "[width, height] in pixels");
  for (const double s : size)
    if (s < 1 || s > 1e5 || s != std::floor(s))
      yaml.fail(yaml.node("resolution", ""), "expected 'resolution' to be whole pixels");
  const std::vector<double> intrinsics =
      yaml.numbers("intrinsics", kind->intrinsics.size(), listOf(kind->intrinsics) + " in pixels");
  const std::vector<double> coefficients = distortion == "none"
                                               ? std::vector<double>()
                                               : readCoefficients(yaml, *kind, coefficients_key);
  const bool has_k3 = coefficients.size() > kind->coefficients.size();
  try {
    return CameraModel(model, has_k3 ? "radial-tangential-k3" : distortion,
                       static_cast<int>(size[0]), static_cast<int>(size[1]), intrinsics,
                       coefficients);
  } catch (const ConfigError& e) {
    yaml.fail(yaml.node("intrinsics", ""), e.what());
  }
}

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

}  // namespace etalon
