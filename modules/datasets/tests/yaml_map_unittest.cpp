// Calibrations in YAML: numbers, matrices and cameras, and errors that lead to the place.

#include "calibration/yaml_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/testing/temporary_folder.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using testing::dataErrorOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class YamlMapTest : public ::testing::Test {
 protected:
  YamlMap map(const std::string& text) const { return YamlMap(folder_.write("sensor.yaml", text)); }
  std::string errorOf(const std::string& text,
                      const std::function<void(const YamlMap&)>& read) const {
    return dataErrorOf([&] { read(map(text)); });
  }
  testing::TemporaryFolder folder_;
};

TEST_F(YamlMapTest, NumbersWordsAndWhatIsThere) {
  const YamlMap yaml = map("%YAML:1.0\nrate: 2.5e2\nname: cam0 # a remark\nempty:\n");
  EXPECT_EQ(yaml.number("rate", "a rate"), 250.0);
  EXPECT_EQ(yaml.word("name", "a name"), "cam0");
  EXPECT_TRUE(yaml.has("rate"));
  EXPECT_FALSE(yaml.has("raten"));
  EXPECT_THAT(errorOf("a: 1\n", [](const YamlMap& y) { y.number("rate_hz", "Hz"); }),
              AllOf(HasSubstr("sensor.yaml"), HasSubstr("the key 'rate_hz' is missing"),
                    HasSubstr("expected Hz")));
  EXPECT_THAT(errorOf("a:\n", [](const YamlMap& y) { y.number("a", "Hz"); }),
              HasSubstr("the key 'a' is missing"));  // without a value
}

TEST_F(YamlMapTest, WhatIsNoFiniteNumberIsShownWithItsLine) {
  for (const char* wrong : {"fast", ".nan", ".inf", "1,5", "[1]", "{b: 1}", "''"})
    EXPECT_THAT(errorOf("x: 1\n\nrate: " + std::string(wrong) + "\n",
                        [](const YamlMap& y) { y.number("rate", "Hz"); }),
                AllOf(HasSubstr("sensor.yaml:3: "), HasSubstr("expected 'rate' to be Hz")))
        << wrong;
  EXPECT_THAT(errorOf("name: [a, b]\n", [](const YamlMap& y) { y.word("name", "a word"); }),
              HasSubstr("sensor.yaml:1: expected 'name' to be a word"));
}

TEST_F(YamlMapTest, AMapBelowAKeyNamesWhereItIs) {
  const std::string text = "a: 1\ncam0:\n  rate: 20\n  deeper:\n    x: oops\n";
  EXPECT_EQ(map(text).below("cam0", "a camera").number("rate", "Hz"), 20.0);
  EXPECT_THAT(errorOf(text,
                      [](const YamlMap& y) {
                        y.below("cam0", "a camera").below("deeper", "more").number("x", "m");
                      }),
              AllOf(HasSubstr("sensor.yaml:5: "), HasSubstr("'cam0.deeper.x' to be m"),
                    HasSubstr("found 'oops'")));
  EXPECT_THAT(
      errorOf(text, [](const YamlMap& y) { y.below("cam0", "a camera").number("hz", "Hz"); }),
      HasSubstr("sensor.yaml:3: the key 'cam0.hz' is missing"));
  EXPECT_THAT(errorOf(text, [](const YamlMap& y) { y.below("a", "a camera"); }),
              HasSubstr("sensor.yaml:1: expected 'a' to be a camera"));
}

TEST_F(YamlMapTest, ListsAndMatricesAreReadRowByRow) {
  EXPECT_THAT(map("k: [1, 2.5, -3e1]\n").numbers("k", 3, "three"), ElementsAre(1.0, 2.5, -30.0));
  EXPECT_THAT(map("k: [[1, 2], [3, 4]]\n").numbers("k", 4, "four"),
              ElementsAre(1.0, 2.0, 3.0, 4.0));
  EXPECT_THAT(errorOf("k: [1, 2]\n", [](const YamlMap& y) { y.numbers("k", 3, "3 numbers"); }),
              HasSubstr("expected 'k' to be 3 numbers, found 2 numbers"));
  EXPECT_NE(errorOf("k: 7\n", [](const YamlMap& y) { y.numbers("k", 1, "one"); }), "");
  EXPECT_THAT(errorOf("k: [1,\n  2,\n  x]\n", [](const YamlMap& y) { y.numbers("k", 3, "three"); }),
              HasSubstr("sensor.yaml:3: "));
}

TEST_F(YamlMapTest, ATransformMayHaveRowsOrOneListOrData) {
  const std::string numbers = "0, -1, 0, 0.5, 1, 0, 0, -0.25, 0, 0, 1, 2, 0, 0, 0, 1";
  const std::string rows = "[[0, -1, 0, 0.5], [1, 0, 0, -0.25], [0, 0, 1, 2], [0, 0, 0, 1]]";
  for (const std::string& text : {"T: [" + numbers + "]\n", "T: " + rows + "\n",
                                  "T:\n  rows: 4\n  data: [" + numbers + "]\n"}) {
    std::vector<std::string> warnings;
    const SE3 T = map(text).transform("T", "a pose", &warnings);
    EXPECT_LT((T.R - expSO3({0.0, 0.0, M_PI / 2})).norm(), 1e-12);
    EXPECT_EQ(T.t, Eigen::Vector3d(0.5, -0.25, 2.0));
    EXPECT_TRUE(warnings.empty());
  }
  const auto transform = [](const YamlMap& y) { y.transform("T", "16 numbers", nullptr); };
  EXPECT_THAT(errorOf("T: [1, 2]\n", transform), HasSubstr("to be 16 numbers, found 2 numbers"));
  EXPECT_THAT(errorOf("T:\n  rows: 4\n", transform), HasSubstr("the key 'data' of 'T' is missing"));
  EXPECT_THAT(errorOf("T: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0.1,1]\n", transform),
              HasSubstr("the last row of 'T' to be 0 0 0 1"));
}

