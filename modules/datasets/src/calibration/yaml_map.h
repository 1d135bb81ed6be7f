#pragma once

// YAML of calibrations, with errors that name file, line, key and what was expected. Private to the
// module.

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "etalon/core/camera_model.h"
#include "etalon/core/se3.h"

namespace etalon {

/** A map of keys. What is missing or of another kind than expected is a DataError. */
class YamlMap {
 public:
  /** The file as a whole. OpenCV's form, which starts with `%YAML:1.0`, is accepted. */
  explicit YamlMap(const std::string& path);

  /** The map below `key`. */
  YamlMap below(const std::string& key, const std::string& expected) const;

  const std::string& path() const { return path_; }
  bool has(const std::string& key) const { return root_[key].IsDefined(); }
  YAML::Node node(const std::string& key, const std::string& expected) const;
  double number(const std::string& key, const std::string& expected) const;
  std::string word(const std::string& key, const std::string& expected) const;
  /** Of a list, or of the rows of a matrix one after the other. */
  std::vector<double> numbers(const YAML::Node& list, const std::string& key,
                              const std::string& expected) const;
  std::vector<double> numbers(const std::string& key, size_t count,
                              const std::string& expected) const;
  /** A 4x4 transform: 16 numbers in rows or in one list, which may lie below `data`. */
  SE3 transform(const std::string& key, const std::string& expected,
                std::vector<std::string>* warnings) const;

  [[noreturn]] void fail(const YAML::Node& where, const std::string& message) const;

 private:
  YamlMap(std::string path, std::string prefix, const YAML::Node& root);
  double parse(const YAML::Node& scalar, const std::string& key, const std::string& expected) const;

  std::string path_;
  std::string prefix_;  ///< of the keys in messages: "cam0." or nothing
  YAML::Node root_;
};

/**
 * `camera_model`, `distortion_model`, `resolution`, `intrinsics` and the distortion's coefficients
 * under the key that is given.
 */
CameraModel readCameraModel(const YamlMap& yaml, const std::string& coefficients_key);

/**
 * The rotation nearest to R. Rounding in the printed digits is repaired, with a warning from 1e-4
 * on; DataError if R^T R is off the identity by more than 0.01 or if det R < 0.
 */
Eigen::Matrix3d checkedRotation(const Eigen::Matrix3d& R, const std::string& file, int line,
                                const std::string& what, std::vector<std::string>* warnings);

}  // namespace etalon
