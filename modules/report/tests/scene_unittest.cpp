// The flight as a scene of MRPT: what is in it, where, and what is left out.

#include "etalon/report/scene.h"

#include <gtest/gtest.h>
#include <mrpt/opengl/CGridPlaneXY.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/opengl/CPointCloud.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/CSetOfObjects.h>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

/** Along x from `from`, a metre a pose. */
Trajectory lineFrom(const Vector3d& from, int poses) {
  Trajectory line;
  for (int k = 0; k < poses; ++k)
    line.push_back(
        {k * 50'000'000LL, SE3(Eigen::Matrix3d::Identity(), from + Vector3d(k, 0.0, 0.0))});
  return line;
}

class Scene : public ::testing::Test {
 protected:
  mrpt::opengl::COpenGLScene written(const FlightScene& flight) const {
    const std::string path = folder_ / "flight.3Dscene";
    writeScene(path, flight);
    mrpt::opengl::COpenGLScene scene;
    EXPECT_TRUE(scene.loadFromFile(path));
    return scene;
  }
  template <typename Object>
  static typename Object::Ptr named(mrpt::opengl::COpenGLScene scene, const std::string& name) {
    return std::dynamic_pointer_cast<Object>(scene.getByName(name));
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Scene, HoldsTheLineTheAxesAndThePoints) {
  FlightScene flight;
  flight.trajectory = lineFrom({0.0, 0.0, 1.0}, 5);
  flight.keyframes = {flight.trajectory[0], flight.trajectory[3]};
  flight.landmarks = {{1, {2.0, 3.0, 0.5}}, {2, {-1.0, 0.0, 2.0}}};
  auto scene = written(flight);
  const auto line = named<mrpt::opengl::CSetOfLines>(scene, "trajectory");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->getLineCount(), 4U);
  double x0, y0, z0, x1, y1, z1;
  line->getLineByIndex(3, x0, y0, z0, x1, y1, z1);
  EXPECT_EQ(Vector3d(x0, y0, z0), Vector3d(3.0, 0.0, 1.0));
  EXPECT_EQ(Vector3d(x1, y1, z1), Vector3d(4.0, 0.0, 1.0));
  EXPECT_FALSE(named<mrpt::opengl::CSetOfLines>(scene, "ground truth"));
  const auto points = named<mrpt::opengl::CPointCloud>(scene, "landmarks");
  ASSERT_TRUE(points);
  ASSERT_EQ(points->size(), 2U);
  EXPECT_EQ(points->getPoint3Df(0).y, 3.0F);
  // Axes: W's, and those of two keyframes.
  int axes = 0;
  double farthest = 0.0;
  for (auto it = scene.getViewport()->begin(); it != scene.getViewport()->end(); ++it)
    if (const auto set = std::dynamic_pointer_cast<mrpt::opengl::CSetOfObjects>(*it)) {
      ++axes;
      farthest = std::max(farthest, set->getPoseX());
    }
  EXPECT_EQ(axes, 3);
  EXPECT_EQ(farthest, 3.0);
}

TEST_F(Scene, GroundTruthIsALineOfItsOwn) {
  FlightScene flight;
  flight.trajectory = lineFrom({0.0, 0.0, 0.0}, 3);
  flight.ground_truth = lineFrom({0.0, 1.0, 0.0}, 7);
  const auto line = named<mrpt::opengl::CSetOfLines>(written(flight), "ground truth");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->getLineCount(), 6U);
}

TEST_F(Scene, FarLandmarksAreLeftOutWhereverTheFlightIs) {
  // The distance counts from the flight's middle, also of a flight far from W's origin.
  for (const double away : {0.0, -1000.0}) {
    const Vector3d from(away, 0.0, 0.0);
    FlightScene flight;
    flight.trajectory = lineFrom(from, 11);  // its middle is 5 m on
    flight.landmarks = {{1, from + Vector3d(5.0, 99.0, 0.0)},
                        {2, from + Vector3d(5.0, 101.0, 0.0)},
                        {3, from + Vector3d(-94.0, 0.0, 0.0)},
                        {4, from + Vector3d(-96.0, 0.0, 0.0)}};
    const auto points = named<mrpt::opengl::CPointCloud>(written(flight), "landmarks");
    ASSERT_TRUE(points);
    ASSERT_EQ(points->size(), 2U) << away;
    EXPECT_EQ(points->getPoint3Df(0).y, 99.0F);
  }
}

TEST_F(Scene, TheGridLiesBelowTheFlight) {
  FlightScene flight;
  flight.trajectory = lineFrom({100.0, 200.0, 30.0}, 11);
  flight.trajectory[4].T_WB.t.z() = 28.0;
  auto scene = written(flight);
  const auto grid = scene.getByClass<mrpt::opengl::CGridPlaneXY>();
  ASSERT_TRUE(grid);
  float x0, x1, y0, y1;
  grid->getPlaneLimits(x0, x1, y0, y1);
  EXPECT_EQ(x0, 99.0F);
  EXPECT_EQ(x1, 111.0F);
  EXPECT_EQ(y0, 199.0F);
  EXPECT_EQ(y1, 201.0F);
  EXPECT_EQ(grid->getPlaneZcoord(), 28.0F);
}

TEST_F(Scene, OfAnEmptyFlightThereIsOne) {
  auto scene = written({});
  EXPECT_EQ(named<mrpt::opengl::CSetOfLines>(scene, "trajectory")->getLineCount(), 0U);
  EXPECT_EQ(named<mrpt::opengl::CPointCloud>(scene, "landmarks")->size(), 0U);
}

TEST_F(Scene, OfALongFlightNotEveryKeyframeHasAxes) {
  FlightScene flight;
  flight.trajectory = lineFrom({0.0, 0.0, 0.0}, 2);
  flight.keyframes = lineFrom({0.0, 0.0, 0.0}, 5000);
  auto scene = written(flight);
  int axes = 0;
  for (auto it = scene.getViewport()->begin(); it != scene.getViewport()->end(); ++it)
    axes += std::dynamic_pointer_cast<mrpt::opengl::CSetOfObjects>(*it) != nullptr;
  EXPECT_EQ(axes, 1 + 1667);  // every third
}

TEST_F(Scene, AFileThatCannotBeWrittenIsAnError) {
  EXPECT_THROW(writeScene(folder_ / "no/such/folder/flight.3Dscene", {}), DataError);
}

}  // namespace
}  // namespace etalon