TEST_F(YamlMapTest, RotationsAreRepairedToldOrRefused) {
  const auto read = [](double error, std::vector<std::string>* warnings) {
    Eigen::Matrix3d R = expSO3({0.3, -0.2, 0.9});
    R.col(0) *= 1.0 + error;  // R^T R is off by twice that
    return checkedRotation(R, "rig.yaml", 4, "T_BS", warnings);
  };
  std::vector<std::string> warnings;
  EXPECT_LT((read(4e-5, &warnings) - expSO3({0.3, -0.2, 0.9})).norm(), 1e-4);
  EXPECT_TRUE(warnings.empty());
  const Eigen::Matrix3d R = read(1e-4, &warnings);
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("rig.yaml:4: the rotation of 'T_BS' is imprecise"));
  EXPECT_NO_THROW(read(1e-4, nullptr));
  EXPECT_THAT(dataErrorOf([&] { read(6e-3, &warnings); }),
              AllOf(HasSubstr("rig.yaml:4: "), HasSubstr("'T_BS' is no rotation")));
  EXPECT_THAT(dataErrorOf([&] {
                checkedRotation(-Eigen::Matrix3d::Identity(), "rig.yaml", 4, "T_BS", nullptr);
              }),
              HasSubstr("det R = -1"));
}

constexpr char kCamera[] =
    "camera_model: pinhole\nresolution: [752, 480]\ndistortion_model: radial-tangential\n"
    "intrinsics: [458.6, 457.2, 367.2, 248.3]\ndistortion_coefficients: [-0.28, 0.07, 0, 0]\n";

TEST_F(YamlMapTest, ACameraIsItsModelSizeAndNumbers) {
  const auto camera = [this](std::string text, const std::string& from, const std::string& to) {
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    return readCameraModel(map(text), "distortion_coefficients");
  };
  const CameraModel model = camera(kCamera, "", "");
  EXPECT_EQ(model.width(), 752);
  EXPECT_EQ(model.height(), 480);
  EXPECT_EQ(model.focal(), Eigen::Vector2d(458.6, 457.2));
  EXPECT_EQ(model.principalPoint(), Eigen::Vector2d(367.2, 248.3));
  EXPECT_EQ(model.parameter("k2"), 0.07);
  // OpenCV writes five coefficients, most often with a fifth of zero.
  EXPECT_TRUE(camera(kCamera, "0, 0]\n", "0, 0, 0.0]\n") == model);
  EXPECT_EQ(camera(kCamera, "0, 0]\n", "0, 0, 0.1]\n").parameter("k3"), 0.1);
  const auto error = [&](const std::string& from, const std::string& to) {
    return dataErrorOf([&] { camera(kCamera, from, to); });
  };
  EXPECT_THAT(error("0, 0]\n", "0, 0, 0.1, 0.1]\n"), HasSubstr("found 6 numbers"));
  EXPECT_THAT(error("[752, 480]", "[752.5, 480]"), HasSubstr("'resolution' to be whole pixels"));
  EXPECT_THAT(error("[752, 480]", "[0, 480]"), HasSubstr("sensor.yaml:2: "));
  EXPECT_THAT(error("[752, 480]", "[752, 100001]"), HasSubstr("whole pixels"));
  EXPECT_THAT(error("pinhole", "panorama"), HasSubstr("the camera model 'panorama' is not"));
  EXPECT_THAT(error("radial-tangential", "fov"),
              AllOf(HasSubstr("sensor.yaml:3: "), HasSubstr("the distortion model 'fov' is not"),
                    HasSubstr("supported is")));
  EXPECT_THAT(error("[458.6,", "[-458.6,"), HasSubstr("sensor.yaml:4: "));
  EXPECT_THAT(error("458.6, ", ""), HasSubstr("found 3 numbers"));
}

TEST_F(YamlMapTest, AFileThatIsNoMapIsNamed) {
  EXPECT_THAT(dataErrorOf([&] { YamlMap((folder_ / "none.yaml").string()); }),
              AllOf(HasSubstr("none.yaml"), HasSubstr("no such file")));
  EXPECT_NE(dataErrorOf([&] { YamlMap(folder_.path()); }), "");
  for (const char* text : {"", "[1, 2]\n", "word\n"})
    EXPECT_THAT(dataErrorOf([&] { map(text); }), HasSubstr("a map of calibration keys")) << text;
  EXPECT_THAT(dataErrorOf([&] { map("a: [1, 2\nb: 3\n"); }), HasSubstr("expected YAML"));
}

}  // namespace
}  // namespace etalon
