#include "gui/flight_window.h"

#include <mrpt/gui/CDisplayWindow3D.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "etalon/core/errors.h"
#include "etalon/report/scene.h"

namespace etalon::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenDrawings{100};
/** A long flight has many landmarks and keyframes, so they are collected only once a second. */
constexpr std::chrono::milliseconds kBetweenMaps{1000};
constexpr int kWidth = 1200, kHeight = 800;  // px, of the window as it opens
constexpr double kImageWidth = 0.38;         ///< of the window's width

/** Draws landmarks that both cameras see green, those of the left one alone amber. */
cv::Mat drawn(const FrontFrame& frame) {
  cv::Mat image;
  cv::cvtColor(frame.images.left, image, cv::COLOR_GRAY2BGR);
  if (!frame.tracked) return image;
  for (const Observation& o : frame.tracked->observations)
    cv::circle(image, cv::Point2d(o.left.x(), o.left.y()), 3,
               o.has_right ? cv::Scalar(60, 220, 60) : cv::Scalar(0, 170, 255), 1, cv::LINE_AA);
  return image;
}

}  // namespace

struct FlightWindow::Impl {
  explicit Impl(Pipeline* p) : pipeline(*p), window("Etalon", kWidth, kHeight) {
    window.setCameraZoom(8.0F);
    window.setCameraElevationDeg(45.0F);
    window.setCameraAzimuthDeg(-60.0F);
    pipeline.onTracks([this](const FrontFrame& frame) {
      if (!frame.images.left.empty()) last = frame;
    });
  }

  void draw(bool with_map) {
    if (!window.isOpen()) return;
    flight.trajectory = pipeline.trajectory();
    if (with_map) {
      flight.keyframes = pipeline.record().smoothed();
      flight.landmarks = pipeline.record().landmarks();
    }
    mrpt::opengl::COpenGLScene::Ptr scene = sceneOf(flight);
    if (last) {
      const cv::Mat image = drawn(*last);
      auto view = scene->createViewport("left image");
      const double height = kImageWidth * kWidth / kHeight * image.rows / image.cols;
      view->setViewportPosition(0.0, 1.0 - height, kImageWidth, height);
      view->setImageView(mrpt::img::CImage(image, mrpt::img::DEEP_COPY));
    }
    window.get3DSceneAndLock() = scene;
    mrpt::opengl::TFontParams font;
    font.color = {0.0F, 0.0F, 0.0F};
    window.addTextMessage(0.01, 0.02, text(), 0, font);
    window.unlockAccess3DScene();
    if (!flight.trajectory.empty()) {
      const Eigen::Vector3f p = flight.trajectory.back().T_WB.t.cast<float>();
      window.setCameraPointingToPoint(p.x(), p.y(), p.z());
    }
    window.forceRepaint();
  }

  std::string text() const {
    char line[128];
    const double seconds = flight.trajectory.empty() ? 0.0
                                                     : secondsBetween(flight.trajectory.front().t,
                                                                      flight.trajectory.back().t);
    std::snprintf(line, sizeof line, "%.1f s  %s  %zu landmarks", seconds,
                  toString(pipeline.state()), flight.landmarks.size());
    return line;
  }

  Pipeline& pipeline;
  mrpt::gui::CDisplayWindow3D window;
  std::optional<FrontFrame> last;
  FlightScene flight;
  Clock::time_point drawn_at, map_at;
};

void FlightWindow::requireDisplay() {
  if (std::getenv("DISPLAY") == nullptr)
    throw ConfigError(
        "--gui: there is no display: DISPLAY is not set; run it in a desktop session, or without "
        "--gui and open flight.3Dscene later");
}

FlightWindow::FlightWindow(Pipeline* pipeline) : impl_(std::make_unique<Impl>(pipeline)) {}

FlightWindow::~FlightWindow() { impl_->pipeline.onTracks(nullptr); }

void FlightWindow::update() {
  const auto now = Clock::now();
  if (now - impl_->drawn_at < kBetweenDrawings) return;
  impl_->drawn_at = now;
  const bool with_map = now - impl_->map_at >= kBetweenMaps;
  if (with_map) impl_->map_at = now;
  impl_->draw(with_map);
}

void FlightWindow::waitUntilClosed() {
  impl_->draw(true);
  if (!impl_->window.isOpen()) return;
  std::printf("replay: close the window to end\n");
  std::fflush(stdout);
  while (impl_->window.isOpen()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace etalon::app
