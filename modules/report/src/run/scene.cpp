#include "etalon/report/scene.h"

#include <mrpt/opengl/CGridPlaneXY.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/opengl/CPointCloud.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/stock_objects.h>

#include <algorithm>

#include "etalon/core/errors.h"
#include "etalon/datasets/observation_conversion.h"

namespace etalon {

namespace {

constexpr double kFarthest = 100.0;       // m; distance of a landmark from the flight's middle
constexpr float kAxes = 0.1F;             // m
constexpr size_t kMostKeyframes = 2'000;  // axes of more are no picture

mrpt::opengl::CSetOfLines::Ptr lineOf(const Trajectory& trajectory, float width,
                                      const mrpt::img::TColor& color, const std::string& name) {
  auto line = mrpt::opengl::CSetOfLines::Create();
  line->setColor_u8(color);
  line->setLineWidth(width);
  line->setName(name);
  for (size_t k = 1; k < trajectory.size(); ++k) {
    const Eigen::Vector3d &a = trajectory[k - 1].T_WB.t, &b = trajectory[k].T_WB.t;
    line->appendLine(a.x(), a.y(), a.z(), b.x(), b.y(), b.z());
  }
  return line;
}

}  // namespace

mrpt::opengl::COpenGLScene::Ptr sceneOf(const FlightScene& flight) {
  auto scene_ptr = mrpt::opengl::COpenGLScene::Create();
  mrpt::opengl::COpenGLScene& scene = *scene_ptr;
  scene.getViewport()->setCustomBackgroundColor({1.0F, 1.0F, 1.0F});
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = low;
  if (!flight.trajectory.empty()) low = high = flight.trajectory.front().T_WB.t;
  for (const StampedPose& pose : flight.trajectory) {
    low = low.cwiseMin(pose.T_WB.t);
    high = high.cwiseMax(pose.T_WB.t);
  }
  auto grid = mrpt::opengl::CGridPlaneXY::Create(
      static_cast<float>(low.x()) - 1.0F, static_cast<float>(high.x()) + 1.0F,
      static_cast<float>(low.y()) - 1.0F, static_cast<float>(high.y()) + 1.0F,
      static_cast<float>(low.z()), 1.0F);
  grid->setColor_u8(mrpt::img::TColor(160, 160, 160));
  scene.insert(grid);
  scene.insert(mrpt::opengl::stock_objects::CornerXYZSimple(0.5F));
  scene.insert(lineOf(flight.trajectory, 2.0F, mrpt::img::TColor(0, 90, 200), "trajectory"));
  if (!flight.ground_truth.empty())
    scene.insert(lineOf(flight.ground_truth, 1.0F, mrpt::img::TColor(0, 0, 0), "ground truth"));
  const size_t every = 1 + flight.keyframes.size() / kMostKeyframes;
  for (size_t k = 0; k < flight.keyframes.size(); k += every) {
    auto axes = mrpt::opengl::stock_objects::CornerXYZSimple(kAxes);
    axes->setPose(toMrptPose(flight.keyframes[k].T_WB));
    scene.insert(axes);
  }
  auto points = mrpt::opengl::CPointCloud::Create();
  points->setName("landmarks");
  points->setPointSize(2.0F);
  points->setColor_u8(mrpt::img::TColor(200, 60, 30));
  const Eigen::Vector3d middle = 0.5 * (low + high);
  for (const auto& [id, p_W] : flight.landmarks)
    if ((p_W - middle).norm() < kFarthest)
      points->insertPoint(static_cast<float>(p_W.x()), static_cast<float>(p_W.y()),
                          static_cast<float>(p_W.z()));
  scene.insert(points);
  return scene_ptr;
}

void writeScene(const std::string& path, const FlightScene& flight) {
  if (!sceneOf(flight)->saveToFile(path)) throw DataError(path, 0, "the scene cannot be written");
}

}  // namespace etalon
